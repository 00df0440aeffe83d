/** Pure geometry of paths: no WebGL here. */

export interface Mesh { positions: Float32Array; indices: Uint32Array }

/** Every k-th of n numbers' rows such that at most `most` are left; first and last always among them. */
export function thin(rows: number, most: number): number[] {
  if (rows <= most) return Array.from({ length: rows }, (_, i) => i);
  return Array.from({ length: most }, (_, i) => Math.round((i * (rows - 1)) / (most - 1)));
}

/** x y z of every row of width `width`. */
export function positionsOf(rows: ArrayLike<number>, width: number): Float32Array {
  const count = Math.floor(rows.length / width);
  const out = new Float32Array(3 * count);
  for (let i = 0; i < count; ++i) {
    for (let k = 0; k < 3; ++k) out[3 * i + k] = rows[width * i + k] ?? 0;
  }
  return out;
}

type V = [number, number, number];
const sub = (a: V, b: V): V => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a: V, b: V): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: V, b: V): V => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
function unit(a: V): V | undefined {
  const length = Math.hypot(a[0], a[1], a[2]);
  return length > 1e-9 ? [a[0] / length, a[1] / length, a[2] / length] : undefined;
}

/**
 * A tube about a polyline (x y z a point) with a radius at each point. Its rings are carried along without twist; where the line
 * stands still the ring stays as it was. Empty for fewer than two points.
 */
export function tube(points: Float32Array, radii: ArrayLike<number>, sides = 10): Mesh {
  const count = points.length / 3;
  if (count < 2) return { positions: new Float32Array(0), indices: new Uint32Array(0) };
  const at = (i: number): V => [points[3 * i] ?? 0, points[3 * i + 1] ?? 0, points[3 * i + 2] ?? 0];
  const positions = new Float32Array(3 * sides * count);
  let tangent: V = [0, 0, 1];
  for (let i = 0; i + 1 < count; ++i) {
    const first = unit(sub(at(i + 1), at(i)));
    if (first !== undefined) {
      tangent = first;
      break;
    }
  }
  let normal = unit(cross(tangent, Math.abs(tangent[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])) ?? [1, 0, 0];
  for (let i = 0; i < count; ++i) {
    tangent = unit(sub(at(Math.min(i + 1, count - 1)), at(Math.max(i - 1, 0)))) ?? tangent;
    const along = dot(normal, tangent);
    normal = unit(sub(normal, [tangent[0] * along, tangent[1] * along, tangent[2] * along])) ?? normal;
    const binormal = cross(tangent, normal);
    const centre = at(i);
    const radius = Math.max(0, radii[i] ?? 0);
    for (let s = 0; s < sides; ++s) {
      const angle = (2 * Math.PI * s) / sides;
      for (let k = 0; k < 3; ++k) {
        const out = Math.cos(angle) * (normal[k] ?? 0) + Math.sin(angle) * (binormal[k] ?? 0);
        positions[3 * (sides * i + s) + k] = (centre[k] ?? 0) + radius * out;
      }
    }
  }
  const indices = new Uint32Array(6 * sides * (count - 1));
  let to = 0;
  for (let i = 0; i + 1 < count; ++i) {
    for (let s = 0; s < sides; ++s) {
      const a = sides * i + s;
      const b = sides * i + ((s + 1) % sides);
      for (const corner of [a, b, a + sides, b, b + sides, a + sides]) indices[to++] = corner;
    }
  }
  return { positions, indices };
}

/** Between two colours (each r g b in [0, 1]) as `weights` say, three numbers a weight. */
export function blend(from: readonly number[], to: readonly number[], weights: ArrayLike<number>): Float32Array {
  const out = new Float32Array(3 * weights.length);
  for (let i = 0; i < weights.length; ++i) {
    const w = Math.min(1, Math.max(0, Number(weights[i]) || 0));
    for (let k = 0; k < 3; ++k) out[3 * i + k] = (1 - w) * (from[k] ?? 0) + w * (to[k] ?? 0);
  }
  return out;
}

/** The largest of each row's values; n rows of `width`. Zeros where there are none. */
export function rowMaxima(values: ArrayLike<number>, rows: number, width: number): Float32Array {
  const out = new Float32Array(rows);
  for (let i = 0; i < rows; ++i) {
    for (let k = 0; k < width; ++k) out[i] = Math.max(out[i] ?? 0, Number(values[width * i + k]) || 0);
  }
  return out;
}
