/** What the service has learned of channels: how far views reach and what they say, and which
 *  levels are a compass. */

import type { Memory } from "../memory/memory";
import type { Channel } from "../wire";
import { h } from "./dom";
import { degrees, metres, percent } from "./format";

/** Channels that are shown: those that were sensed first. */
const CHANNELS_MAX = 12;
/** A view that says so much fills its bar [nats]. */
const NATS_MAX = 6;

export class ChannelList {
  readonly element = h("ul", { class: "channels" });
  private drawn = "";

  update(memory: Memory): void {
    const shown = memory.channels
      .filter(({ kind, compass }) => kind === "descriptor" || compass !== null)
      .slice(0, CHANNELS_MAX);
    const drawn = JSON.stringify(shown);
    if (drawn === this.drawn) {
      return;
    }
    this.drawn = drawn;
    this.element.hidden = shown.length === 0;
    this.element.replaceChildren(...shown.map(row));
  }
}

function row(channel: Channel): HTMLElement {
  return channel.compass === null ? viewRow(channel) : compassRow(channel.name, channel.compass);
}

function compassRow(name: string, compass: NonNullable<Channel["compass"]>): HTMLElement {
  const lasting = degrees(compass.lasting_sd_rad);
  const title =
    `a compass: its levels tell the heading to ${lasting} that lasts, ` +
    `and ${degrees(compass.noise_sd_rad)} of noise`;
  return h(
    "li",
    { title, attributes: { "data-channel": name } },
    h("span", { class: "what" }, name),
    h("span", { class: "soft" }, "compass"),
    h("span", { class: "soft number" }, `± ${lasting}`),
  );
}

function viewRow({ name, views, learned }: Channel): HTMLElement {
  const bar = h("i");
  const nats = Math.max(0, learned?.information_nats ?? 0);
  bar.style.width = `${Math.min(100, (100 * nats) / NATS_MAX)}%`;
  const title =
    learned === null
      ? `${views ?? 0} views; nothing is learned of them yet`
      : `${views ?? 0} views, alike within ${metres(learned.range_m)}; ` +
        `each says ${nats.toFixed(1)} nats of where it was seen` +
        `; half a turn leaves ${percent(learned.turned[4] ?? 1)} of it` +
        (learned.coarse ? "; too far to close loops by" : "");
  const range = learned === null ? "learning" : metres(learned.range_m);
  return h(
    "li",
    { title, attributes: { "data-channel": name } },
    h("span", { class: "what" }, name),
    h("span", { class: "bar" }, bar),
    h("span", { class: "soft number" }, range),
  );
}
