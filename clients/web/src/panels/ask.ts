import * as THREE from "three";
import type { Client } from "../client";
import { byId, make, say, setText } from "../dom";
import { explain } from "../errors";
import { mm, number, seconds } from "../format";
import { LatestOnly } from "../latest";
import type { TimePlot } from "../plots";
import { rowMaxima } from "../tube";
import type { NamedPose, Pose, Quaternion, SkillMotion } from "../types";
import type { View } from "../view/view";
import type { Chosen } from "./skill";

interface Place {
  position: THREE.Vector3;
  rotation: Quaternion | undefined;
  inputs: HTMLInputElement[];
  /** A person put it there. */
  touched: boolean;
}
interface Question { chosen: Chosen; objects: NamedPose[]; start: Pose | undefined; asked_ms: number }
interface Sight { position: readonly number[]; quaternion: readonly number[] | undefined; at_ms: number }

const FRESH_MS = 3000;
const FOLLOWED_MS = 500;
const AXES = ["x", "y", "z"] as const;

/** Where the objects stand, by hand or as seen, and the skill's answer to it, live. */
export class AskPanel {
  /** Told of every new question: what was planned for another one holds no more. */
  onQuestion: () => void = () => undefined;
  private readonly sights = new Map<string, Sight>();
  /** Where the tool is now, if that is known. */
  tool: Pose | undefined;
  private readonly box = byId("objects");
  private readonly said = byId("ask-said");
  private readonly fromHere = byId<HTMLInputElement>("from-here");
  private readonly asSeen = byId<HTMLButtonElement>("as-seen");
  private readonly follow = byId<HTMLInputElement>("follow");
  private readonly places = new Map<string, Place>();
  private readonly latest: LatestOnly<Question>;
  private chosen: Chosen | undefined;
  private answers = 0;
  private followed_ms = 0;

  constructor(
    private readonly client: Client,
    private readonly view: View | undefined,
    private readonly plot: TimePlot,
  ) {
    this.latest = new LatestOnly((question) => this.query(question));
    if (view !== undefined) view.onMove = (name, position) => this.moved(name, position);
    this.fromHere.addEventListener("change", () => this.ask());
    this.asSeen.addEventListener("click", () => this.takeSeen());
    this.follow.addEventListener("change", () => {
      this.showPlaces();
      this.takeSeen();
      this.tellSights(performance.now());
    });
    this.tellSights(performance.now());
  }

  /** The skill that is asked; its objects go where they are seen, else where the trials had them. */
  choose(chosen: Chosen | undefined): void {
    const before = this.chosen;
    this.chosen = chosen;
    if (chosen === undefined) {
      this.places.clear();
      this.box.replaceChildren(make("p", "muted", "Choose or learn a skill first."));
      this.view?.setHandles(new Map());
      this.view?.setAnswer(undefined);
      this.follow.checked = false;
      this.tellSights(performance.now());
      return;
    }
    const names = chosen.objects.map((object) => object.name);
    if (before?.name !== chosen.name) this.follow.checked = false;
    if (before?.name !== chosen.name || [...this.places.keys()].join() !== names.join()) {
      this.places.clear();
      this.box.replaceChildren();
      for (const object of chosen.objects) this.addPlace(object);
    }
    this.showPlaces();
    this.ask();
  }

  get skill(): string {
    return this.chosen?.name ?? "";
  }

  /** What to plan or execute; nothing without a skill. */
  execution(): { skill: { name: string }; objects?: NamedPose[]; follow?: boolean } | undefined {
    if (this.chosen === undefined) return undefined;
    const skill = { name: this.chosen.name };
    return this.follow.checked ? { skill, follow: true } : { skill, objects: this.objects() };
  }

  ask(): void {
    this.onQuestion();
    this.send();
  }

  private send(): void {
    if (this.chosen === undefined) return;
    const start = this.fromHere.checked ? this.tool : undefined;
    this.latest.ask({ chosen: this.chosen, objects: this.objects(), start, asked_ms: performance.now() });
  }

  /** An object was seen; one that is followed, or that nobody has moved here yet, goes there. */
  see(name: string, position: readonly number[], quaternion: readonly number[] | undefined): void {
    const now_ms = performance.now();
    this.sights.set(name, { position, quaternion, at_ms: now_ms });
    const place = this.places.get(name);
    if (place?.touched === false) this.takeSeen();
    if (place === undefined || !this.follow.checked || now_ms - this.followed_ms < FOLLOWED_MS) return;
    this.followed_ms = now_ms;
    this.goToSights();
    this.showInputs();
    this.send();
  }

  /** Whether there are objects to take from where they are seen, or to follow. */
  tellSights(now_ms: number): void {
    const isSeen = (name: string): boolean => now_ms - (this.sights.get(name)?.at_ms ?? -1e9) < FRESH_MS;
    const names = [...this.places.keys()];
    const following = this.follow.checked;
    this.box.classList.toggle("followed", following);
    this.asSeen.disabled = following || !names.some(isSeen);
    this.follow.disabled = names.length === 0;
    const unseen = names.filter((name) => !isSeen(name));
    const text = unseen.length > 0 ? `Not seen now: ${unseen.join(", ")}. Execute needs to see what it follows.` : "Execute meets it where it will be at the touch.";
    say(byId("follow-said"), following ? text : "", unseen.length > 0 ? "warn" : "");
  }

  private addPlace(object: NamedPose): void {
    const sight = this.sights.get(object.name);
    const fresh = sight !== undefined && performance.now() - sight.at_ms < FRESH_MS;
    const p = object.pose?.position ?? { x: 0.5, y: 0, z: 0 };
    const position = fresh ? new THREE.Vector3(...sight.position) : new THREE.Vector3(p.x, p.y, p.z);
    const inputs = AXES.map((axis) => {
      const input = make("input");
      input.type = "number";
      input.step = "0.005";
      input.setAttribute("aria-label", `${object.name} ${axis}, metres`);
      input.addEventListener("input", () => {
        const value = input.valueAsNumber;
        if (!Number.isFinite(value)) return;
        const place = this.places.get(object.name);
        if (place === undefined) return;
        place.position[axis] = value;
        place.touched = true;
        this.showHandles();
        this.ask();
      });
      return input;
    });
    const labels = inputs.map((input, i) => make("label", "", AXES[i] ?? "", input));
    this.box.append(make("div", "object", make("h3", "", object.name, make("span", "muted", " in m", make("span", "by-hand", "; drag it, Shift lifts"))), ...labels));
    this.places.set(object.name, { position, rotation: fresh ? rotationOf(sight) : undefined, inputs, touched: fresh });
  }

  private moved(name: string, position: THREE.Vector3): void {
    const place = this.places.get(name);
    if (place === undefined) return;
    place.position.copy(position);
    place.touched = true;
    this.showInputs();
    this.ask();
  }

  private takeSeen(): void {
    this.goToSights();
    this.showPlaces();
    this.ask();
  }

  private goToSights(): void {
    for (const [name, place] of this.places) {
      const sight = this.sights.get(name);
      if (sight === undefined) continue;
      place.position.set(sight.position[0] ?? 0, sight.position[1] ?? 0, sight.position[2] ?? 0);
      place.rotation = rotationOf(sight);
      place.touched = true;
    }
  }

  private showPlaces(): void {
    this.showInputs();
    this.showHandles();
  }

  /** What is followed is nobody's to drag. */
  private showHandles(): void {
    this.view?.setHandles(this.follow.checked ? new Map() : new Map([...this.places].map(([name, place]) => [name, place.position])));
  }

  private showInputs(): void {
    for (const place of this.places.values()) {
      place.inputs.forEach((input, i) => {
        input.readOnly = this.follow.checked;
        if (input === document.activeElement && input.valueAsNumber === place.position.getComponent(i)) return;
        input.value = place.position.getComponent(i).toFixed(3);
      });
    }
  }

  private objects(): NamedPose[] {
    return [...this.places].map(([name, place]) => {
      const pose: Pose = { position: { x: place.position.x, y: place.position.y, z: place.position.z } };
      if (place.rotation !== undefined) pose.rotation = place.rotation;
      return { name, pose };
    });
  }

  private async query({ chosen, objects, start, asked_ms }: Question): Promise<void> {
    try {
      const query = start === undefined ? { objects } : { objects, start };
      const { motion } = await this.client.call<{ motion: SkillMotion }>("SkillService/Query", { skill: { name: chosen.name, version: chosen.version }, query });
      this.show(motion, asked_ms);
    } catch (error) {
      say(this.said, `No answer: ${explain(error, this.client.who)}`, "bad");
    }
  }

  private show(motion: SkillMotion, asked_ms: number): void {
    this.answers += 1;
    const rows = motion.time_s.length;
    const sigma = motion.sigma_m.map(Number);
    const most = Math.max(0, ...sigma);
    this.view?.setAnswer(motion);
    const objectivity = motion.objectivity.length > 0 ? rowMaxima(motion.objectivity, rows, motion.object_names.length) : new Float32Array(rows);
    this.plot.set([motion.time_s, sigma.map((value) => value * 1e3), Array.from(objectivity)], motion.markers_s);
    setText(byId("answer-caption"), `Answer: ${seconds(motion.time_s[rows - 1])}, predicted error up to ${mm(most)}`);
    say(this.said, motion.warnings.join(" "), motion.warnings.length > 0 ? "warn" : "");
    const box = byId("view");
    box.dataset["answers"] = String(this.answers);
    const contact = motion.contacts[0];
    const row = contact === undefined ? rows - 1 : Math.round((contact.first + contact.last) / 2);
    box.dataset["answerContact"] = [0, 1, 2].map((k) => number(motion.tool[7 * row + k], 4)).join(",");
    this.view?.afterNextPicture(() => {
      box.dataset["latencyMs"] = (performance.now() - asked_ms).toFixed(1);
    });
  }
}

function rotationOf(sight: Sight): Quaternion | undefined {
  const q = sight.quaternion;
  return q === undefined ? undefined : { x: q[0] ?? 0, y: q[1] ?? 0, z: q[2] ?? 0, w: q[3] ?? 1 };
}
