/** What happened lately, in words. */

import type { Memory, ShownEvent } from "../memory/memory";
import { agentColour, type Palette } from "../scene/palette";
import type { Vec3 } from "../wire";
import { h } from "./dom";
import { exact, metres, percent, some, time } from "./format";

/** Lines that stay. */
const LINES_MAX = 60;
/** A correction that is no more than this is no news [m]. */
const MOVED_MIN_M = 0.01;

/** An event in a few words after its agent; null for those that only flash in the scene. */
export function inWords({ kind, fields }: ShownEvent): string | null {
  const text = (name: string): string => String(fields[name]);
  switch (kind) {
    case "agent_enrolled":
      return "joined the team";
    case "session_started":
      return "began a session";
    case "agent_placed": {
      const [x, y, z] = fields["translation_m"] as Vec3;
      return `was found at ${[x, y, z].map((c) => metres(c).replace(" m", "")).join(", ")} m`;
    }
    case "loops_closed": {
      const movedM = Number(fields["moved_m"]);
      return movedM < MOVED_MIN_M ? null : `closed loops and moved by ${metres(movedM)}`;
    }
    case "trip_ended":
      if (fields["reason"] === "full") {
        return null; // The next one continues it.
      }
      return `ended a trip of ${some(Number(fields["legs"]), "leg")} (${text("reason").replace("_", " ")})`;
    case "landmark_learned":
      return `learned the landmark ${text("landmark")}`;
    case "marker_passed":
      return `passed ${text("label")}`;
    case "percept_surprising":
      return `felt something surprising on ${text("channel")}`;
    case "objects_narrowed":
      return Number(fields["live"]) === 1
        ? "touches one known object, or a new one"
        : `touches one of ${text("live")} objects`;
    case "object_recognised":
      return `recognised ${text("object")} (${percent(Number(fields["probability"]))})`;
    case "object_unknown":
      return "touches something unknown";
    case "object_learned":
      return `learned ${text("object")} by ${some(Number(fields["contacts"]), "contact")}`;
    case "object_not_learned":
      return "could not tell how to learn what it touched";
    case "objects_merged":
      return `found ${text("absorbed")} to be ${text("object")}`;
    case "object_split":
      return `found ${text("part")} not to be ${text("object")}`;
    case "samples_skipped":
      return skipped(Number(fields["from"]), Number(fields["to"]), text("reason"));
    case "trip_forgotten":
      return `made room: trip ${text("trip")} was forgotten`;
    case "route_left":
      return "goes another way";
    case "route_done":
      return "has arrived";
    case "route_failed":
      return `gave up its route (${text("reason").replaceAll("_", " ")})`;
    case "agent_removed":
      return "was removed";
    default:
      return null;
  }
}

/** Samples that are not in the map, with why: `from` is the first of them, `to` the first beyond. */
function skipped(from: number, to: number, reason: string): string {
  const last = to - 1;
  const samples = last > from ? `samples ${from} to ${last}` : `sample ${from}`;
  const why = reason.replaceAll("_", " ");
  return reason === "lost" ? `${samples} never came` : `refused ${samples} (${why})`;
}

export class EventFeed {
  readonly element = h("ol", {
    class: "feed",
    attributes: { "aria-live": "polite", "aria-label": "events" },
  });

  clear(): void {
    this.element.replaceChildren();
  }

  add(events: ShownEvent[], memory: Memory, palette: Palette): void {
    const told = events.flatMap((event) => {
      const words = inWords(event);
      return words === null ? [] : [{ event, words }];
    });
    for (const { event, words } of told.slice(-LINES_MAX)) {
      const name = h("b", {}, event.event.agent);
      const agent = memory.agents.get(event.event.agent);
      if (agent !== undefined) {
        name.style.color = agentColour(palette, agent.colour);
      }
      const stamp = event.event.stamp_ns;
      const isStamped = Number(stamp) !== 0;
      const when = isStamped ? time(stamp).replace(/\.\d$/, "") : "–";
      const line = h(
        "li",
        { title: isStamped ? exact(stamp) : "" },
        h("time", {}, when),
        h("span", {}, name, ` ${words}`),
      );
      line.classList.add(event.kind);
      this.element.prepend(line);
    }
    while (this.element.childElementCount > LINES_MAX) {
      this.element.lastElementChild!.remove();
    }
  }
}
