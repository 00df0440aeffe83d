// A file as @mcap/core reads it.
export class FileHandleReadable {
  #handle;

  constructor(handle) {
    this.#handle = handle;
  }

  async size() {
    return BigInt((await this.#handle.stat()).size);
  }

  async read(offset, length) {
    const buffer = new Uint8Array(Number(length));
    const { bytesRead } = await this.#handle.read({ buffer, position: Number(offset), length: buffer.byteLength });
    if (bytesRead !== buffer.byteLength) throw new Error(`the file ends ${buffer.byteLength - bytesRead} bytes early`);
    return buffer;
  }
}
