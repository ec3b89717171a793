/** The keyboard: what each key does. */

export interface KeyActions {
  agent(number: number): void;
  follow(): void;
  orbit(): void;
  top(): void;
  side(): void;
  recall(): void;
  colour(): void;
  module(): void;
  play(): void;
  step(seconds: number): void;
  live(): void;
  theme(): void;
  release(): void;
  help(): void;
}

/** Keys, what they do, and how they are told. */
export const SHORTCUTS: [string, string][] = [
  ["1 to 9", "choose an agent"],
  ["F", "follow the chosen agent"],
  ["O  T  S", "orbit, top and side view"],
  ["R", "recall: then click a position"],
  ["C", "colour places by strength or age"],
  ["G", "next grid module's firing fields"],
  ["space", "play the past, or stop"],
  ["← →", "a second back or on; with shift ten"],
  ["L", "back to now"],
  ["D", "dark or light"],
  ["Esc", "let go of what is chosen"],
  ["?", "this list"],
];

/** Follows the keyboard, except where somebody types. */
export function followKeys(actions: KeyActions): void {
  const keys: Record<string, () => void> = {
    f: actions.follow,
    o: actions.orbit,
    t: actions.top,
    s: actions.side,
    r: actions.recall,
    c: actions.colour,
    g: actions.module,
    l: actions.live,
    d: actions.theme,
    " ": actions.play,
    Escape: actions.release,
    "?": actions.help,
  };
  window.addEventListener("keydown", (event) => {
    const target = event.target as HTMLElement;
    const isTyping = target.matches("input:not([type=range]), select");
    const isPressing = event.key === " " && target.matches("button");
    // A dialog that is open takes Escape itself.
    const isAsked = event.key === "Escape" && document.querySelector("dialog[open]") !== null;
    if (isTyping || isPressing || isAsked || event.ctrlKey || event.metaKey || event.altKey) {
      return;
    }
    const seconds = event.shiftKey ? 10 : 1;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const number = Number(key);
    if (number >= 1 && number <= 9) {
      actions.agent(number);
    } else if (key === "ArrowLeft" || key === "ArrowRight") {
      event.preventDefault();
      actions.step(key === "ArrowLeft" ? -seconds : seconds);
    } else if (keys[key] !== undefined) {
      event.preventDefault();
      keys[key]();
    }
  });
}
