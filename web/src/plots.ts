import type { Clock } from "./clock";
import type { Plot } from "./data";
import { el } from "./dom";
import { type Linked, Panel } from "./panel";
import type { Themes } from "./theme";

/** A grid of plots that share the cursor, what is looked at, and the part of the time that is shown. */
export class Plots implements Linked {
  readonly root: HTMLElement;
  readonly panels: Panel[];
  span: [number, number] | null = null;

  constructor(plots: Plot[], private readonly clock: Clock, private readonly themes: Themes) {
    this.root = el("div", { class: "plots" });
    this.panels = plots.map((plot) => new Panel(plot, this));
    for (const panel of this.panels) this.root.append(panel.root);
  }

  get theme() {
    return this.themes.current;
  }

  mount(): void {
    for (const panel of this.panels) panel.mount();
  }

  dispose(): void {
    for (const panel of this.panels) panel.dispose();
  }

  now(): number {
    return this.clock.t;
  }

  timeText(t: number): string {
    return `${this.clock.text(t)} ${this.clock.unit}`;
  }

  /** The clock moved. */
  moved(): void {
    for (const panel of this.panels) if (panel.plot.clock) panel.now();
  }

  seek(t: number): void {
    this.clock.pause();
    this.clock.seek(t);
  }

  hover(x: number | null): void {
    for (const panel of this.panels) if (panel.plot.clock) panel.hover(x);
  }

  zoom(span: [number, number] | null): void {
    this.span = span;
    for (const panel of this.panels) if (panel.plot.clock) panel.redraw();
  }

  looked(from: Panel): void {
    for (const panel of this.panels) if (panel !== from && panel.like(from)) panel.show(from.alone, from.focus);
  }

  paper(on: boolean): void {
    for (const panel of this.panels) panel.paper(on);
  }

  redraw(): void {
    for (const panel of this.panels) panel.redraw();
  }
}
