import * as THREE from "three";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { tube } from "../tube";

/** A polyline of some pixels' width that is drawn anew as its points change. */
export class PathLine {
  readonly group = new THREE.Group();
  private readonly material: LineMaterial;
  private line: Line2 | undefined;

  constructor(width_px: number, dashed = false) {
    this.material = new LineMaterial({ linewidth: width_px, dashed, dashSize: 0.012, gapSize: 0.008, transparent: true });
    if (dashed) this.material.defines["USE_DASH"] = "";
  }

  /** x y z a point; colours, where there are any, r g b a point. */
  set(points: Float32Array, colours?: Float32Array): void {
    this.clear();
    if (points.length < 6) return;
    const geometry = new LineGeometry();
    geometry.setPositions(points);
    this.material.vertexColors = colours !== undefined;
    if (colours !== undefined) {
      this.material.color.set(0xffffff);
      geometry.setColors(colours);
    }
    this.material.needsUpdate = true;
    this.line = new Line2(geometry, this.material);
    if (this.material.dashed) this.line.computeLineDistances();
    this.group.add(this.line);
  }

  colour(value: number, opacity = 1): void {
    if (!this.material.vertexColors) this.material.color.set(value);
    this.material.opacity = opacity;
  }

  get empty(): boolean {
    return this.line === undefined;
  }

  clear(): void {
    if (this.line === undefined) return;
    this.group.remove(this.line);
    this.line.geometry.dispose();
    this.line = undefined;
  }
}

/** How far off the answer may be: a veil about its path. */
export class Veil {
  readonly mesh = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.16, depthWrite: false, side: THREE.DoubleSide }));

  set(points: Float32Array, radii: ArrayLike<number>): void {
    const { positions, indices } = tube(points, radii, 12);
    this.mesh.geometry.dispose();
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
    geometry.setIndex(new THREE.BufferAttribute(indices, 1));
    this.mesh.geometry = geometry;
    this.mesh.visible = indices.length > 0;
  }

  colour(value: number): void {
    this.mesh.material.color.set(value);
  }
}

/** All trials' paths as one object. */
export class Bundle {
  readonly lines = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ transparent: true, opacity: 0.75 }));

  set(paths: readonly Float32Array[]): void {
    const pairs: number[] = [];
    for (const path of paths) {
      for (let i = 0; i + 5 < path.length; i += 3) {
        for (let k = 0; k < 6; ++k) pairs.push(path[i + k] ?? 0);
      }
    }
    this.lines.geometry.dispose();
    this.lines.geometry = new THREE.BufferGeometry();
    this.lines.geometry.setAttribute("position", new THREE.Float32BufferAttribute(pairs, 3));
  }

  colour(value: number): void {
    this.lines.material.color.set(value);
  }
}
