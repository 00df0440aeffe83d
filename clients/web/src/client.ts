import { CallError, errorOf } from "./errors";
import { LineSplitter } from "./lines";

type Fetch = (input: string, init?: RequestInit) => Promise<Response>;

const textOf = (request: unknown): string => (typeof request === "string" ? request : JSON.stringify(request));

/** The gateway's calls as JSON over HTTP. */
export class Client {
  /** Who is logged in; empty where the gateway asks nobody. */
  who = "";
  /** Called when the gateway no longer knows us. */
  onLoggedOut: () => void = () => undefined;
  /** Whether there is a login at all. */
  secured = false;
  private csrf = "";

  constructor(private readonly fetcher: Fetch = (input, init) => fetch(input, init)) {}

  /** Asks who we are. False: a login is needed. */
  async greet(): Promise<boolean> {
    const answer = await this.reach("/session", { cache: "no-store" });
    if (answer.status === 401) return false;
    if (answer.status === 404) return true; // no access file: nobody has to log in
    if (!answer.ok) throw errorOf(answer.status, await answer.text());
    const session = (await answer.json()) as { name?: string; csrf?: string };
    this.secured = true;
    this.who = session.name ?? "";
    this.csrf = session.csrf ?? "";
    return true;
  }

  /** A document of the gateway's own: "/healthz". */
  async get<T>(path: string, timeout_ms = 4000): Promise<T> {
    const answer = await this.reach(path, { cache: "no-store", signal: AbortSignal.timeout(timeout_ms) });
    const body = await answer.text();
    if (!answer.ok) throw errorOf(answer.status, body);
    return JSON.parse(body) as T;
  }

  /** "SkillService/Query" and its request; a text goes out as it is (one JSON object a line for calls that take a stream). */
  async call<T>(method: string, request: unknown = {}, signal?: AbortSignal): Promise<T> {
    const answer = await this.post(method, textOf(request), signal);
    const body = await answer.text();
    return JSON.parse(body) as T;
  }

  /** A call that answers with a stream; resolves at its end, rejects with its error. */
  async stream<T>(method: string, request: unknown, onMessage: (message: T) => void, signal?: AbortSignal): Promise<void> {
    const answer = await this.post(method, textOf(request), signal);
    const reader = answer.body?.getReader();
    if (reader === undefined) return;
    const splitter = new LineSplitter();
    const take = (lines: string[]): void => {
      for (const line of lines) {
        const message = JSON.parse(line) as T & { error?: { code: string; message: string; field?: string } };
        if (message.error !== undefined) throw new CallError(message.error.code, message.error.message, message.error.field ?? "");
        onMessage(message);
      }
    };
    try {
      for (;;) {
        const { done, value } = await reader.read();
        if (done) break;
        take(splitter.push(value));
      }
      take(splitter.end());
    } catch (error) {
      if (error instanceof TypeError) throw new CallError("unavailable", "the connection to the gateway broke", "", true);
      throw error;
    } finally {
      await reader.cancel().catch(() => undefined); // it may have broken already
    }
  }

  async logOut(): Promise<void> {
    const answer = await this.reach("/logout", { method: "POST", headers: this.headers() });
    if (!answer.ok) throw errorOf(answer.status, await answer.text());
  }

  private headers(): Record<string, string> {
    const headers: Record<string, string> = { "Content-Type": "application/json" };
    if (this.csrf !== "") headers["X-CSRF-Token"] = this.csrf;
    return headers;
  }

  private async post(method: string, body: string, signal?: AbortSignal): Promise<Response> {
    const init: RequestInit = { method: "POST", headers: this.headers(), body };
    if (signal !== undefined) init.signal = signal;
    const answer = await this.reach(`/exemplar.v1.${method}`, init);
    if (answer.status === 401) this.onLoggedOut();
    if (!answer.ok) throw errorOf(answer.status, await answer.text());
    return answer;
  }

  private async reach(path: string, init: RequestInit): Promise<Response> {
    try {
      return await this.fetcher(path, init);
    } catch (error) {
      if (error instanceof Error && error.name === "AbortError") throw error;
      throw new CallError("unavailable", "the gateway does not answer", "", true);
    }
  }
}
