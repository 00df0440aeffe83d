/**
 * Runs one job at a time and, of those asked for meanwhile, only the last: what a moving slider or a dragged object needs.
 */
export class LatestOnly<In> {
  private running = false;
  private waiting: { value: In } | undefined;

  constructor(private readonly job: (value: In) => Promise<void>) {}

  ask(value: In): void {
    this.waiting = { value };
    if (!this.running) void this.run();
  }

  get busy(): boolean {
    return this.running;
  }

  private async run(): Promise<void> {
    this.running = true;
    try {
      while (this.waiting !== undefined) {
        const { value } = this.waiting;
        this.waiting = undefined;
        await this.job(value);
      }
    } finally {
      this.running = false;
    }
  }
}

/** Waits that grow from `first_ms` to `most_ms`, and begin anew after a success. */
export class Backoff {
  private next_ms: number;

  constructor(
    private readonly first_ms = 300,
    private readonly most_ms = 4000,
  ) {
    this.next_ms = first_ms;
  }

  wait_ms(): number {
    const now = this.next_ms;
    this.next_ms = Math.min(this.most_ms, now * 2);
    return now;
  }

  succeeded(): void {
    this.next_ms = this.first_ms;
  }
}
