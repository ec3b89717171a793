/** The bearer token: it lives as long as the tab, and goes nowhere but into the header. */

const KEY = "cogmap-token";

export const token = {
  get(): string | null {
    return sessionStorage.getItem(KEY);
  },
  set(text: string): void {
    sessionStorage.setItem(KEY, text);
  },
  forget(): void {
    sessionStorage.removeItem(KEY);
  },
};
