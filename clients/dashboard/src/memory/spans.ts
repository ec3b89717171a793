/** What times the stamps of a space span. Robots may have clocks that have nothing in common: a
 * simulation counts from 0 beside robots that have the time of day. Each such clock has a span of
 * its own, and one of them is shown. */

/** Stamps farther than this from all of a span are of another one [s]. */
const GAP_S = 3600;
/** The span that is shown stays until nothing was heard in it for so long [ms]. */
const QUIET_MS = 10_000;
/** Spans that are kept: a clock that leaps makes a new one each time. */
const SPANS_MAX = 16;

interface Span {
  begin: number;
  end: number;
  /** When a live stamp of it came last [ms]. */
  heardMs: number;
}

export class Spans {
  private spans: Span[] = [];
  private shown: Span | null = null;
  private shownSinceMs = 0;

  /** Earliest time of the span that is shown [s]; infinite before the first stamp. */
  get begin(): number {
    return this.shown?.begin ?? Infinity;
  }

  /** Latest time of it [s]; minus infinite before the first stamp. */
  get end(): number {
    return this.shown?.end ?? -Infinity;
  }

  /** Takes in a time of the past [s]. */
  note(s: number): void {
    this.join({ begin: s, end: s, heardMs: -Infinity });
  }

  /** Takes in a time that came live [s], in a tick that came at `nowMs`. */
  hear(s: number, nowMs: number): void {
    const span = this.join({ begin: s, end: s, heardMs: nowMs });
    const shown = this.shown;
    if (shown === null || shown === span) {
      this.show(span, shown === null ? nowMs : this.shownSinceMs);
    } else if (nowMs - shown.heardMs > QUIET_MS) {
      this.show(span, nowMs);
    } else if (this.shownSinceMs === nowMs && span.end > shown.end) {
      this.show(span, nowMs); // of those in the first tick the latest
    }
  }

  private show(span: Span, sinceMs: number): void {
    this.shown = span;
    this.shownSinceMs = sinceMs;
  }

  /** Makes one span of a new one and all that it touches. */
  private join(span: Span): Span {
    const apart: Span[] = [];
    for (const other of this.spans) {
      if (other.begin - span.end > GAP_S || span.begin - other.end > GAP_S) {
        apart.push(other);
        continue;
      }
      span.begin = Math.min(span.begin, other.begin);
      span.end = Math.max(span.end, other.end);
      span.heardMs = Math.max(span.heardMs, other.heardMs);
      if (other === this.shown) {
        this.shown = span;
      }
    }
    if (apart.length >= SPANS_MAX) {
      apart.splice(
        apart.findIndex((other) => other !== this.shown),
        1,
      );
    }
    this.spans = [...apart, span];
    return span;
  }
}
