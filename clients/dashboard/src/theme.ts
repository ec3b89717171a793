/** Dark or light: as the system has it, until somebody chooses. */

import { PALETTES, type Palette, type Shade } from "./scene/palette";

const KEY = "cogmap-theme";

export class Theme {
  private readonly preferred = window.matchMedia("(prefers-color-scheme: light)");

  constructor(private readonly changed: (palette: Palette) => void) {
    this.preferred.addEventListener("change", () => this.apply());
    this.apply();
  }

  get shade(): Shade {
    const chosen = localStorage.getItem(KEY);
    if (chosen === "dark" || chosen === "light") {
      return chosen;
    }
    return this.preferred.matches ? "light" : "dark";
  }

  toggle(): void {
    localStorage.setItem(KEY, this.shade === "dark" ? "light" : "dark");
    this.apply();
  }

  private apply(): void {
    document.documentElement.dataset["theme"] = this.shade;
    this.changed(PALETTES[this.shade]);
  }
}
