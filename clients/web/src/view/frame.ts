import * as THREE from "three";

/** The camera stays so far from the nearest point. */
const NEAREST_M = 0.1;

/** The eight corners of a box. */
export function cornersOf(box: THREE.Box3): THREE.Vector3[] {
  if (box.isEmpty()) return [];
  const corners: THREE.Vector3[] = [];
  for (const x of [box.min.x, box.max.x]) {
    for (const y of [box.min.y, box.max.y]) {
      for (const z of [box.min.z, box.max.z]) corners.push(new THREE.Vector3(x, y, z));
    }
  }
  return corners;
}

/** Where a camera stands and what it looks at. */
export interface Frame {
  readonly target: THREE.Vector3;
  readonly position: THREE.Vector3;
}

/**
 * The nearest camera that has all the points in its picture, in the middle of it. `towards`: from what is looked at to the camera, of any length, not along `up`. `fov_deg`: the
 * picture's height as an angle; `aspect`: its width over its height; `margin`: the share of it that is left free at each edge.
 */
export function frameOf(points: readonly THREE.Vector3[], towards: THREE.Vector3, up: THREE.Vector3, fov_deg: number, aspect: number, margin: number): Frame {
  const back = towards.clone().normalize();
  const right = new THREE.Vector3().crossVectors(up, back).normalize();
  const over = new THREE.Vector3().crossVectors(back, right);
  const tall = Math.tan(THREE.MathUtils.degToRad(fov_deg) / 2) * (1 - 2 * margin);
  const wide = tall * aspect;
  const middle = points.reduce((sum, p) => sum.add(p), new THREE.Vector3()).divideScalar(Math.max(1, points.length));
  // With the camera at (u, v, d) a point (x, y, z) is within the right edge where x - u <= (d - z) wide, and so on: each edge bounds u - d wide or u + d wide.
  let [rightmost, leftmost, highest, lowest, nearest] = [-Infinity, Infinity, -Infinity, Infinity, -Infinity];
  for (const p of points) {
    const way = p.clone().sub(middle);
    const [x, y, z] = [way.dot(right), way.dot(over), way.dot(back)];
    rightmost = Math.max(rightmost, x + z * wide);
    leftmost = Math.min(leftmost, x - z * wide);
    highest = Math.max(highest, y + z * tall);
    lowest = Math.min(lowest, y - z * tall);
    nearest = Math.max(nearest, z);
  }
  if (points.length === 0) return { target: middle, position: middle.clone().add(back) };
  const distance = Math.max((rightmost - leftmost) / (2 * wide), (highest - lowest) / (2 * tall), nearest + NEAREST_M);
  const target = middle.clone().addScaledVector(right, (rightmost + leftmost) / 2).addScaledVector(over, (highest + lowest) / 2);
  return { target, position: target.clone().addScaledVector(back, distance) };
}
