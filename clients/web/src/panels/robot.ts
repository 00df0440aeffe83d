import type { Client } from "../client";
import { byId, make, say, sayMissing, setText } from "../dom";
import { CallError, explain, isAbort } from "../errors";
import { mm, number, seconds, words } from "../format";
import { LatestOnly } from "../latest";
import type { TimePlot } from "../plots";
import { positionsOf } from "../tube";
import type { ExecutionFeedback, ExecutionResult, PlanSummary, RobotStatus } from "../types";
import type { View } from "../view/view";
import type { AskPanel } from "./ask";
import type { TeleopPanel } from "./teleop";

const MOVING = ["planning", "ready", "executing", "paused", "teleoperating"];
const STOPPED = ["protective_stop", "emergency_stop"];

/** Plan, execute, hold, stop: what the executor does, and what it says. */
export class RobotPanel {
  /** "executing", ...; empty: not known. */
  state = "";
  private why = "";
  private holder = "";
  private absent = false;
  private readonly stateBox = byId("robot-state");
  private readonly detail = byId("robot-detail");
  private readonly verdict = byId("verdict");
  private readonly progress = byId<HTMLProgressElement>("motion-progress");
  private readonly speed = byId<HTMLInputElement>("speed");
  private readonly stopButton = byId<HTMLButtonElement>("stop");
  private readonly speeds: LatestOnly<number>;
  private ours: AbortController | undefined;
  private planning = false;
  private speedTouched_ms = -1e9;

  constructor(
    private readonly client: Client,
    private readonly view: View | undefined,
    private readonly ask: AskPanel,
    private readonly plot: TimePlot,
    private readonly teleop: TeleopPanel,
  ) {
    this.speeds = new LatestOnly((factor) => this.order("SetSpeed", { factor }));
    byId("plan").addEventListener("click", () => void this.plan());
    byId("execute").addEventListener("click", () => void this.execute());
    byId("pause").addEventListener("click", () => void this.order("Pause"));
    byId("resume").addEventListener("click", () => void this.order("Resume"));
    byId("cancel").addEventListener("click", () => void this.order("Cancel"));
    byId("reset").addEventListener("click", () => void this.order("Reset"));
    this.stopButton.addEventListener("click", () => void this.stop());
    this.speed.addEventListener("input", () => {
      this.speedTouched_ms = performance.now();
      this.showSpeed(this.speed.valueAsNumber);
      this.speeds.ask(this.speed.valueAsNumber);
    });
    document.addEventListener("keydown", (event) => this.onKey(event), { capture: true });
    ask.onQuestion = () => {
      if (!this.isMoving()) say(this.verdict, "");
    };
    teleop.onHeld = () => this.showState();
    this.showState();
  }

  isMoving(): boolean {
    return this.state === "executing" || this.state === "paused" || this.state === "teleoperating";
  }

  /** As the executor told by itself; undefined: it does not answer. */
  setState(state: string | undefined, detail: string, holder: string): void {
    const before = this.state;
    this.state = state ?? "";
    this.why = detail;
    this.holder = holder;
    const begins = (state === "executing" && before !== "paused") || state === "teleoperating";
    if (begins && state !== before) this.view?.beginTrail();
    const stopped = STOPPED.includes(this.state) || this.state === "aborted";
    const why = state === undefined ? detail : detail === "" ? "" : words(detail);
    const hint = STOPPED.includes(this.state) ? "; reset when it is safe." : "";
    if (this.absent) return this.showState();
    if (stopped || state === undefined) say(this.detail, `${why || words(this.state)}${hint}`, "bad");
    else say(this.detail, this.isMoving() ? this.heldBy(why) : "", why.startsWith("following") ? "good" : why.startsWith("blocked") ? "warn" : "");
    this.showState();
  }

  setStatus(status: RobotStatus): void {
    if (performance.now() - this.speedTouched_ms > 1500 && document.activeElement !== this.speed && status.speed > 0) {
      this.speed.value = String(status.speed);
      this.showSpeed(status.speed);
    }
    if (status.state !== this.state || status.detail !== this.why) this.setState(status.state, status.detail, this.holder);
    if (!status.joint_names?.length) say(this.detail, "The executor has not heard the robot yet.", "warn");
  }

  /** Stops the robot, and says loudly where that failed. */
  async stop(): Promise<void> {
    this.stopButton.dataset["kind"] = "";
    try {
      await this.client.call("ExecutorService/Stop");
      say(this.verdict, "");
    } catch (error) {
      this.stopButton.dataset["kind"] = "bad";
      say(this.verdict, `STOP did not reach the executor: ${explain(error, this.client.who)} Use the robot's own emergency stop.`, "bad");
    }
  }

  /** Whether there is an executor to ask; what the station's tells by itself is shown without as well. */
  setOffered(offered: boolean): void {
    if (this.absent === !offered) return;
    this.absent = !offered;
    if (this.absent) sayMissing(this.detail, "executor", "--executor", ": from here the robot is looked at, not moved.");
    this.showState();
  }

  private heldBy(doing: string): string {
    if (this.state === "teleoperating") return `${doing || "It is teleoperated"}. ${this.teleop.isOurs ? "Closing this page ends it and holds the robot." : "Someone else turned it on."}`;
    if (this.ours !== undefined) return "This page moves the robot; closing it slows the robot down and holds it.";
    return this.holder === "" ? "Someone else moves the robot." : `The robot belongs to ${this.holder}.`;
  }

  private onKey(event: KeyboardEvent): void {
    const target = event.target instanceof HTMLElement ? event.target : undefined;
    const types = target instanceof HTMLInputElement && !["checkbox", "range", "file"].includes(target.type);
    const inControl = target?.closest("button, input, select, summary, a, [contenteditable]") !== null && target !== undefined;
    const stops = event.key === "Escape" || (event.key === " " && !types && (this.isMoving() || !inControl));
    if (!stops || event.repeat) return;
    event.preventDefault();
    event.stopPropagation();
    void this.stop();
  }

  private async plan(): Promise<void> {
    const execution = this.ask.execution();
    if (execution === undefined || this.planning) return;
    this.planning = true;
    this.showState();
    say(this.verdict, "Planning…");
    try {
      const { plan } = await this.client.call<{ plan: PlanSummary }>("ExecutorService/Plan", { execution });
      say(this.verdict, judge(plan), plan.warnings.length > 0 ? "warn" : "good");
      this.figures(planFigures(plan));
    } catch (error) {
      say(this.verdict, `${error instanceof CallError && error.code === "failed_precondition" ? "Refused: " : "No plan: "}${explain(error, this.client.who)}`, "bad");
    } finally {
      this.planning = false;
      this.showState();
    }
  }

  private async execute(): Promise<void> {
    const execution = this.ask.execution();
    if (execution === undefined || this.ours !== undefined) return;
    this.ours = new AbortController();
    say(this.verdict, "Planning…");
    this.showState();
    try {
      let result: ExecutionResult | undefined;
      await this.client.stream<{ feedback?: ExecutionFeedback; result?: ExecutionResult }>(
        "ExecutorService/Execute", { execution }, (message) => {
          if (message.feedback !== undefined) this.feedback(message.feedback);
          result = message.result ?? result;
        }, this.ours.signal);
      if (result !== undefined) this.ended(result);
    } catch (error) {
      if (!isAbort(error)) say(this.verdict, `${error instanceof CallError && error.code === "failed_precondition" ? "Refused: " : "Not carried out: "}${explain(error, this.client.who)}`, "bad");
    } finally {
      this.ours = undefined;
      this.progress.value = 0;
      this.plot.setCursor(undefined);
      this.showState();
    }
  }

  private feedback(feedback: ExecutionFeedback): void {
    if (feedback.duration_s > 0) {
      this.progress.value = feedback.time_s / feedback.duration_s;
      say(this.verdict, `${words(feedback.state)}: ${seconds(feedback.time_s)} of ${seconds(feedback.duration_s)}, off the path by ${number(feedback.tracking_error_rad, 3, "rad")}, touch ${number(feedback.touch_n, 1, "N")}`);
    }
    this.plot.setCursor(feedback.time_s);
  }

  private ended(result: ExecutionResult): void {
    if (result.tool !== undefined && result.tool.time_s.length > 1) this.view?.setMeasured(positionsOf(result.tool.poses.map(Number), 7));
    const touched = result.contact_error_m === undefined ? "" : `, contact ${mm(result.contact_error_m)} off`;
    if (STOPPED.includes(result.state)) return say(this.verdict, ""); // told beside the state
    const said = result.state === "done" ? `Done${touched}; touch up to ${number(result.touch_max_n, 1, "N")}.` : `${words(result.state)}: ${result.detail}`;
    say(this.verdict, said, result.state === "done" ? "good" : "bad");
    this.figures([["clearance", mm(result.clearance_m)], ["tracking", number(result.tracking_error_rad, 3, "rad")], ["contact", mm(result.contact_error_m)], ["touch", number(result.touch_max_n, 1, "N")]]);
  }

  private async order(what: "Pause" | "Resume" | "Cancel" | "Reset" | "SetSpeed", request: object = {}): Promise<void> {
    try {
      await this.client.call(`ExecutorService/${what}`, request);
      if (what === "Reset") say(this.verdict, "");
    } catch (error) {
      say(this.verdict, `${what === "SetSpeed" ? "Speed" : what}: ${explain(error, this.client.who)}`, "bad");
    }
  }

  private figures(rows: readonly (readonly [string, string])[]): void {
    byId("robot-figures").replaceChildren(...rows.map(([name, value]) => make("div", "", make("dt", "", name), make("dd", "", value))));
  }

  private showSpeed(factor: number): void {
    setText(byId("speed-value"), `${Math.round(100 * factor)} %`);
  }

  private showState(): void {
    setText(this.stateBox, this.state !== "" ? words(this.state) : this.absent ? "none" : "not reached");
    this.stateBox.dataset["kind"] = this.absent && this.state === "" ? "" : this.state === "" || STOPPED.includes(this.state) || this.state === "aborted" ? "bad" : MOVING.includes(this.state) && this.state !== "ready" ? "busy" : "good";
    const moving = this.isMoving();
    const free = !this.absent && this.ours === undefined && !this.teleop.isOurs && !this.planning && !moving && this.state !== "planning";
    this.teleop.setRobot(this.state === "teleoperating", free && this.state !== "" && !STOPPED.includes(this.state));
    this.speed.disabled = this.absent || this.state === "";
    byId<HTMLButtonElement>("plan").disabled = !free || this.state === "";
    byId<HTMLButtonElement>("execute").disabled = !free || this.state === "" || STOPPED.includes(this.state);
    byId("teleop-box").hidden = this.absent;
    byId("pause").hidden = this.absent || this.state !== "executing";
    byId("resume").hidden = this.absent || this.state !== "paused";
    byId("cancel").hidden = this.absent || this.state === "teleoperating" || (!moving && this.state !== "planning");
    byId("reset").hidden = this.absent || (!STOPPED.includes(this.state) && this.state !== "aborted");
  }
}

/** The planner's verdict as a sentence. */
export function judge(plan: PlanSummary): string {
  const between = plan.clearance_between === "" ? "" : ` (${plan.clearance_between})`;
  const free = Number.isFinite(Number(plan.clearance_m)) ? `Free of collisions: ${mm(Number(plan.clearance_m))} at the nearest${between}` : "Free of collisions";
  return [`${free}; takes ${seconds(plan.duration_s)}.`, ...plan.warnings].join(" ");
}

function planFigures(plan: PlanSummary): [string, string][] {
  return [["duration", seconds(plan.duration_s)], ["off", mm(plan.max_position_error_m)], ["in contact", mm(plan.max_contact_error_m)], ["slowed", `${number(plan.time_stretch, 2)} ×`]];
}
