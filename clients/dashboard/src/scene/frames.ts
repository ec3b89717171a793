/** How long the page's own work takes for a frame. */

const KEPT = 240;

export class Frames {
  private readonly ms: number[] = [];
  private pending = 0;
  n = 0;

  /** Adds work between frames, such as taking in a tick; it counts to the next frame. */
  add(ms: number): void {
    this.pending += ms;
  }

  end(ms: number): void {
    this.ms.push(ms + this.pending);
    this.pending = 0;
    this.n += 1;
    if (this.ms.length > KEPT) {
      this.ms.shift();
    }
  }

  forget(): void {
    this.ms.length = 0;
  }

  /** Median, 95th percentile and mean over the latest frames [ms]. */
  get figures(): { p50: number; p95: number; mean: number; n: number } {
    const sorted = [...this.ms].sort((a, b) => a - b);
    const at = (part: number): number => sorted[Math.floor(part * (sorted.length - 1))] ?? 0;
    const mean = sorted.reduce((sum, x) => sum + x, 0) / Math.max(1, sorted.length);
    return { p50: at(0.5), p95: at(0.95), mean, n: sorted.length };
  }
}
