/** Why a call failed, in the services' own words. */
export class CallError extends Error {
  constructor(
    /** "not_found", "permission_denied", ...; "unavailable" where the gateway itself does not answer. */
    readonly code: string,
    message: string,
    readonly field = "",
    /** The gateway was not reached at all. */
    readonly unreachable = false,
  ) {
    super(message);
    this.name = "CallError";
  }
}

/** Reads the error document of an HTTP answer; anything else becomes a sentence with the status. */
export function errorOf(status: number, body: string): CallError {
  try {
    const document: unknown = JSON.parse(body);
    if (typeof document === "object" && document !== null && "message" in document) {
      const { code, message, field } = document as { code?: unknown; message: unknown; field?: unknown };
      return new CallError(String(code ?? codeOf(status)), String(message), typeof field === "string" ? field : "");
    }
  } catch {
    // No JSON: told below by its status.
  }
  const said = body.trim().slice(0, 200);
  return new CallError(codeOf(status), said !== "" ? said : `the gateway answered with HTTP status ${status}`);
}

function codeOf(status: number): string {
  const codes: Record<number, string> = { 400: "invalid_argument", 401: "unauthenticated", 403: "permission_denied", 404: "not_found", 429: "resource_exhausted", 503: "unavailable" };
  return codes[status] ?? "internal";
}

/** For a person, with what to do about it where that is known. */
export function explain(error: unknown, who = ""): string {
  if (!(error instanceof CallError)) return error instanceof Error ? error.message : String(error);
  if (error.unreachable) return "The gateway does not answer.";
  if (error.code === "permission_denied") {
    return `${who === "" ? "This login" : `The login ${who}`} may not do that: ${error.message}`;
  }
  if (error.code === "unauthenticated") return `Not logged in: ${error.message}`;
  return error.field === "" ? error.message : `${error.message} (${error.field})`;
}

/** True for what comes from our own aborting of a call. */
export function isAbort(error: unknown): boolean {
  return error instanceof Error && error.name === "AbortError";
}
