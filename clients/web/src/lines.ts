/** Cuts a byte stream into lines, wherever its pieces end. */
export class LineSplitter {
  private readonly decoder = new TextDecoder();
  private rest = "";

  push(piece: Uint8Array): string[] {
    this.rest += this.decoder.decode(piece, { stream: true });
    const lines = this.rest.split("\n");
    this.rest = lines.pop() ?? "";
    return lines.filter((line) => line !== "");
  }

  /** What came after the last line's end. */
  end(): string[] {
    this.rest += this.decoder.decode();
    const last = this.rest;
    this.rest = "";
    return last.trim() === "" ? [] : [last];
  }
}
