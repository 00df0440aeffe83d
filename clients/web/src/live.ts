import type { Client } from "./client";
import { explain, isAbort } from "./errors";
import { Backoff } from "./latest";
import type { SubscribeMessage, TopicSample } from "./types";

const SILENCE_MS = 6000;

/** The station's topics as they come; begins again by itself after any break. */
export class Live {
  onSample: (sample: TopicSample) => void = () => undefined;
  /** Why nothing comes; empty: it does. */
  onState: (problem: string) => void = () => undefined;
  samples = 0;
  private stopped = false;
  private current: AbortController | undefined;
  private heard_ms = 0;

  constructor(
    private readonly client: Client,
    private readonly topics: readonly string[],
    private readonly rate_hz: number,
  ) {}

  async run(): Promise<void> {
    const backoff = new Backoff();
    while (!this.stopped) {
      let problem = "the live data ended";
      this.current = new AbortController();
      this.heard_ms = performance.now();
      const watch = setInterval(() => {
        if (performance.now() - this.heard_ms > SILENCE_MS) this.onState("No live data from the station.");
      }, 1000);
      try {
        const request = { topics: this.topics, max_rate_hz: this.rate_hz, content: "CONTENT_JSON" };
        await this.client.stream<SubscribeMessage>("TopicService/Subscribe", request, (message) => {
          this.heard_ms = performance.now();
          backoff.succeeded();
          this.onState("");
          for (const sample of message.samples ?? []) {
            this.samples += 1;
            this.onSample(sample);
          }
        }, this.current.signal);
      } catch (error) {
        if (!isAbort(error)) problem = explain(error);
      } finally {
        clearInterval(watch);
      }
      if (this.stopped) return;
      this.onState(problem);
      await new Promise((resolve) => setTimeout(resolve, backoff.wait_ms()));
    }
  }

  /** Breaks the present connection, so that a new one is made. */
  renew(): void {
    this.current?.abort();
  }

  stop(): void {
    this.stopped = true;
    this.current?.abort();
  }
}
