/** The live stream of a space, which comes back by itself. */

import { parse } from "./json";
import { Problem } from "./problem";
import type { Space } from "./service";
import { EventParser } from "./sse";
import type { Tick } from "./wire";

/** Waits before another try: the first one, and the longest [ms]. */
const RETRY_MS = 500;
const RETRY_MS_MAX = 5000;
/** The service says something every fifteen seconds; silence beyond this is a break [ms]. */
const SILENCE_MS = 20_000;

/**
 * A page that nobody sees lets go of its stream after a while [ms]: a browser has six connections
 * to a service for all of its tabs.
 */
const HIDDEN_MS = 10_000;

export type Connection =
  | { state: "connecting" }
  | { state: "live" }
  | { state: "reconnecting"; problem: Problem }
  | { state: "refused"; problem: Problem };

export interface StreamListener {
  /** A connection stands, before its first tick. */
  opened(): void;
  ticked(tick: Tick): void;
  lagged(ticks: number): void;
  changed(connection: Connection): void;
}

export class LiveStream {
  private readonly stop = new AbortController();

  constructor(
    private readonly space: Space,
    private readonly rateHz: number,
    private readonly listener: StreamListener,
  ) {
    void this.run();
  }

  close(): void {
    this.stop.abort();
  }

  private async run(): Promise<void> {
    let wait = RETRY_MS;
    this.listener.changed({ state: "connecting" });
    while (!this.stop.signal.aborted) {
      await seen();
      let problem: Problem;
      try {
        await this.follow(() => (wait = RETRY_MS));
        problem = new Problem(0, "the stream ended", "");
      } catch (error) {
        problem = Problem.from(error);
      }
      if (this.stop.signal.aborted) {
        return;
      }
      if (document.hidden) {
        this.listener.changed({ state: "connecting" });
        continue;
      }
      // A wrong token or an unknown space does not become right by asking again.
      if ([400, 401, 403, 404].includes(problem.status)) {
        this.listener.changed({ state: "refused", problem });
        return;
      }
      this.listener.changed({ state: "reconnecting", problem });
      await new Promise((resume) => setTimeout(resume, wait));
      wait = Math.min(wait * 1.6, RETRY_MS_MAX);
    }
  }

  private async follow(opened: () => void): Promise<void> {
    const connection = new AbortController();
    const abort = (): void => connection.abort();
    this.stop.signal.addEventListener("abort", abort);
    let timer = setTimeout(abort, SILENCE_MS);
    let hiding: ReturnType<typeof setTimeout> | undefined;
    const hide = (): void => {
      clearTimeout(hiding);
      hiding = document.hidden ? setTimeout(abort, HIDDEN_MS) : undefined;
    };
    document.addEventListener("visibilitychange", hide);
    try {
      const answer = await this.space.live(this.rateHz, connection.signal);
      if (answer.body === null) {
        throw new Problem(0, "the answer has no body", "");
      }
      opened();
      this.listener.opened();
      this.listener.changed({ state: "live" });
      const parser = new EventParser();
      const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
      for (;;) {
        const { value, done } = await reader.read();
        if (done) {
          return;
        }
        clearTimeout(timer);
        timer = setTimeout(abort, SILENCE_MS);
        for (const { event, data } of parser.push(value)) {
          if (event === "tick") {
            this.listener.ticked(parse(data) as unknown as Tick);
          } else if (event === "lagged") {
            this.listener.lagged((parse(data) as { ticks: number }).ticks);
          }
        }
      }
    } finally {
      clearTimeout(timer);
      clearTimeout(hiding);
      document.removeEventListener("visibilitychange", hide);
      this.stop.signal.removeEventListener("abort", abort);
    }
  }
}

/** Waits until somebody sees the page. */
function seen(): Promise<void> {
  return new Promise((resume) => {
    const look = (): void => {
      if (!document.hidden) {
        document.removeEventListener("visibilitychange", look);
        resume();
      }
    };
    document.addEventListener("visibilitychange", look);
    look();
  });
}
