import * as THREE from "three";
import type { ListPose, SceneBody } from "../types";
import type { Palette } from "./theme";

function geometryOf(body: SceneBody): THREE.BufferGeometry {
  const [a = 0.03, b = 0.03, c = 0.03] = body.size;
  switch (body.shape) {
    case "box":
      return new THREE.BoxGeometry(a, b, c);
    case "sphere":
      return new THREE.SphereGeometry(a, 32, 20);
    case "cylinder":
      return new THREE.CylinderGeometry(a, a, b, 40).rotateX(Math.PI / 2);
    case "capsule":
      return new THREE.CapsuleGeometry(a, b, 8, 24).rotateX(Math.PI / 2);
  }
}

function place(object: THREE.Object3D, pose: ListPose): void {
  object.position.set(...pose.position);
  object.quaternion.set(...pose.quaternion);
}

/** What stands around the robot, and what was seen there. */
export class Things {
  readonly group = new THREE.Group();
  private readonly things = new Map<string, { frame: THREE.Group; mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>; kind: SceneBody["kind"]; seen_ms: number }>();
  private palette: Palette;

  constructor(palette: Palette) {
    this.palette = palette;
  }

  setScene(bodies: readonly SceneBody[]): void {
    for (const body of bodies) this.add(body);
    this.colour(this.palette);
  }

  /** Puts an object where it was seen; one that the scene does not know becomes a small cube. */
  see(name: string, position: readonly number[], quaternion: readonly number[] | undefined, now_ms: number): void {
    let thing = this.things.get(name);
    if (thing === undefined || thing.kind === "obstacle") {
      const identity: ListPose = { position: [0, 0, 0], quaternion: [0, 0, 0, 1] };
      thing = this.add({ name, kind: "object", shape: "box", size: [0.03, 0.03, 0.03], pose: identity, offset: identity });
      this.colour(this.palette);
    }
    thing.frame.position.set(position[0] ?? 0, position[1] ?? 0, position[2] ?? 0);
    if (quaternion !== undefined) thing.frame.quaternion.set(quaternion[0] ?? 0, quaternion[1] ?? 0, quaternion[2] ?? 0, quaternion[3] ?? 1);
    thing.seen_ms = now_ms;
  }

  /** Names and places of the objects that were seen, for their labels. */
  *seen(now_ms: number, within_ms: number): Generator<{ name: string; position: THREE.Vector3; fresh: boolean }> {
    for (const [name, thing] of this.things) {
      if (thing.seen_ms > 0) yield { name, position: thing.frame.position, fresh: now_ms - thing.seen_ms < within_ms };
    }
  }

  lowest(): number {
    const box = new THREE.Box3().setFromObject(this.group);
    return box.isEmpty() ? 0 : box.min.z;
  }

  colour(palette: Palette): void {
    this.palette = palette;
    for (const thing of this.things.values()) {
      thing.mesh.material.color.set(thing.kind === "obstacle" ? palette.table : thing.seen_ms > 0 || thing.kind === "button" ? palette.seen : palette.body);
    }
  }

  private add(body: SceneBody): { frame: THREE.Group; mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>; kind: SceneBody["kind"]; seen_ms: number } {
    const frame = new THREE.Group();
    const mesh = new THREE.Mesh(geometryOf(body), new THREE.MeshStandardMaterial({ roughness: 0.85, metalness: 0 }));
    place(frame, body.pose);
    place(mesh, body.offset);
    frame.add(mesh);
    this.group.add(frame);
    const thing = { frame, mesh, kind: body.kind, seen_ms: 0 };
    this.things.set(body.name, thing);
    return thing;
  }
}

/** What a person drags to ask "and if it stood here?". */
export class Handle {
  readonly group = new THREE.Group();
  /** Larger than what is seen, for fingers. */
  readonly grip = new THREE.Mesh(new THREE.SphereGeometry(0.055, 12, 8), new THREE.MeshBasicMaterial({ visible: false }));
  private readonly material = new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.95 });
  private readonly disc = new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.18, side: THREE.DoubleSide, depthWrite: false });

  constructor(readonly name: string) {
    const ring = new THREE.Mesh(new THREE.TorusGeometry(0.04, 0.003, 10, 56), this.material);
    const dot = new THREE.Mesh(new THREE.SphereGeometry(0.008, 20, 14), this.material);
    const plate = new THREE.Mesh(new THREE.CircleGeometry(0.04, 48), this.disc);
    this.group.add(ring, dot, plate, this.grip);
    this.grip.userData["handle"] = name;
  }

  colour(palette: Palette, held: boolean): void {
    this.material.color.set(palette.handle);
    this.disc.color.set(palette.handle);
    this.disc.opacity = held ? 0.4 : 0.18;
  }
}
