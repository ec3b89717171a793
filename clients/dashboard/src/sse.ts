/** Server-sent events, read from the body of an answer: `EventSource` can send no token. */

export interface ServerSentEvent {
  event: string;
  data: string;
}

/** Puts the pieces of a stream together. */
export class EventParser {
  private rest = "";
  private event = "";
  private data: string[] = [];

  /** The events that a piece of the stream completes. */
  push(piece: string): ServerSentEvent[] {
    const found: ServerSentEvent[] = [];
    const lines = (this.rest + piece).split(/\r\n|\n|\r(?!$)/);
    this.rest = lines.pop() ?? "";
    for (const line of lines) {
      if (line === "") {
        if (this.data.length > 0) {
          found.push({ event: this.event || "message", data: this.data.join("\n") });
        }
        this.event = "";
        this.data = [];
        continue;
      }
      const colon = line.indexOf(":");
      const field = colon < 0 ? line : line.slice(0, colon);
      const value = colon < 0 ? "" : line.slice(colon + 1).replace(/^ /, "");
      if (field === "event") {
        this.event = value;
      } else if (field === "data") {
        this.data.push(value);
      }
    }
    return found;
  }
}
