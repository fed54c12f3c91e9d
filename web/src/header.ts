import type { Page, View } from "./data";
import { button, el, icon } from "./dom";

const SIGNS = { good: "\u2713", bad: "\u2715", plain: "\u2022" };
const TABS = 150; // letters of the views' names that make tabs; of more, a list

/** The title block, the verdict, and the choice of the view. */
export class Header {
  readonly root: HTMLElement;
  readonly block: HTMLElement;
  readonly views: HTMLElement;
  private readonly verdict = el("div", { class: "verdict", role: "status" });
  private readonly choose: (i: number) => void;

  constructor(page: Page, choose: (i: number) => void, tools: { theme: () => void; help: () => void; print: () => void }) {
    this.choose = choose;
    this.root = el(
      "header",
      { class: "top" },
      el(
        "div",
        { class: "title" },
        el(
          "div",
          { class: "name" },
          el("h1", {}, page.title),
          el(
            "div",
            { class: "tools" },
            button({ class: "tool", title: "light, dark (l)", "aria-label": "light or dark" }, tools.theme, icon("theme")),
            button({ class: "tool", title: "print", "aria-label": "print" }, tools.print, icon("print")),
            button({ class: "tool", title: "keys (?)", "aria-label": "help" }, tools.help, "?"),
          ),
        ),
        this.verdict,
      ),
    );
    const columns = Math.ceil(page.block.length / (page.block.length > 14 ? 3 : 2));
    this.block = el("dl", { class: "block", "aria-label": "title block", style: `--columns: ${columns}` });
    for (const [label, value] of page.block) this.block.append(el("div", { class: "cell" }, el("dt", {}, label), el("dd", {}, value)));
    if (page.block.length) this.root.append(this.block);
    this.views = el("nav", { class: "views", "aria-label": "views", hidden: page.views.length < 2 });
    if (page.views.length > 1) this.fill(page.views);
  }

  private fill(views: View[]): void {
    if (views.reduce((letters, view) => letters + view.name.length + 4, 0) > TABS) {
      const list = el(
        "select",
        { "aria-label": "view", change: () => this.choose(Number(list.value)) },
        ...views.map((view, i) => el("option", { value: i }, `${SIGNS[view.verdict.tone]} ${view.name}`)),
      );
      this.views.append(el("span", { class: "label" }, "View"), list);
      return;
    }
    this.views.append(
      ...views.map((view, i) =>
        button({ class: `tab ${view.verdict.tone}` }, () => this.choose(i), el("span", { class: "sign" }, SIGNS[view.verdict.tone]), view.name),
      ),
    );
  }

  show(view: View, i: number): void {
    const { tone, headline, text } = view.verdict;
    this.verdict.replaceChildren(
      el("strong", { class: `chip ${tone}` }, el("span", { class: "sign", "aria-hidden": "true" }, SIGNS[tone]), headline),
      el("span", { class: "text" }, text),
    );
    this.views.querySelectorAll(".tab").forEach((tab, k) => tab.setAttribute("aria-current", String(k === i)));
    const list = this.views.querySelector("select");
    if (list) list.value = String(i);
  }
}
