import type { Client } from "../client";
import { byId, make, say, setText } from "../dom";
import { CallError, explain } from "../errors";
import { mm, number, seconds, words } from "../format";
import type { TeleoperationFeedback, TeleoperationResult, TopicInfo } from "../types";

/** The robot does what the person in the suit does, for as long as this page or someone else holds the mode on. */
export class TeleopPanel {
  /** Told when this page begins or ends to hold the robot. */
  onHeld: () => void = () => undefined;
  private readonly box = byId<HTMLDetailsElement>("teleop-box");
  private readonly suit = byId<HTMLInputElement>("teleop-suit");
  private readonly touch = byId("teleop-touch");
  private readonly onButton = byId<HTMLButtonElement>("teleop-on");
  private readonly offButton = byId<HTMLButtonElement>("teleop-off");
  private readonly said = byId("teleop-said");
  private ours = false;
  private robotIsFree = false;
  private active = false;

  constructor(private readonly client: Client) {
    byId<HTMLFormElement>("teleop-form").addEventListener("submit", (event) => {
      event.preventDefault();
      void this.turnOn();
    });
    this.offButton.addEventListener("click", () => void this.turnOff());
    this.showState();
  }

  /** Whether the mode ends with this page. */
  get isOurs(): boolean {
    return this.ours;
  }

  /** What the robot's touch links may be allowed to touch. */
  setObjects(names: readonly string[]): void {
    this.touch.hidden = names.length === 0;
    this.touch.replaceChildren(make("legend", "", "May touch"), ...names.map((name) => {
      const box = make("input");
      box.type = "checkbox";
      box.value = name;
      return make("label", "check", box, name);
    }));
  }

  /** Whether those whom it takes are heard at all. */
  setTopics(topics: readonly TopicInfo[]): void {
    const heard = (topic: string): string => {
      const found = topics.find((info) => info.topic === topic);
      return found === undefined || !(found.rate_hz > 0) ? "not heard" : number(found.rate_hz, 0, "Hz");
    };
    setText(byId("teleop-heard"), `Suit: ${heard("ircp/suit")}. Dead-man: ${heard("ircp/safety")}.`);
  }

  setRobot(active: boolean, isFree: boolean): void {
    if (active && !this.active) this.box.open = true;
    if (!active && this.active && !this.ours) this.figures([]);
    this.active = active;
    this.robotIsFree = isFree;
    this.showState();
  }

  private async turnOn(): Promise<void> {
    if (this.ours) return;
    const touch = [...this.touch.querySelectorAll<HTMLInputElement>("input:checked")].map((box) => box.value);
    this.hold(true);
    say(this.said, "");
    try {
      let result: TeleoperationResult | undefined;
      await this.client.stream<{ feedback?: TeleoperationFeedback; result?: TeleoperationResult }>(
        "ExecutorService/Teleoperate", { suit: this.suit.value.trim(), touch }, (message) => {
          if (message.feedback !== undefined) this.figures(feedbackFigures(message.feedback));
          result = message.result ?? result;
        });
      if (result !== undefined) say(this.said, judgeTeleoperation(result), result.state === "done" ? "good" : "bad");
    } catch (error) {
      const refused = error instanceof CallError && error.code === "failed_precondition";
      say(this.said, `${refused ? "Refused: " : "Teleoperation: "}${explain(error, this.client.who)}`, "bad");
    } finally {
      this.figures([]);
      this.hold(false);
    }
  }

  private async turnOff(): Promise<void> {
    try {
      await this.client.call("ExecutorService/EndTeleoperation");
    } catch (error) {
      say(this.said, `Not turned off: ${explain(error, this.client.who)} STOP and the dead-man still hold the robot.`, "bad");
    }
  }

  private hold(ours: boolean): void {
    this.ours = ours;
    this.showState();
    this.onHeld();
  }

  private showState(): void {
    const on = this.active || this.ours;
    this.onButton.hidden = on;
    this.onButton.disabled = !this.robotIsFree;
    this.offButton.hidden = !on;
    this.suit.disabled = on;
    for (const box of this.touch.querySelectorAll("input")) box.disabled = on;
  }

  private figures(rows: readonly (readonly [string, string])[]): void {
    byId("teleop-figures").replaceChildren(...rows.map(([name, value]) => make("div", "", make("dt", "", name), make("dd", "", value))));
  }
}

function feedbackFigures(now: TeleoperationFeedback): [string, string][] {
  const joint = now.behind_joint === "" ? "" : ` (${words(now.behind_joint)})`;
  return [
    ["on for", seconds(now.time_s)], ["suit", number(now.suit_rate_hz, 0, "Hz")], ["touch", number(now.touch_n, 1, "N")],
    ["clearance", mm(now.clearance_m)], ["behind", `${number(now.behind_rad, 2, "rad")}${joint}`],
  ];
}

/** How it ended, as a sentence or two. */
export function judgeTeleoperation(result: TeleoperationResult): string {
  const ended = result.state === "done" ? "Ended" : `${words(result.state)}${result.detail === "" ? "" : `: ${result.detail}`}`;
  const held = result.holds === "0" ? "" : `, held ${result.holds} ${result.holds === "1" ? "time" : "times"}`;
  const blocked = result.blocks === "0" ? "" : `, blocked ${result.blocks} ${result.blocks === "1" ? "time" : "times"}`;
  const nearest = result.clearance_m === undefined ? "" : `, ${mm(result.clearance_m)} clear at the nearest`;
  return `${ended}. The robot followed for ${seconds(result.following_s)} of ${seconds(result.duration_s)}${held}${blocked}; touch up to ${number(result.touch_max_n, 1, "N")}${nearest}.`;
}
