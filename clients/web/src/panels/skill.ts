import type { Client } from "../client";
import { byId, make, say, sayMissing, setText, table } from "../dom";
import { explain, isAbort } from "../errors";
import { cm, mm, number, seconds, words } from "../format";
import { positionsOf, thin } from "../tube";
import type { NamedPose, Progress, ScalarSeries, Service, SkillInfo, SkillReport, Trial, TrialInfo } from "../types";

const TRIALS_DRAWN = 24;
const POINTS_A_TRIAL = 240;
const CHUNK_BYTES = 1 << 20;

/** What the other parts need of a chosen skill. */
export interface Chosen {
  name: string;
  version: number;
  report: SkillReport;
  /** Objects that the skill is about, where the trials had them on average. */
  objects: NamedPose[];
}

interface Hooks {
  onChoose: (chosen: Chosen | undefined) => void;
  onPaths: (paths: Float32Array[]) => void;
  toolPath: (joints: ScalarSeries, rows: readonly number[]) => Float32Array | undefined;
}

/** The list of skills, what learning found, trials and learning. */
export class SkillPanel {
  private readonly select = byId<HTMLSelectElement>("skill");
  private readonly problem = byId("skills-problem");
  private readonly line = byId("skill-line");
  private readonly report = byId("report");
  private readonly nameField = byId<HTMLInputElement>("learn-name");
  private readonly learnSaid = byId("learn-said");
  private readonly learnProgress = byId<HTMLProgressElement>("learn-progress");
  private readonly learnButton = byId<HTMLButtonElement>("learn");
  private readonly cancelButton = byId<HTMLButtonElement>("learn-cancel");
  private readonly files = byId<HTMLInputElement>("trial-files");
  private skills: SkillInfo[] = [];
  private trials: TrialInfo[] = [];
  private shown = "";
  private choosing = 0;
  private learning: AbortController | undefined;

  constructor(
    private readonly client: Client,
    private readonly hooks: Hooks,
  ) {
    this.select.addEventListener("change", () => void this.choose(this.select.value));
    this.nameField.addEventListener("input", () => this.tellTrials());
    byId<HTMLFormElement>("learn-form").addEventListener("submit", (event) => {
      event.preventDefault();
      void this.learn();
    });
    this.cancelButton.addEventListener("click", () => this.learning?.abort());
    this.files.addEventListener("change", () => void this.submit());
  }

  /** Asks again, where there is somebody to ask; quiet where nothing changed. */
  async refresh(service: Service = "serving"): Promise<void> {
    byId("learn-box").hidden = byId("skill-row").hidden = service === "absent";
    if (service === "absent") {
      sayMissing(this.line, "learning service", "--learning");
      await this.choose("");
      return;
    }
    try {
      const [skills, trials] = await Promise.all([
        this.client.call<{ skills?: SkillInfo[] }>("SkillService/List"),
        this.client.call<{ trials?: TrialInfo[] }>("TrialService/List"),
      ]);
      this.skills = skills.skills ?? [];
      this.trials = trials.trials ?? [];
      say(this.problem, "");
    } catch (error) {
      say(this.problem, `Skills: ${explain(error, this.client.who)}`, "bad");
      return;
    }
    this.fillSelect();
    this.tellTrials();
    const name = this.skills.some((skill) => skill.name === this.select.value) ? this.select.value : (this.skills[0]?.name ?? "");
    const version = this.skills.find((skill) => skill.name === name)?.version ?? 0;
    if (`${name} ${version}` !== this.shown) await this.choose(name);
  }

  private fillSelect(): void {
    const names = this.skills.map((skill) => skill.name);
    const shown = [...this.select.options].map((option) => option.value);
    if (names.join("\n") !== shown.join("\n") || names.length === 0) {
      const before = this.select.value;
      this.select.replaceChildren(...names.map((name) => new Option(name, name)));
      if (names.includes(before)) this.select.value = before;
    }
    this.select.disabled = names.length === 0;
    if (names.length === 0) {
      setText(this.line, "No skill was learned yet. Record or add trials, then learn one below.");
      byId<HTMLDetailsElement>("learn-box").open = true;
    }
  }

  private tellTrials(): void {
    const known = new Map<string, number>();
    for (const trial of this.trials) known.set(trial.skill, (known.get(trial.skill) ?? 0) + 1);
    if (this.nameField.value === "" && document.activeElement !== this.nameField) this.nameField.value = [...known.keys()][0] ?? "";
    const count = known.get(this.nameField.value) ?? 0;
    const others = [...known].map(([name, trials]) => `${name}: ${trials}`).join(", ");
    setText(byId("learn-trials"), `${count} trials of this skill are stored${others === "" ? "" : ` (all: ${others})`}.`);
  }

  private async choose(name: string): Promise<void> {
    const turn = ++this.choosing;
    if (name === "") {
      this.shown = "";
      this.report.replaceChildren();
      this.hooks.onChoose(undefined);
      this.hooks.onPaths([]);
      return;
    }
    this.select.value = name;
    this.nameField.value = name;
    this.tellTrials();
    try {
      const { report } = await this.client.call<{ report: SkillReport }>("SkillService/Get", { skill: { name } });
      if (turn !== this.choosing) return;
      this.shown = `${name} ${report.version}`;
      this.draw(report);
      this.hooks.onChoose({ name, version: report.version, report, objects: objectsOf(report) });
      await this.drawTrials(report, turn);
    } catch (error) {
      if (turn === this.choosing) say(this.problem, `Skill ${name}: ${explain(error, this.client.who)}`, "bad");
    }
  }

  private draw(report: SkillReport): void {
    setText(this.line, `version ${report.version}, ${report.trials.length} trials, ${seconds(report.duration_s)}; target: ${report.target || "none"}`);
    const parts: Node[] = [];
    if (report.methods.length > 0) {
      parts.push(make("p", "muted", "Left-out trials, predicted from the others:"));
      parts.push(table(["method", "Fréchet", "end"], report.methods.map((score) => ({
        cells: [score.chosen ? `${score.method} ✓` : score.method, cm(score.frechet_m), cm(score.end_error_m)], mark: score.chosen ? "chosen" : "",
      }))));
    }
    const contacts = report.contacts.map((contact) =>
      `${contact.object} from ${number(contact.begin_s, 2)} to ${seconds(contact.end_s)}, ${mm(contact.spread_m)} apart${contact.touch_measured ? "" : " (from the motion)"}`);
    parts.push(facts([
      ["Method", report.method],
      ["Episodes meet at", report.markers_s.map((time) => number(time, 2)).join(", ") + " s"],
      ["Contact", contacts.join("; ") || "none found"],
      ["Trials agree", `${number(report.mean_correlation, 3)} (unaligned ${number(report.plain_correlation, 3)})`],
    ]));
    if (report.warnings.length > 0) parts.push(list(report.warnings, "warnings"));
    const notes = [...report.notes, ...report.trials.flatMap((trial) => trial.notes.map((note) => `${trial.source}: ${note}`))];
    if (notes.length > 0) parts.push(make("details", "", make("summary", "", `${notes.length} notes`), list(notes)));
    this.report.replaceChildren(...parts);
  }

  private async drawTrials(report: SkillReport, turn: number): Promise<void> {
    const paths: Float32Array[] = [];
    for (const part of report.trials.slice(0, TRIALS_DRAWN)) {
      try {
        const { trial } = await this.client.call<{ trial: Trial }>("TrialService/Load", { id: part.id });
        if (turn !== this.choosing) return;
        const path = this.pathOf(trial);
        if (path !== undefined) paths.push(path);
      } catch (error) {
        if (turn === this.choosing) say(this.problem, `Trial ${part.source}: ${explain(error, this.client.who)}`, "warn");
      }
    }
    this.hooks.onPaths(paths);
  }

  private pathOf(trial: Trial): Float32Array | undefined {
    const hand = trial.end_effectors[0];
    if (hand !== undefined && hand.time_s.length > 1) {
      const all = positionsOf(hand.poses.map(Number), 7);
      const out: number[] = [];
      for (const row of thin(all.length / 3, POINTS_A_TRIAL)) {
        const x = all[3 * row] ?? Number.NaN;
        if (Number.isFinite(x)) out.push(x, all[3 * row + 1] ?? 0, all[3 * row + 2] ?? 0);
      }
      return Float32Array.from(out);
    }
    if (trial.joints === undefined || trial.joints.time_s.length < 2) return undefined;
    return this.hooks.toolPath(trial.joints, thin(trial.joints.time_s.length, POINTS_A_TRIAL));
  }

  private async learn(): Promise<void> {
    const name = this.nameField.value.trim();
    this.learning = new AbortController();
    this.busy(true);
    say(this.learnSaid, "Learning…");
    try {
      let report: SkillReport | undefined;
      await this.client.stream<{ progress?: Progress; report?: SkillReport }>("SkillService/Learn", { name }, (message) => {
        if (message.progress !== undefined) {
          this.learnProgress.value = message.progress.fraction;
          say(this.learnSaid, message.progress.step);
        }
        report = message.report ?? report;
      }, this.learning.signal);
      say(this.learnSaid, report === undefined ? "Learning ended without a report." : `Version ${report.version} learned from ${report.trials.length} trials.`, report === undefined ? "bad" : "good");
      await this.refresh();
      await this.choose(name);
    } catch (error) {
      say(this.learnSaid, isAbort(error) ? "Cancelled; nothing was changed." : explain(error, this.client.who), isAbort(error) ? "" : "bad");
    } finally {
      this.learning = undefined;
      this.busy(false);
    }
  }

  private async submit(): Promise<void> {
    const skill = this.nameField.value.trim();
    if (skill === "") {
      say(this.learnSaid, "First say which skill the trials show.", "warn");
      this.nameField.focus();
      return;
    }
    this.busy(true);
    let stored = 0;
    const problems: string[] = [];
    for (const file of this.files.files ?? []) {
      say(this.learnSaid, `Sending ${file.name}…`);
      try {
        const { duplicate } = await this.client.call<{ duplicate: boolean }>("TrialService/Submit", await submission(skill, file));
        if (duplicate) problems.push(`${file.name} was there already`);
        else stored += 1;
      } catch (error) {
        problems.push(`${file.name}: ${explain(error, this.client.who)}`);
      }
    }
    this.files.value = "";
    this.busy(false);
    say(this.learnSaid, [`${stored} trials stored.`, ...problems].join(" "), problems.length > 0 ? "warn" : "good");
    await this.refresh();
  }

  private busy(working: boolean): void {
    this.learnButton.disabled = working;
    this.files.disabled = working;
    this.cancelButton.hidden = this.learning === undefined;
    this.learnProgress.hidden = this.learning === undefined;
    if (!working) this.learnProgress.value = 0;
  }
}

async function submission(skill: string, file: File): Promise<string> {
  const lines = [JSON.stringify({ header: { skill, name: file.name } })];
  const bytes = new Uint8Array(await file.arrayBuffer());
  for (let at = 0; at < bytes.length; at += CHUNK_BYTES) lines.push(JSON.stringify({ chunk: { data: base64(bytes.subarray(at, at + CHUNK_BYTES)) } }));
  return lines.join("\n");
}

export function base64(bytes: Uint8Array): string {
  let text = "";
  for (let at = 0; at < bytes.length; at += 0x8000) text += String.fromCharCode(...bytes.subarray(at, at + 0x8000));
  return btoa(text);
}

/** The target and what else the motion meets, each where the trials had it on average. */
export function objectsOf(report: SkillReport): NamedPose[] {
  const places = report.trials.map((trial) => trial.target_pose?.position).filter((place) => place !== undefined);
  const mean = (axis: "x" | "y" | "z"): number => places.reduce((sum, place) => sum + place[axis], 0) / Math.max(1, places.length);
  const position = { x: mean("x"), y: mean("y"), z: mean("z") };
  const names = new Set([report.target, ...report.contacts.map((contact) => contact.object)].filter((name) => name !== ""));
  return [...names].map((name) => ({ name, pose: { position: { ...position } } }));
}

function facts(rows: readonly (readonly [string, string])[]): HTMLElement {
  return make("dl", "facts", ...rows.map(([name, value]) => make("div", "", make("dt", "", name), make("dd", "", value))));
}

function list(items: readonly string[], className = ""): HTMLElement {
  return make("ul", className, ...items.map((item) => make("li", "", words(item))));
}
