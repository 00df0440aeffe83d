import "./style.css";
import { Client } from "./client";
import { byId, make, say, setText } from "./dom";
import { CallError, explain } from "./errors";
import { toNumber } from "./format";
import { Live } from "./live";
import { AskPanel } from "./panels/ask";
import { RecordPanel } from "./panels/record";
import { RobotPanel } from "./panels/robot";
import { SkillPanel } from "./panels/skill";
import { TeleopPanel } from "./panels/teleop";
import { Recent, TimePlot } from "./plots";
import type { Health, JointState, ObjectPose, PlanSample, RobotDescription, RobotStatus, SceneDescription, Service, StatusSample, TopicSample } from "./types";
import { View, type Layer } from "./view/view";

const TOPICS = ["ircp/joint_state", "ircp/objects", "ircp/plan", "ircp/executor/status"];
const RATE_HZ = 30;
const LAYERS: Layer[] = ["trials", "answer", "plan", "measured"];

class Page {
  private readonly client = new Client();
  private readonly view = this.makeView();
  private readonly answerPlot = new TimePlot(byId("answer-plot"), [{ label: "error, mm", colour: "--blue-text", scale: "mm", least: 1 }, { label: "objectivity", colour: "--violet", scale: "w", least: 1 }], { w: [0, 1.02] });
  private readonly robotPlot = new TimePlot(byId("robot-plot"), [{ label: "touch, N", colour: "--orange", scale: "n", least: 1 }, { label: "tool, m/s", colour: "--teal", scale: "v", least: 0.1 }]);
  private readonly recent = new Recent(2, 20);
  private readonly ask = new AskPanel(this.client, this.view, this.answerPlot);
  private readonly teleop = new TeleopPanel(this.client);
  private readonly robot = new RobotPanel(this.client, this.view, this.ask, this.answerPlot, this.teleop);
  private readonly record = new RecordPanel(this.client);
  private readonly skills = new SkillPanel(this.client, {
    onChoose: (chosen) => this.ask.choose(chosen),
    onPaths: (paths) => this.view?.setTrials(paths),
    toolPath: (joints, rows) => this.view?.toolPath(joints, rows),
  });
  private readonly live = new Live(this.client, TOPICS, RATE_HZ);
  /** As the gateway told; nothing while it does not answer. */
  private serving: ReadonlyMap<string, boolean> | undefined;
  private gatewayAnswers = true;
  private robotDrawn = false;
  private lastTool: { x: number; y: number; z: number; at_s: number } | undefined;

  async start(): Promise<void> {
    this.listen();
    this.setTheme(localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
    this.client.onLoggedOut = () => this.tellLoggedOut();
    this.live.onSample = (sample) => this.onSample(sample);
    this.live.onState = (problem) => this.tellView("live", this.gatewayAnswers ? problem : "");
    if (!(await this.enter())) return;
    this.record.onTopics = (topics) => this.teleop.setTopics(topics);
    await this.checkHealth();
    await this.loadRobot();
    void this.live.run();
    await this.skills.refresh(this.service("learning"));
    void this.every(1000, () => this.askRobot());
    void this.every(1000, () => this.record.refresh(this.service("recorder")));
    void this.every(1000, () => this.record.refreshTopics());
    void this.every(2000, () => this.checkHealth());
    void this.every(5000, () => this.skills.refresh(this.service("learning")));
    setInterval(() => this.drawFigures(), 500);
  }

  /** Who we are; waits for a gateway that is not there yet. */
  private async enter(): Promise<boolean> {
    for (;;) {
      try {
        if (!(await this.client.greet())) {
          location.assign("/login");
          return false;
        }
        setText(byId("who"), this.client.who);
        byId("log-out").hidden = !this.client.secured;
        say(byId("banner"), "");
        return true;
      } catch (error) {
        say(byId("banner"), `${explain(error)} Trying again…`, "bad");
        await new Promise((resolve) => setTimeout(resolve, 1500));
      }
    }
  }

  private makeView(): View | undefined {
    try {
      return new View(byId("view"));
    } catch {
      say(byId("view-said"), "This browser draws no WebGL: the picture is missing, everything else works.", "warn");
      return undefined;
    }
  }

  private async loadRobot(): Promise<void> {
    try {
      const description = await this.client.get<RobotDescription>("/robot/description.json");
      const missing = (await this.view?.setRobot(description)) ?? [];
      this.robotDrawn = true;
      this.tellView("robot", missing.length > 0 ? `Not drawn, for their files are missing: ${missing.join(", ")}` : "");
    } catch (error) {
      this.tellView("robot", error instanceof CallError && error.code === "not_found" ? "The gateway was not told which robot this is (--robot)." : `The robot cannot be drawn: ${explain(error)}`);
    }
    try {
      const scene = await this.client.get<SceneDescription>("/robot/scene.json");
      this.view?.setScene(scene.bodies);
      this.teleop.setObjects(scene.bodies.filter((body) => body.kind !== "obstacle").map((body) => body.name));
    } catch (error) {
      if (!(error instanceof CallError && error.code === "not_found")) this.tellView("scene", `The place of work cannot be drawn: ${explain(error)}`);
    }
  }

  // ---- what comes by itself ----

  private onSample(sample: TopicSample): void {
    if (sample.json === "") return;
    const content: unknown = JSON.parse(sample.json);
    switch (sample.topic) {
      case "ircp/joint_state":
        this.onJoints(content as JointState);
        break;
      case "ircp/objects": {
        const object = content as ObjectPose;
        const quaternion = object.has_orientation ? object.base_T_object.quaternion_xyzw : undefined;
        this.view?.see(object.name, object.base_T_object.position_m, quaternion);
        this.ask.see(object.name, object.base_T_object.position_m, quaternion);
        break;
      }
      case "ircp/plan":
        this.view?.setPlan((content as PlanSample).tool_m);
        break;
      default: {
        const status = content as StatusSample;
        if (status.program.includes("executor")) this.robot.setState(status.state, status.detail, status.values.find((entry) => entry.name === "holder")?.value ?? "");
      }
    }
  }

  private onJoints(state: JointState): void {
    const tool = this.view?.setJoints(state.names, state.positions);
    const at_s = toNumber(state.stamp_ns) / 1e9; // the source's own: on the way, samples may bunch
    const touch = state.touch_n.reduce((sum, force) => sum + Number(force), 0);
    let speed = 0;
    if (tool !== undefined) {
      if (this.robot.isMoving()) this.view?.addToTrail(tool);
      if (this.lastTool !== undefined && at_s - this.lastTool.at_s > 0.005) {
        speed = Math.hypot(tool.x - this.lastTool.x, tool.y - this.lastTool.y, tool.z - this.lastTool.z) / (at_s - this.lastTool.at_s);
      }
      this.lastTool = { x: tool.x, y: tool.y, z: tool.z, at_s };
      byId("view").dataset["tool"] = [tool.x, tool.y, tool.z].map((value) => value.toFixed(4)).join(",");
    }
    this.recent.add(at_s, [touch, speed]);
  }

  private drawFigures(): void {
    this.robotPlot.set(this.recent.data());
    this.ask.tellSights(performance.now());
    const box = byId("view");
    box.dataset["samples"] = String(this.live.samples);
    box.dataset["picturesPerSecond"] = String(this.view?.picturesPerSecond() ?? 0);
  }

  // ---- what is asked ----

  private async askRobot(): Promise<void> {
    const service = this.service("executor");
    this.robot.setOffered(service !== "absent");
    if (service === "absent") return;
    if (service === "silent") {
      this.robot.setState(undefined, "The executor does not answer; the robot holds or is stopped by itself.", "");
      return;
    }
    try {
      const status = await this.client.call<RobotStatus>("ExecutorService/GetStatus", {}, AbortSignal.timeout(4000));
      const had = this.ask.tool !== undefined;
      if (!this.robot.isMoving()) this.ask.tool = status.tool;
      if (!had && status.tool !== undefined) this.ask.ask();
      this.robot.setStatus(status);
    } catch (error) {
      this.robot.setState(undefined, `Executor: ${explain(error, this.client.who)}`, "");
    }
  }

  private async checkHealth(): Promise<void> {
    try {
      const health = await this.client.get<Health>("/healthz");
      const back = !this.gatewayAnswers;
      this.gatewayAnswers = true;
      this.showServices(health);
      if (back) await this.recover();
    } catch (error) {
      this.gatewayAnswers = false;
      this.serving = undefined;
      say(byId("banner"), `${explain(error)} What is shown is what it said last. Trying again…`, "bad");
      this.showServices(undefined);
    }
  }

  /** After the gateway has come back: who we are and what there is may have changed. */
  private async recover(): Promise<void> {
    try {
      if (!(await this.client.greet())) {
        this.tellLoggedOut();
        return;
      }
    } catch (error) {
      say(byId("banner"), explain(error), "bad");
      return;
    }
    say(byId("banner"), "");
    this.live.renew();
    if (!this.robotDrawn) await this.loadRobot();
    await this.skills.refresh(this.service("learning"));
  }

  /** While nobody says so, a service is taken to be there: asking it tells what is wrong. */
  private service(name: string): Service {
    if (this.serving === undefined) return "serving";
    const serving = this.serving.get(name);
    return serving === undefined ? "absent" : serving ? "serving" : "silent";
  }

  private tellLoggedOut(): void {
    const link = make("a", "", "Log in again");
    link.href = "/login";
    const banner = byId("banner");
    banner.replaceChildren("Your login has ended. ", link);
    banner.hidden = false;
  }

  private showServices(health: Health | undefined): void {
    const entries = [{ name: "gateway", serving: health !== undefined, address: location.host }, ...(health?.backends ?? [])];
    if (health !== undefined) this.serving = new Map(entries.map((entry) => [entry.name, entry.serving]));
    byId("services").replaceChildren(...entries.map((entry) => {
      const item = make("li", "", entry.serving ? entry.name : `${entry.name} does not answer`);
      item.dataset["kind"] = entry.serving ? "good" : "bad";
      item.title = entry.address;
      return item;
    }));
  }

  // ---- the page itself ----

  private listen(): void {
    byId("theme").addEventListener("click", () => {
      const next = document.documentElement.dataset["theme"] === "dark" ? "light" : "dark";
      localStorage.setItem("theme", next);
      this.setTheme(next);
    });
    byId("log-out").addEventListener("click", () => {
      this.client.logOut().then(() => location.assign("/login"), (error: unknown) => say(byId("banner"), explain(error), "bad"));
    });
    byId("view-home").addEventListener("click", () => this.view?.home());
    byId("view-above").addEventListener("click", () => this.view?.fromAbove());
    for (const layer of LAYERS) {
      const box = byId<HTMLInputElement>(`show-${layer}`);
      box.addEventListener("change", () => this.view?.show(layer, box.checked));
    }
    addEventListener("pagehide", () => this.live.stop());
  }

  private setTheme(theme: string): void {
    document.documentElement.dataset["theme"] = theme;
    setText(byId("theme"), theme === "dark" ? "Light" : "Dark");
    this.view?.setTheme(theme === "dark");
    this.answerPlot.rebuild();
    this.robotPlot.rebuild();
  }

  private readonly said = new Map<string, string>();

  /** What is wrong with the picture, in the picture. */
  private tellView(about: string, problem: string): void {
    this.said.set(about, problem);
    say(byId("view-said"), [...this.said.values()].filter((text) => text !== "").join(" "), "warn");
  }

  /** Again and again, the next time so long after this one has ended. */
  private async every(period_ms: number, job: () => Promise<void>): Promise<void> {
    for (;;) {
      if (!document.hidden || !this.gatewayAnswers) await job();
      await new Promise((resolve) => setTimeout(resolve, period_ms));
    }
  }
}

void new Page().start();
