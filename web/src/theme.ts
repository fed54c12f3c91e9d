import type { Theme } from "./palette";

const KEY = "spacearm-theme";

/** Light or dark: as the reader's system says, until a button is pressed; what was pressed holds for the session. */
export class Themes {
  current: Theme;
  private readonly system = window.matchMedia("(prefers-color-scheme: dark)");
  private readonly listeners: ((theme: Theme) => void)[] = [];

  constructor() {
    const kept = remembered();
    this.current = kept ?? (this.system.matches ? "dark" : "light");
    this.apply();
    this.system.addEventListener?.("change", () => {
      if (!remembered()) this.set(this.system.matches ? "dark" : "light", false);
    });
  }

  set(theme: Theme, remember = true): void {
    this.current = theme;
    if (remember) keep(theme);
    this.apply();
    for (const listener of this.listeners) listener(theme);
  }

  swap(): void {
    this.set(this.current === "dark" ? "light" : "dark");
  }

  follow(listener: (theme: Theme) => void): void {
    this.listeners.push(listener);
  }

  private apply(): void {
    document.documentElement.dataset.theme = this.current;
    read.clear();
  }
}

const read = new Map<string, string>(); // of the current theme

/** A colour of the page's style sheet. */
export function styled(name: string): string {
  let color = read.get(name);
  if (color === undefined) read.set(name, (color = getComputedStyle(document.documentElement).getPropertyValue(name).trim()));
  return color;
}

// A page in a frame of a notebook, or from a disk, may have no storage: then nothing is remembered.
function remembered(): Theme | null {
  try {
    const kept = sessionStorage.getItem(KEY);
    return kept === "dark" || kept === "light" ? kept : null;
  } catch {
    return null;
  }
}

function keep(theme: Theme): void {
  try {
    sessionStorage.setItem(KEY, theme);
  } catch {
    // not remembered
  }
}
