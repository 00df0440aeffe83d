import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { blend, positionsOf, rowMaxima } from "../tube";
import type { RobotDescription, SceneBody, ScalarSeries, SkillMotion } from "../types";
import { cornersOf, frameOf } from "./frame";
import { Bundle, PathLine, Veil } from "./paths";
import { Robot } from "./robot";
import { dark, light, rgb, type Palette } from "./theme";
import { Handle, Things } from "./things";

THREE.Object3D.DEFAULT_UP.set(0, 0, 1);

export type Layer = "trials" | "answer" | "plan" | "measured";
const SEEN_FOR_MS = 3000;
const STEP_M = 0.01;
/** Nearer than this, an object and the place asked about share a label. */
const ONE_LABEL_M = 0.03;
const FARTHEST_M = 3;
/** Of the picture, free at each edge of what is framed. */
const MARGIN = 0.06;
const TRAIL_MS = 120;
const TRAIL_POINTS = 4000;

/** Whether WebGL is reckoned by the processor here: then smooth edges cost more than they are worth. */
function isSoftware(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  const names = gl?.getExtension("WEBGL_debug_renderer_info");
  const renderer = names ? String(gl?.getParameter(names.UNMASKED_RENDERER_WEBGL)) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(renderer);
}

/** The picture: everything in the robot's base frame, z up, metres. Drawn when something changed. */
export class View {
  /** A person moved an object; called for every movement. */
  onMove: (name: string, position: THREE.Vector3) => void = () => undefined;

  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(38, 1, 0.02, 50);
  private readonly controls: OrbitControls;
  private readonly things: Things;
  private readonly lamp = new THREE.DirectionalLight(0xffffff, 1.7);
  private readonly sky = new THREE.HemisphereLight(0xffffff, 0x8a8f98, 1.6);
  private grid: THREE.GridHelper | undefined;
  private readonly trials = new Bundle();
  private readonly answer = new PathLine(4);
  private readonly veil = new Veil();
  private readonly plan = new PathLine(2.5, true);
  private readonly measured = new PathLine(3.5);
  private readonly handles = new Map<string, Handle>();
  private readonly labels = new Map<string, HTMLElement>();
  private robot: Robot | undefined;
  private palette: Palette = light;
  private motion: SkillMotion | undefined;
  private trail: number[] = [];
  private trailGrew = false;
  private trailDrawn_ms = 0;
  private changed = true;
  private drawn: (() => void)[] = [];
  private frames: number[] = [];
  private isHeld = false; // a person has turned the view
  private isFramed = false; // around the answer that is shown

  constructor(private readonly box: HTMLElement) {
    const slow = isSoftware();
    this.renderer = new THREE.WebGLRenderer({ antialias: !slow, powerPreference: "high-performance" });
    this.renderer.setPixelRatio(slow ? 1 : Math.min(devicePixelRatio, 2));
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application");
    canvas.setAttribute("aria-label", "The robot, its objects and paths. Arrow keys move the object by a centimetre, Page Up and Page Down lift and lower it.");
    box.append(canvas);
    this.things = new Things(this.palette);
    this.scene.add(this.sky, this.lamp, this.things.group, this.trials.lines, this.veil.mesh, this.answer.group, this.plan.group, this.measured.group);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.maxDistance = 8;
    this.controls.minDistance = 0.15;
    this.controls.addEventListener("change", () => this.touch());
    this.controls.addEventListener("start", () => (this.isHeld = true));
    this.home();
    this.listenForDrags(canvas);
    canvas.addEventListener("keydown", (event) => this.onKey(event));
    new ResizeObserver(() => this.resize()).observe(box);
    this.resize();
    this.setTheme(false);
    const loop = (): void => {
      requestAnimationFrame(loop);
      this.draw();
    };
    loop();
  }

  // ---- what is there ----

  async setRobot(description: RobotDescription): Promise<readonly string[]> {
    if (this.robot !== undefined) this.scene.remove(this.robot.group);
    this.robot = await Robot.load(description, () => this.touch());
    this.scene.add(this.robot.group);
    this.home();
    this.setGround();
    return this.robot.missing;
  }

  setScene(bodies: readonly SceneBody[]): void {
    this.things.setScene(bodies);
    this.setGround();
    this.touch();
  }

  setTheme(isDark: boolean): void {
    this.palette = isDark ? dark : light;
    const p = this.palette;
    this.scene.background = new THREE.Color(p.background);
    this.sky.intensity = isDark ? 1.1 : 1.6;
    this.lamp.intensity = isDark ? 1.3 : 1.7;
    this.things.colour(p);
    this.trials.colour(p.trial);
    this.veil.colour(p.sigma);
    this.plan.colour(p.plan, 0.95);
    this.measured.colour(p.measured);
    for (const handle of this.handles.values()) handle.colour(p, false);
    this.drawAnswer();
    this.setGround();
    this.touch();
  }

  show(layer: Layer, visible: boolean): void {
    const parts: Record<Layer, THREE.Object3D[]> = {
      trials: [this.trials.lines], answer: [this.answer.group, this.veil.mesh], plan: [this.plan.group], measured: [this.measured.group],
    };
    for (const part of parts[layer]) part.visible = visible;
    this.touch();
  }

  // ---- what moves ----

  /** Where the tool is then; nothing without a robot. */
  setJoints(names: readonly string[], positions: readonly number[]): THREE.Vector3 | undefined {
    if (this.robot === undefined) return undefined;
    this.robot.setJoints(names, positions);
    this.touch();
    return this.robot.tool();
  }

  see(name: string, position: readonly number[], quaternion: readonly number[] | undefined): void {
    this.things.see(name, position, quaternion, performance.now());
    this.touch();
  }

  // ---- paths ----

  setTrials(paths: readonly Float32Array[]): void {
    this.trials.set(paths);
    if (!this.isHeld) this.home();
    this.touch();
  }

  /** Tool path of joints by the robot's own kinematics; nothing where they are not this robot's. */
  toolPath(joints: ScalarSeries, rows: readonly number[]): Float32Array | undefined {
    return this.robot?.knows(joints.names) === true ? this.robot.toolPath(joints, rows) : undefined;
  }

  setAnswer(motion: SkillMotion | undefined): void {
    this.motion = motion;
    this.drawAnswer();
    if (motion === undefined) this.isFramed = false;
    if (motion !== undefined && !this.isFramed && !this.isHeld) this.home();
    this.touch();
  }

  setPlan(tool_m: readonly number[]): void {
    this.plan.set(positionsOf(tool_m, 3));
    this.plan.colour(this.palette.plan, 0.95);
    this.touch();
  }

  beginTrail(): void {
    this.trail = [];
    this.measured.clear();
    this.touch();
  }

  addToTrail(position: THREE.Vector3): void {
    const n = this.trail.length;
    const last = new THREE.Vector3(this.trail[n - 3] ?? 1e9, this.trail[n - 2] ?? 0, this.trail[n - 1] ?? 0);
    if (last.distanceTo(position) < 5e-4) return;
    this.trail.push(position.x, position.y, position.z);
    if (this.trail.length > 3 * TRAIL_POINTS) this.trail.splice(0, 3 * (TRAIL_POINTS / 4)); // teleoperation has no end
    this.trailGrew = true;
    this.touch();
  }

  /** The tool's way as the robot measured it, in place of the trail. */
  setMeasured(points: Float32Array): void {
    this.trailGrew = false;
    this.measured.set(points);
    this.measured.colour(this.palette.measured);
    this.touch();
  }

  // ---- what a person holds ----

  /** Which objects may be dragged, and where they stand. */
  setHandles(places: ReadonlyMap<string, THREE.Vector3>): void {
    for (const [name, handle] of this.handles) {
      if (places.has(name)) continue;
      this.scene.remove(handle.group);
      this.handles.delete(name);
    }
    for (const [name, place] of places) {
      let handle = this.handles.get(name);
      if (handle === undefined) {
        handle = new Handle(name);
        handle.colour(this.palette, false);
        this.handles.set(name, handle);
        this.scene.add(handle.group);
      }
      handle.group.position.copy(place);
    }
    this.touch();
  }

  /** All there is in one picture, from the side; until a person turns the view, it stays so. */
  home(): void {
    this.isHeld = false;
    this.isFramed = this.motion !== undefined;
    this.lookFrom(new THREE.Vector3(0.9, -0.9, 0.66));
  }

  fromAbove(): void {
    this.isHeld = true;
    this.lookFrom(new THREE.Vector3(-0.01, 0, 1.7));
  }

  private lookFrom(towards: THREE.Vector3): void {
    const points = this.robot?.outline() ?? [];
    for (const handle of this.handles.values()) points.push(handle.group.position);
    for (const path of [this.trials.lines, this.answer.group]) points.push(...cornersOf(new THREE.Box3().setFromObject(path)));
    if (points.length === 0) points.push(...cornersOf(new THREE.Box3(new THREE.Vector3(0, -0.6, 0), new THREE.Vector3(0.9, 0.4, 0.6))));
    const frame = frameOf(points, towards, this.camera.up, this.camera.fov, this.camera.aspect, MARGIN);
    this.controls.target.copy(frame.target);
    this.camera.position.copy(frame.position);
    this.controls.update();
    this.touch();
  }

  /** Called once, after the next picture is on its way to the screen. */
  afterNextPicture(then: () => void): void {
    this.drawn.push(then);
    this.touch();
  }

  /** Pictures in the last second. */
  picturesPerSecond(): number {
    const now = performance.now();
    this.frames = this.frames.filter((time) => now - time < 1000);
    return this.frames.length;
  }

  touch(): void {
    this.changed = true;
  }

  // ---- inside ----

  private drawAnswer(): void {
    const motion = this.motion;
    if (motion === undefined || motion.tool.length === 0) {
      this.answer.clear();
      this.veil.mesh.visible = false;
      return;
    }
    const points = positionsOf(motion.tool, 7);
    const rows = points.length / 3;
    const weights = rowMaxima(motion.objectivity, rows, motion.object_names.length);
    this.answer.set(points, blend(rgb(this.palette.answer), rgb(this.palette.objective), weights));
    this.veil.set(points, motion.sigma_m);
  }

  /** A line cannot grow, only be made anew: not for every sample. */
  private drawTrail(): void {
    const now = performance.now();
    if (!this.trailGrew || now - this.trailDrawn_ms < TRAIL_MS) return;
    this.trailDrawn_ms = now;
    this.setMeasured(Float32Array.from(this.trail));
  }

  private setGround(): void {
    if (this.grid !== undefined) this.scene.remove(this.grid);
    let height = this.things.lowest();
    if (this.robot !== undefined) height = Math.min(height, new THREE.Box3().setFromObject(this.robot.group).min.z);
    this.grid = new THREE.GridHelper(4, 20, this.palette.gridMain, this.palette.grid);
    this.grid.rotateX(Math.PI / 2);
    this.grid.position.z = Math.max(-3, Math.min(0, height)) - 0.002;
    this.scene.add(this.grid);
    this.touch();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.box;
    if (width === 0 || height === 0) return;
    this.camera.aspect = width / height;
    this.camera.fov = width < height ? 52 : 38;
    this.camera.updateProjectionMatrix();
    this.renderer.setSize(width, height);
    if (!this.isHeld) this.home();
    this.touch();
  }

  private draw(): void {
    if (!this.changed || document.hidden) return;
    this.changed = false;
    this.drawTrail();
    this.lamp.position.copy(this.camera.position).add(new THREE.Vector3(0.4, 0.6, 1.2));
    this.renderer.render(this.scene, this.camera);
    this.frames.push(performance.now());
    if (this.frames.length > 200) this.frames.splice(0, 100);
    this.drawLabels();
    const then = this.drawn;
    this.drawn = [];
    for (const one of then) one();
  }

  private toScreen(point: THREE.Vector3): { x: number; y: number; visible: boolean } {
    const p = point.clone().project(this.camera);
    return { x: (0.5 + p.x / 2) * this.box.clientWidth, y: (0.5 - p.y / 2) * this.box.clientHeight, visible: p.z < 1 && Math.abs(p.x) < 1 && Math.abs(p.y) < 1 };
  }

  private drawLabels(): void {
    const wanted = new Set<string>();
    for (const { name, position, fresh } of this.things.seen(performance.now(), SEEN_FOR_MS)) {
      if ((this.handles.get(name)?.group.position.distanceTo(position) ?? 1) < ONE_LABEL_M) continue;
      this.label(`seen ${name}`, fresh ? `${name} (seen)` : `${name} (not seen now)`, position, 24);
      wanted.add(`seen ${name}`);
    }
    for (const [name, handle] of this.handles) {
      this.label(`ask ${name}`, name, handle.group.position, -36);
      wanted.add(`ask ${name}`);
      const at = this.toScreen(handle.group.position);
      this.box.dataset[`handle_${name}`] = `${at.x.toFixed(1)},${at.y.toFixed(1)}`;
    }
    for (const [key, element] of this.labels) {
      if (wanted.has(key)) continue;
      element.remove();
      this.labels.delete(key);
    }
  }

  private label(key: string, text: string, point: THREE.Vector3, down_px: number): void {
    let element = this.labels.get(key);
    if (element === undefined) {
      element = document.createElement("span");
      element.className = key.startsWith("ask") ? "label ask" : "label";
      this.labels.set(key, element);
      this.box.append(element);
    }
    if (element.textContent !== text) element.textContent = text;
    const { x, y, visible } = this.toScreen(point);
    element.hidden = !visible;
    element.style.transform = `translate(${x.toFixed(1)}px, ${(y + down_px).toFixed(1)}px) translate(-50%, -50%)`;
  }

  private listenForDrags(canvas: HTMLCanvasElement): void {
    const ray = new THREE.Raycaster();
    const plane = new THREE.Plane();
    const offset = new THREE.Vector3();
    const hit = new THREE.Vector3();
    let held: Handle | undefined;
    let lifting = false;
    const aim = (event: PointerEvent): void => {
      const box = canvas.getBoundingClientRect();
      ray.setFromCamera(new THREE.Vector2(((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2), this.camera);
    };
    const found = (): Handle | undefined => {
      const hits = ray.intersectObjects([...this.handles.values()].map((handle) => handle.grip));
      return this.handles.get(String(hits[0]?.object.userData["handle"] ?? ""));
    };
    const hold = (upwards: boolean): void => {
      if (held === undefined) return;
      lifting = upwards;
      const place = held.group.position;
      const normal = upwards ? this.camera.getWorldDirection(new THREE.Vector3()).setZ(0).normalize() : new THREE.Vector3(0, 0, 1);
      plane.setFromNormalAndCoplanarPoint(normal, place);
      offset.set(0, 0, 0);
      if (ray.ray.intersectPlane(plane, hit) !== null) offset.copy(place).sub(hit);
    };
    // Before the camera's controls hear of it, which else would turn the view.
    canvas.addEventListener("pointerdown", (event) => {
      aim(event);
      held = event.button === 0 ? found() : undefined;
      if (held === undefined) return;
      event.stopImmediatePropagation();
      this.controls.enabled = false;
      canvas.setPointerCapture(event.pointerId);
      hold(event.shiftKey);
      held.colour(this.palette, true);
      this.touch();
    }, { capture: true });
    canvas.addEventListener("pointermove", (event) => {
      aim(event);
      if (held === undefined) {
        canvas.style.cursor = found() === undefined ? "" : "grab";
        return;
      }
      canvas.style.cursor = "grabbing";
      if (event.shiftKey !== lifting) hold(event.shiftKey);
      if (ray.ray.intersectPlane(plane, hit) === null) return;
      hit.add(offset);
      const place = held.group.position;
      if (lifting) place.z = hit.z;
      else if (hit.length() < FARTHEST_M) place.set(hit.x, hit.y, place.z);
      this.touch();
      this.onMove(held.name, place);
    });
    const release = (): void => {
      held?.colour(this.palette, false);
      held = undefined;
      this.controls.enabled = true;
      this.touch();
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
  }

  private onKey(event: KeyboardEvent): void {
    const handle = [...this.handles.values()][0];
    const step = event.shiftKey ? 0.1 * STEP_M : STEP_M;
    const forward = this.camera.getWorldDirection(new THREE.Vector3()).setZ(0);
    // Along the base axis that points most nearly away from who looks.
    if (Math.abs(forward.x) >= Math.abs(forward.y)) forward.set(Math.sign(forward.x) || 1, 0, 0);
    else forward.set(0, Math.sign(forward.y), 0);
    const right = new THREE.Vector3(forward.y, -forward.x, 0);
    const moves: Record<string, THREE.Vector3> = {
      ArrowUp: forward, ArrowDown: forward.clone().negate(), ArrowRight: right, ArrowLeft: right.clone().negate(),
      PageUp: new THREE.Vector3(0, 0, 1), PageDown: new THREE.Vector3(0, 0, -1),
    };
    const move = moves[event.key];
    if (handle === undefined || move === undefined) return;
    event.preventDefault();
    handle.group.position.addScaledVector(move, step);
    this.touch();
    this.onMove(handle.name, handle.group.position);
  }
}
