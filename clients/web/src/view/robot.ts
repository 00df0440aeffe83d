import * as THREE from "three";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";
import { ColladaLoader } from "three/examples/jsm/loaders/ColladaLoader.js";
import URDFLoader, { type URDFRobot } from "urdf-loader";
import type { RobotDescription, ScalarSeries } from "../types";
import { cornersOf } from "./frame";

const FILES = "/robot/files/";

/** Of the robot's files the one that a URDF's mesh path means: the longest common ending counts. */
export function fileOf(path: string, files: readonly string[]): string | undefined {
  const wanted = path.split("/");
  let best: string | undefined;
  let most = 0;
  for (const file of files) {
    const parts = file.split("/");
    let same = 0;
    while (same < parts.length && same < wanted.length && parts[parts.length - 1 - same] === wanted[wanted.length - 1 - same]) ++same;
    if (same > most) {
      most = same;
      best = file;
    }
  }
  return best;
}

/** The robot as its URDF draws it, in its base frame, and a bare twin for reckoning where its tool is. */
export class Robot {
  readonly group = new THREE.Group();
  readonly missing: string[] = [];
  private readonly drawn: URDFRobot;
  private readonly bare: URDFRobot;
  private readonly names: ReadonlySet<string>;

  private constructor(
    readonly description: RobotDescription,
    urdf: string,
    onChange: () => void,
  ) {
    this.drawn = this.parse(urdf, onChange);
    this.bare = this.parse(urdf, undefined);
    this.group.add(this.drawn);
    this.names = new Set(Object.keys(this.drawn.joints));
    for (const robot of [this.drawn, this.bare]) {
      const base = robot.links[description.base];
      if (base === undefined) continue;
      robot.updateMatrixWorld(true);
      const base_T_root = base.matrixWorld.clone().invert().multiply(robot.matrixWorld);
      base_T_root.decompose(robot.position, robot.quaternion, robot.scale);
    }
    this.setJoints(Object.keys(description.home), Object.values(description.home));
  }

  static async load(description: RobotDescription, onChange: () => void): Promise<Robot> {
    const answer = await fetch(FILES + description.urdf);
    if (!answer.ok) throw new Error(`the robot's ${description.urdf} cannot be loaded (HTTP status ${answer.status})`);
    return new Robot(description, await answer.text(), onChange);
  }

  /** rad or m; names that the URDF does not have are left out. */
  setJoints(names: readonly string[], positions: readonly number[]): void {
    this.apply(this.drawn, names, positions);
  }

  /** The corners of its parts' boxes, base frame. */
  outline(): THREE.Vector3[] {
    this.group.updateMatrixWorld(true);
    const corners: THREE.Vector3[] = [];
    this.group.traverse((part) => {
      if (!(part instanceof THREE.Mesh)) return;
      const geometry = part.geometry as THREE.BufferGeometry;
      if (geometry.boundingBox === null) geometry.computeBoundingBox();
      if (geometry.boundingBox !== null) corners.push(...cornersOf(geometry.boundingBox).map((corner) => corner.applyMatrix4(part.matrixWorld)));
    });
    return corners;
  }

  /** Where the drawn robot's tool is, base frame. */
  tool(): THREE.Vector3 {
    return this.tipOf(this.drawn);
  }

  /** x y z of the tool for each row of joint values, base frame. */
  toolPath(joints: ScalarSeries, rows: readonly number[]): Float32Array {
    const out = new Float32Array(3 * rows.length);
    const width = joints.names.length;
    rows.forEach((row, i) => {
      this.apply(this.bare, joints.names, joints.values.slice(width * row, width * (row + 1)));
      this.tipOf(this.bare).toArray(out, 3 * i);
    });
    return out;
  }

  /** Whether these joints move the tool. */
  knows(names: readonly string[]): boolean {
    return this.description.joints.every((joint) => names.includes(joint));
  }

  private apply(robot: URDFRobot, names: readonly string[], positions: readonly number[]): void {
    names.forEach((name, i) => {
      const value = positions[i];
      if (value !== undefined && Number.isFinite(value) && this.names?.has(name) !== false) robot.joints[name]?.setJointValue(value);
    });
  }

  private tipOf(robot: URDFRobot): THREE.Vector3 {
    robot.updateMatrixWorld(true);
    const tip = robot.links[this.description.tip];
    return new THREE.Vector3().setFromMatrixPosition((tip ?? robot).matrixWorld);
  }

  private parse(urdf: string, onChange: (() => void) | undefined): URDFRobot {
    const loader = new URDFLoader();
    loader.packages = (name: string) => name;
    loader.parseVisual = onChange !== undefined;
    loader.parseCollision = false;
    loader.loadMeshCb = (path, _manager, material, done) => {
      const file = fileOf(path, this.description.files);
      if (file === undefined) {
        this.missing.push(path);
        done(new THREE.Group());
        return;
      }
      const failed = (): void => {
        this.missing.push(file);
        onChange?.();
      };
      const url = FILES + file.split("/").map(encodeURIComponent).join("/");
      const arrived = (object: THREE.Object3D): void => {
        done(object);
        onChange?.();
      };
      if (/\.stl$/i.test(file)) {
        new STLLoader().load(url, (geometry) => arrived(new THREE.Mesh(geometry, material)), undefined, failed);
      } else if (/\.dae$/i.test(file)) {
        new ColladaLoader().load(url, (collada) => arrived(collada?.scene ?? new THREE.Group()), undefined, failed);
      } else {
        failed();
        done(new THREE.Group());
      }
    };
    return loader.parse(urdf);
  }
}
