/** The labels of agents, landmarks, scales and recalled places. */

import type { Agent } from "../memory/agent";
import { percent } from "../panel/format";
import type { Landmark, RecalledPlace, Vec3 } from "../wire";
import type { Mark } from "./floor";
import type { Label } from "./labels";
import { agentColour, type Palette } from "./palette";
import type { Projection } from "./picker";

export function agentLabel(
  agent: Agent,
  at: Vec3,
  isLive: boolean,
  isMarked: boolean,
  projection: Projection,
  palette: Palette,
): Label[] {
  const seen = projection.at(at);
  if (seen === null) {
    return [];
  }
  const notes: string[] = [];
  if (isLive && agent.live.status !== "localized") {
    notes.push(agent.live.status);
  }
  const best = agent.touch?.identification?.objects[0];
  if (isLive && agent.live.contacts !== null && best !== undefined) {
    notes.push(`${best.name} ${percent(best.probability)}`);
  }
  return [
    {
      text: agent.name,
      x: seen.x + 15,
      y: seen.y - 1,
      weight: isMarked ? 100 : 50,
      size: 12.5,
      bold: true,
      colour: agentColour(palette, agent.colour),
      ...(notes.length > 0 ? { note: notes.join(" · ") } : {}),
    },
  ];
}

export function landmarkLabels(
  landmarks: Landmark[],
  projection: Projection,
  palette: Palette,
): Label[] {
  return landmarks.flatMap(({ id, translation_m }) => {
    const seen = projection.at(translation_m);
    return seen === null
      ? []
      : [
          {
            text: id,
            x: seen.x + 9,
            y: seen.y,
            weight: 10 - Math.min(seen.depth, 1e3) / 1e3,
            size: 10.5,
            colour: palette.landmark,
            alpha: 0.82,
          },
        ];
  });
}

export function markLabels(marks: Mark[], projection: Projection, palette: Palette): Label[] {
  return marks.flatMap(({ at, text, axis, isName }) => {
    const seen = projection.at(at);
    return seen === null
      ? []
      : [
          {
            text,
            x: seen.x,
            y: seen.y,
            weight: isName ? 3 : 1,
            size: isName ? 12 : 10,
            bold: isName,
            align: "center" as const,
            colour: isName ? palette.axis[axis] : palette.label,
            alpha: isName ? 1 : 0.5,
          },
        ];
  });
}

export function recallLabels(
  places: RecalledPlace[],
  projection: Projection,
  palette: Palette,
): Label[] {
  return places.flatMap(({ place }, rank) => {
    const seen = projection.at(place.translation_m);
    return seen === null
      ? []
      : [
          {
            text: String(rank + 1),
            x: seen.x + (rank === 0 ? 14 : 10),
            y: seen.y - 8,
            weight: 80 - rank,
            size: rank === 0 ? 13 : 11,
            bold: true,
            colour: palette.recall,
          },
        ];
  });
}
