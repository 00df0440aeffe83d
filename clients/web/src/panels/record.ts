import type { Client } from "../client";
import { byId, make, say, sayMissing, setText, table } from "../dom";
import { CallError, explain } from "../errors";
import { bytes, number, seconds, toNumber, words } from "../format";
import type { RecorderStatus, Service, TopicInfo } from "../types";

interface Recordings { recordings: { name: string; bytes: number; written_s: number }[] }

/** Recording, and what flows on the station's topics. */
export class RecordPanel {
  private readonly problem = byId("record-problem");
  private readonly stateBox = byId("record-state");
  private readonly line = byId("record-line");
  private readonly name = byId<HTMLInputElement>("record-name");
  private state = "";
  private listed_ms = -1e9;
  private absent = false;
  /** Told what flows, each time it was asked. */
  onTopics: (topics: readonly TopicInfo[]) => void = () => undefined;

  constructor(private readonly client: Client) {
    byId<HTMLFormElement>("record-form").addEventListener("submit", (event) => {
      event.preventDefault();
      void this.order("Start", { name: this.name.value.trim() });
    });
    byId("record-stop").addEventListener("click", () => void this.order("Stop"));
    byId("record-pause").addEventListener("click", () => void this.order("Pause"));
    byId("record-resume").addEventListener("click", () => void this.order("Resume"));
    byId("record-event").addEventListener("click", () => void this.order("MarkEvent", { note: "marked on the page" }));
    this.showState();
  }

  /** Asks the recorder, where there is one. */
  async refresh(service: Service): Promise<void> {
    this.absent = service === "absent";
    if (this.absent) sayMissing(this.line, "recorder", "--recorder");
    if (service !== "serving") {
      this.setState("", "");
      return;
    }
    try {
      const { status } = await this.client.call<{ status: RecorderStatus }>("RecorderService/GetStatus", {}, AbortSignal.timeout(4000));
      this.show(status);
    } catch (error) {
      this.setState("", `Recorder: ${explain(error, this.client.who)}`);
    }
  }

  async refreshTopics(): Promise<void> {
    const box = byId("topics");
    try {
      const { topics } = await this.client.call<{ topics?: TopicInfo[] }>("TopicService/List", {}, AbortSignal.timeout(4000));
      this.onTopics(topics ?? []);
      const shown = (topics ?? []).filter((topic) => topic.writers > 0 || toNumber(topic.received) > 0);
      const rows = shown.map((topic) => ({
        cells: [topic.topic.replace(/^ircp\//, ""), number(topic.rate_hz, topic.rate_hz < 10 ? 1 : 0), `${bytes(topic.bytes_per_s)}/s`, String(topic.lost)],
        mark: toNumber(topic.lost) > 0 ? "lost" : topic.rate_hz === 0 ? "silent" : "",
      }));
      const top = box.scrollTop;
      box.replaceChildren(rows.length > 0 ? table(["topic", "Hz", "flow", "lost"], rows) : make("p", "muted", "Nobody writes in this station."));
      box.scrollTop = top;
    } catch (error) {
      box.replaceChildren(make("p", "muted", `Topics: ${explain(error, this.client.who)}`));
    }
  }

  private show(status: RecorderStatus): void {
    const active = status.state === "recording" || status.state === "paused";
    const file = status.file.split("/").pop() ?? "";
    const amount = `${seconds(status.duration_s)}, ${bytes(toNumber(status.bytes))}, ${status.messages} messages`;
    setText(this.line, file === "" ? `Nothing recorded yet; ${bytes(toNumber(status.disk_free_bytes))} free` : active ? `${file}: ${amount}` : `Last: ${file} (${amount})`);
    const ended = this.state !== "" && active === false && (this.state === "recording" || this.state === "paused");
    this.setState(status.state, toNumber(status.lost) > 0 ? `${status.lost} samples were lost since the recorder started.` : "", toNumber(status.lost) > 0 ? "warn" : "bad");
    if (ended || performance.now() - this.listed_ms > 15000) void this.listRecordings();
  }

  private async listRecordings(): Promise<void> {
    this.listed_ms = performance.now();
    const box = byId("recordings");
    try {
      const { recordings } = await this.client.get<Recordings>("/recordings.json");
      const rows = recordings.map((one) => ({ cells: [one.name, new Date(one.written_s * 1e3).toLocaleString(), bytes(one.bytes)] }));
      box.replaceChildren(rows.length > 0 ? table(["file", "written", "size"], rows) : "None yet.");
    } catch (error) {
      box.replaceChildren(error instanceof CallError && error.code === "not_found" ? "The gateway was not told where recordings are (--recordings)." : explain(error));
    }
  }

  private async order(what: "Start" | "Stop" | "Pause" | "Resume" | "MarkEvent", request: object = {}): Promise<void> {
    try {
      const { status } = await this.client.call<{ status: RecorderStatus }>(`RecorderService/${what}`, request);
      this.show(status);
      if (what === "Start") this.name.value = "";
    } catch (error) {
      say(this.problem, `${what === "MarkEvent" ? "Event" : what}: ${explain(error, this.client.who)}`, "bad");
    }
  }

  private setState(state: string, problem: string, kind: "bad" | "warn" = "bad"): void {
    this.state = state;
    say(this.problem, problem, kind);
    this.showState();
  }

  private showState(): void {
    setText(this.stateBox, this.absent ? "none" : this.state === "" ? "not reached" : words(this.state));
    this.stateBox.dataset["kind"] = this.absent ? "" : this.state === "" ? "bad" : this.state === "recording" ? "busy" : "";
    const active = this.state === "recording" || this.state === "paused";
    byId("record-form").hidden = active || this.absent;
    byId("record-event").hidden = this.absent;
    byId<HTMLButtonElement>("record-start").disabled = this.state === "";
    byId<HTMLButtonElement>("record-event").disabled = this.state === "";
    byId("record-stop").hidden = !active;
    byId("record-pause").hidden = this.state !== "recording";
    byId("record-resume").hidden = this.state !== "paused";
  }
}
