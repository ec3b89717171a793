/** What the service has learned of the channels of views: how far they reach, and what they say. */

import type { Memory } from "../memory/memory";
import type { Channel } from "../wire";
import { h } from "./dom";
import { metres } from "./format";

/** Channels that are shown: those that were sensed first. */
const CHANNELS_MAX = 12;
/** A view that says so much fills its bar [nats]. */
const NATS_MAX = 6;

export class ChannelList {
  readonly element = h("ul", { class: "channels" });
  private drawn = "";

  update(memory: Memory): void {
    const views = memory.channels.filter(({ kind }) => kind === "descriptor");
    const shown = views.slice(0, CHANNELS_MAX);
    const drawn = JSON.stringify(shown);
    if (drawn === this.drawn) {
      return;
    }
    this.drawn = drawn;
    this.element.hidden = shown.length === 0;
    this.element.replaceChildren(...shown.map(row));
  }
}

function row({ name, views, learned }: Channel): HTMLElement {
  const bar = h("i");
  const nats = Math.max(0, learned?.information_nats ?? 0);
  bar.style.width = `${Math.min(100, (100 * nats) / NATS_MAX)}%`;
  const title =
    learned === null
      ? `${views ?? 0} views; nothing is learned of them yet`
      : `${views ?? 0} views, alike within ${metres(learned.range_m)}; ` +
        `each says ${nats.toFixed(1)} nats of where it was seen`;
  const range = learned === null ? "learning" : metres(learned.range_m);
  return h(
    "li",
    { title, attributes: { "data-channel": name } },
    h("span", { class: "what" }, name),
    h("span", { class: "bar" }, bar),
    h("span", { class: "soft number" }, range),
  );
}
