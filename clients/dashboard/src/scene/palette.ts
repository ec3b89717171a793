/** Colours of the scene, for dark and for light surroundings; sRGB, each channel in [0, 1]. */

import type { Status } from "../wire";

export type Rgb = [number, number, number];

export function rgb(hex: string): Rgb {
  const n = parseInt(hex.slice(1), 16);
  return [(n >> 16) / 255, ((n >> 8) & 255) / 255, (n & 255) / 255];
}

export type Shade = "dark" | "light";

export interface Palette {
  shade: Shade;
  agents: string[];
  status: Record<Status, string>;
  /** From the least to the most, four stops each. */
  strength: string[];
  age: string[];
  landmark: string;
  trip: string;
  grid: string;
  axis: { x: string; y: string; z: string };
  label: string;
  labelHalo: string;
  flash: Record<string, string>;
  recall: string;
  /** Part of the light that is added instead of laid over. */
  glow: number;
}

export const PALETTES: Record<Shade, Palette> = {
  dark: {
    shade: "dark",
    agents: [
      "#ff9d4d",
      "#ff6fa8",
      "#b9ea58",
      "#b794ff",
      "#ffd84d",
      "#5fe08a",
      "#ff7a66",
      "#f08bff",
      "#48e0d0",
      "#e2c89b",
    ],
    status: { localized: "#5be3a1", uncertain: "#ffc14d", lost: "#ff5d5d" },
    strength: ["#234a86", "#2f7fd0", "#66cdf7", "#eafcff"],
    age: ["#3a2f74", "#8a49b8", "#ec6a8c", "#ffd98a"],
    landmark: "#f4e3b5",
    trip: "#7fa3d8",
    grid: "#6f8fbf",
    axis: { x: "#e0687a", y: "#74c98a", z: "#6ea8ff" },
    label: "#dfe8f5",
    labelHalo: "#070b12",
    flash: {
      agent_placed: "#8dffc4",
      loops_closed: "#b9a2ff",
      object_recognised: "#ffe38a",
      objects_merged: "#ffe38a",
      object_split: "#ffb38a",
      object_learned: "#ffe38a",
      landmark_learned: "#f4e3b5",
      place_recruited: "#8fd8ff",
      place_entered: "#bfe6ff",
      percept_surprising: "#ff8ad0",
      place_forgotten: "#ff7a66",
      session_started: "#ffffff",
      agent_enrolled: "#ffffff",
    },
    recall: "#ffffff",
    glow: 0.55,
  },
  light: {
    shade: "light",
    agents: [
      "#d9600a",
      "#d1246e",
      "#4f8a00",
      "#6d3fd4",
      "#b07f00",
      "#12854a",
      "#c93a25",
      "#a322b8",
      "#00807a",
      "#80683a",
    ],
    status: { localized: "#11895a", uncertain: "#c07a00", lost: "#d12f2f" },
    strength: ["#a9c2e0", "#6197cf", "#1f62b0", "#08275c"],
    age: ["#b9aede", "#8763bd", "#c23f78", "#a84e00"],
    landmark: "#7a5b12",
    trip: "#4a6c9c",
    grid: "#5d7799",
    axis: { x: "#b83a4d", y: "#2f8a48", z: "#2d63c8" },
    label: "#16202e",
    labelHalo: "#f5f8fc",
    flash: {
      agent_placed: "#0f9d62",
      loops_closed: "#6a3fd0",
      object_recognised: "#b07f00",
      objects_merged: "#b07f00",
      object_split: "#b3541a",
      object_learned: "#b07f00",
      landmark_learned: "#7a5b12",
      place_recruited: "#2f7fd0",
      place_entered: "#5b8fc0",
      percept_surprising: "#b8257f",
      place_forgotten: "#c93a25",
      session_started: "#33465e",
      agent_enrolled: "#33465e",
    },
    recall: "#101826",
    glow: 0,
  },
};

export function agentColour(palette: Palette, index: number): string {
  return palette.agents[index % palette.agents.length]!;
}
