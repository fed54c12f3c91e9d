import type { Clock } from "./clock";
import type { Section } from "./data";
import { button, el, icon } from "./dom";
import { Plots } from "./plots";
import type { Themes } from "./theme";

/** Parts below the picture that fold: names and texts, notes, a table, commands, plots. */
export class Sections {
  readonly root = el("div", { class: "sections" });
  private readonly waiting = new Map<HTMLDetailsElement, Plots>();
  private readonly shown: Plots[] = [];

  constructor(sections: Section[], private readonly clock: Clock, private readonly themes: Themes) {
    for (const section of sections) this.root.append(this.part(section));
  }

  private part(section: Section): HTMLElement {
    const body = el("div", { class: "body" });
    if (section.rows?.length) body.append(rows(section.rows));
    if (section.notes?.length) body.append(notes(section.notes));
    if (section.table) body.append(table(section.table));
    if (section.code) body.append(code(section.code));
    const details = el("details", { class: "section" }, el("summary", {}, el("h2", {}, section.title), count(section)), body);
    if (section.plots?.length) {
      const plots = new Plots(section.plots, this.clock, this.themes);
      body.append(plots.root);
      this.waiting.set(details, plots);
      details.addEventListener("toggle", () => details.open && this.mount(details));
    }
    details.open = section.open;
    return details;
  }

  /** Draws the plots of parts that are open; those of the others when they are opened. */
  begin(): void {
    for (const details of [...this.waiting.keys()]) if (details.open) this.mount(details);
  }

  private mount(details: HTMLDetailsElement): void {
    const plots = this.waiting.get(details);
    if (!plots || !details.isConnected) return;
    this.waiting.delete(details);
    plots.mount();
    this.shown.push(plots);
  }

  /** Opens all parts (for paper); returns what closes those again that were closed. */
  openAll(): () => void {
    const closed = [...this.root.querySelectorAll<HTMLDetailsElement>("details:not([open])")];
    for (const details of closed) {
      details.open = true;
      this.mount(details);
    }
    return () => closed.forEach((details) => (details.open = false));
  }

  moved(): void {
    for (const plots of this.shown) plots.moved();
  }

  paper(on: boolean): void {
    for (const plots of this.shown) plots.paper(on);
  }

  redraw(): void {
    for (const plots of this.shown) plots.redraw();
  }

  dispose(): void {
    for (const plots of this.shown) plots.dispose();
  }
}

function count(section: Section): HTMLElement | null {
  const lines = section.table?.rows.length ?? 0;
  return lines > 3 ? el("span", { class: "count" }, String(lines)) : null;
}

function rows(pairs: [string, string][]): HTMLElement {
  return el("dl", { class: "rows" }, ...pairs.map(([name, text]) => el("div", {}, el("dt", {}, name), el("dd", {}, text))));
}

function notes(texts: string[]): HTMLElement {
  return el("ul", { class: "notes" }, ...texts.map((text) => el("li", {}, text)));
}

const NUMBER = /^\s*[+\-\u2212\u00b1<>\u2264\u2265~]?\s*[\d.,]+(e[+\-\u2212]?\d+)?\s*(%|[a-z\u00b5/\u00b0\u00b2]{0,6})?\s*$/i;

function table(given: { header: string[]; rows: string[][] }): HTMLElement {
  const numbers = given.header.map((_, k) => given.rows.length > 0 && given.rows.every((row) => !row[k] || /^[\u2013\-]$/.test(row[k]) || NUMBER.test(row[k])));
  const side = (k: number) => ({ class: numbers[k] ? "number" : null });
  const made = el(
    "table",
    {},
    el("thead", {}, el("tr", {}, ...given.header.map((text, k) => el("th", { scope: "col", ...side(k) }, text)))),
    el("tbody", {}, ...given.rows.map((row) => el("tr", {}, ...row.map((text, k) => el("td", side(k), text))))),
  );
  return el("div", { class: "table", tabindex: given.rows.length > 12 ? 0 : null, role: "region", "aria-label": "table" }, made);
}

function code(text: string): HTMLElement {
  const pre = el("pre", {}, el("code", {}, text));
  const copy = button({ class: "tool small copy", title: "copy", "aria-label": "copy the command" }, () => {
    void copied(text, pre).then((done) => {
      copy.dataset.said = done ? "copied" : "press Ctrl C";
      setTimeout(() => delete copy.dataset.said, 1600);
    });
  }, icon("copy"));
  return el("div", { class: "code" }, pre, copy);
}

// A page from a disk or in a frame may not be allowed to use the clipboard: then the text is selected at least.
async function copied(text: string, shown: HTMLElement): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    getSelection()?.selectAllChildren(shown);
    try {
      return document.execCommand("copy");
    } catch {
      return false;
    }
  }
}
