import uPlot from "uplot";
import { Curves, airy, airyLog, logTicks } from "./curves";
import type { Plot } from "./data";
import { button, decimalsOf, el, fixed, icon, significant, withUnit } from "./dom";
import { type Theme, SIGNALS, toneColor } from "./palette";
import { across, within } from "./rules";
import { styled } from "./theme";

/** What panels of a view have in common: where the clock is, what the pointer is over, which part of the time is shown. */
export interface Linked {
  readonly theme: Theme;
  readonly span: [number, number] | null; // of the clock; null: all of it
  now(): number;
  timeText(t: number): string;
  seek(t: number): void;
  hover(x: number | null): void;
  zoom(span: [number, number] | null): void;
  /** Tells the panels of the same series which of them are looked at. */
  looked(from: Panel): void;
}

const FONT = "11px system-ui, sans-serif";
const TONES = 8; // colours; a curve with one that is used again is drawn in long dashes
const PAPER = { width: 420, height: 190 };
const NEAR = 14; // [px] within which a curve is looked at

/** A plot: title, values at the cursor, curves, legend. */
export class Panel {
  readonly root: HTMLElement;
  readonly curves: Curves;
  /** Which series are shown alone (empty: all), and which one the pointer is at. */
  alone = new Set<number>();
  focus: number | null = null;
  private u!: uPlot;
  private readonly box = el("div", { class: "chart" });
  private readonly line = el("div", { class: "line at", hidden: true });
  private readonly ghost = el("div", { class: "line hover", hidden: true });
  private readonly shade = el("div", { class: "shade", hidden: true });
  private readonly told = el("span", { class: "told" });
  private readonly values: (HTMLElement | null)[] = [];
  private readonly entries: (HTMLElement | null)[] = [];
  private readonly decimals: number;
  private hoverX: number | null = null;
  private from: number | null = null; // where a part of the time begins to be chosen

  constructor(readonly plot: Plot, private readonly linked: Linked) {
    this.curves = new Curves(plot);
    const all = this.curves.exact.flat().filter(Number.isFinite);
    const [low, high] = all.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
    this.decimals = 1 + decimalsOf(Math.max(high - low, 1e-3 * Math.max(Math.abs(high), Math.abs(low))));
    const wide = button({ class: "tool small", title: "larger, smaller", "aria-label": `larger: ${plot.title}`, "aria-pressed": "false" }, () => {
      wide.setAttribute("aria-pressed", String(this.root.classList.toggle("wide")));
    }, icon("wide"));
    const unit = withUnit("", plot.unit).trim();
    const title = el("h3", { title: plot.title }, plot.title, unit ? el("span", { class: "unit" }, ` [${unit}]`) : null);
    this.root = el(
      "figure",
      { class: "panel", "data-plot": plot.id, "aria-label": plot.title },
      el("figcaption", {}, title, this.told, wide),
      this.box,
      this.legend(),
      ...this.notes().map((note) => el("p", { class: "note" }, note)),
    );
  }

  /** Draws, once the panel is in the page; follows its size from then on. */
  mount(): void {
    this.u = new uPlot(this.options(), [this.curves.x, ...this.curves.drawn] as uPlot.AlignedData, this.box);
    this.u.over.append(this.shade, this.ghost, this.line);
    this.listen(this.u.over);
    this.observer.observe(this.box);
    this.now();
  }

  private readonly observer = new ResizeObserver(() => this.fit());

  dispose(): void {
    this.observer.disconnect();
    this.u.destroy();
  }

  /** Draws in a size for paper, or again in that of the page. */
  paper(on: boolean): void {
    if (on) this.u.setSize(PAPER);
    else this.fit(true);
  }

  private fit(anyway = false): void {
    const { clientWidth: width, clientHeight: height } = this.box;
    if (!anyway && matchMedia("print").matches) return; // paper scales what is drawn
    if (width < 40 || height < 40 || (width === this.u.width && height === this.u.height)) return;
    this.u.setSize({ width, height });
    this.place();
  }

  // ---- curves --------------------------------------------------------------------------------------------------------

  private options(): uPlot.Options {
    const { plot } = this;
    const ink = () => styled("--muted");
    const axis = { stroke: ink, font: FONT, ticks: { stroke: () => styled("--hair"), width: 1, size: 4 } };
    const grid = { stroke: () => styled("--grid"), width: 1 };
    return {
      width: Math.max(120, this.box.clientWidth),
      height: Math.max(80, this.box.clientHeight),
      legend: { show: false },
      cursor: { show: false },
      padding: [8, 20, 0, 0], // the last tick's text stands out
      scales: {
        x: { time: false, distr: plot.logX ? 3 : 1, range: () => this.xRange() },
        y: { distr: plot.log ? 3 : 1, range: (_, low, high) => this.yRange(low, high) },
      },
      axes: [
        {
          ...axis,
          grid,
          size: 22,
          gap: 3,
          space: 56,
          label: plot.xLabel,
          labelFont: FONT,
          labelSize: 15,
          labelGap: -2,
          ...(plot.logX ? { splits: (u, _, low, high) => logTicks(low, high, u.bbox.width / devicePixelRatio / 48), values: (_, ticks) => ticks.map((v) => significant(v)), filter: (_, ticks) => ticks } : { values: (_, ticks) => tickTexts(ticks) }),
        },
        {
          ...axis,
          grid,
          size: 50,
          gap: 4,
          space: 20,
          ...(plot.log ? { splits: (u, _, low, high) => logTicks(low, high, u.bbox.height / devicePixelRatio / 22), values: (_, ticks) => ticks.map((v) => significant(v)), filter: (_, ticks) => ticks } : { values: (_, ticks) => tickTexts(ticks) }),
        },
      ],
      series: [
        {},
        ...plot.series.map((series, i): uPlot.Series => ({
          label: series.label,
          stroke: () => this.color(i),
          width: series.faint ? 1 : 1.6,
          dash: series.dashed ? [6, 4] : series.tone >= TONES && !series.faint ? [14, 3] : undefined,
          points: { show: this.curves.x.length === 1 },
          paths: series.steps ? uPlot.paths.stepped!({ align: 1 }) : undefined,
          spanGaps: false,
          pxAlign: 0,
        })),
      ],
      hooks: { drawClear: [], draw: [(u) => this.paint(u)] },
    };
  }

  /** What the x axis shows: the part that was chosen, else all. */
  private xRange(): [number, number] {
    const { plot, linked } = this;
    const { x } = this.curves;
    if (plot.clock && linked.span) return linked.span;
    const [low, high] = [x[0], x[x.length - 1]];
    if (!x.length) return plot.logX ? [0.1, 10] : [0, 1];
    if (plot.logX) return high > low ? [low, high] : [low / 2, high * 2];
    return high > low ? [low, high] : [low - 0.5, high + 0.5];
  }

  private yRange(low: number, high: number): [number, number] {
    const wanted = [low, high, ...(this.plot.lines ?? []).map((line) => line.value)];
    if (this.alone.size) for (const one of this.limits(this.alone)) wanted.push(one.lower ?? NaN, one.upper ?? NaN);
    const { floor } = this.curves;
    const known = wanted.filter((v) => v !== null && Number.isFinite(v)).map((v) => (floor > 0 ? Math.max(v, floor) : v));
    if (!known.length) return floor > 0 ? [floor, 10 * floor] : [0, 1];
    const [a, b] = [Math.min(...known), Math.max(...known)];
    return floor > 0 ? airyLog(this.curves.clamped ? floor : a, b, this.curves.clamped, (this.plot.lines ?? []).length > 0) : airy(a, b);
  }

  private color(i: number): string {
    const series = this.plot.series[i];
    const color = toneColor(series.tone, this.linked.theme);
    const behind = this.focus !== null && this.focus !== i;
    return color + (series.faint ? (behind ? "22" : "66") : behind ? "38" : "");
  }

  private limits(of: Set<number>): { series: number; lower: number | null; upper: number | null }[] {
    return (this.plot.limits ?? []).filter((limit) => of.has(limit.series));
  }

  /** Lines across the plot, the floor, and the limits of what is looked at. */
  private paint(u: uPlot): void {
    const { ctx } = u;
    const ratio = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    ctx.clip();
    ctx.font = `${11 * ratio}px system-ui, sans-serif`;
    const signal = SIGNALS[this.linked.theme];
    this.paintLines(u);
    if (this.curves.clamped) across(u, u.valToPos(this.curves.floor, "y", true), styled("--muted"), [1, 4], "", false);
    const looked = this.focus !== null ? new Set([this.focus]) : this.alone;
    if (looked.size && looked.size <= 3)
      for (const { lower, upper } of this.limits(looked))
        for (const value of [lower, upper])
          if (value !== null && within(u, value)) across(u, u.valToPos(value, "y", true), signal.limit, [8, 4], "limit", value === upper);
    ctx.restore();
  }

  /** Lines across the plot; labels of lines that are near each other are written together, by the upper or the lower of them. */
  private paintLines(u: uPlot): void {
    const near = 15 * devicePixelRatio;
    const lines = [...(this.plot.lines ?? [])].sort((a, b) => b.value - a.value);
    const at = lines.map((line) => u.valToPos(this.curves.place(line.value) ?? line.value, "y", true));
    for (let i = 0; i < lines.length; ) {
      let k = i + 1;
      while (k < lines.length && at[k] - at[k - 1] < near) k++;
      const label = lines.slice(i, k).map((line) => line.label).join(" \u00b7 ");
      const low = at[k - 1] + near < u.bbox.top + u.bbox.height; // room for the label below them
      for (let j = i; j < k; j++) across(u, at[j], styled("--ink"), [2, 3], j === (low ? k - 1 : i) ? label : "", low);
      i = k;
    }
  }

  // ---- legend --------------------------------------------------------------------------------------------------------

  private legend(): HTMLElement {
    const { series } = this.plot;
    const longest = Math.max(0, ...series.map((one) => one.label.length));
    const list = el("div", { class: "legend", role: "group", "aria-label": "curves", style: `--width: ${Math.round(6 * longest + 74)}px` });
    const faint = series.filter((one) => one.faint);
    series.forEach((one, i) => {
      this.values.push(null);
      this.entries.push(null);
      if (one.faint && faint.length > 3) return;
      const value = (this.values[i] = el("span", { class: "value" }));
      const entry = (this.entries[i] = el(
        "button",
        {
          type: "button",
          "aria-pressed": "false",
          title: `${one.label}: press to see it alone, with Shift or Ctrl to add or take away`,
          click: (event: MouseEvent) => this.isolate(i, event.shiftKey || event.ctrlKey || event.metaKey),
          pointerenter: () => this.look(i),
          pointerleave: () => this.look(null),
          focus: (event: FocusEvent) => (event.target as HTMLElement).matches(":focus-visible") && this.look(i),
          blur: () => this.look(null),
        },
        el("i", { class: `swatch${one.dashed ? " dashed" : one.tone >= TONES ? " again" : ""}` }),
        el("span", { class: "label" }, one.label),
        value,
      ));
      list.append(entry);
    });
    if (faint.length > 3) list.append(el("span", { class: "rest" }, `${faint.length} faint lines: ${faint[0].label} \u2026 ${faint[faint.length - 1].label}`));
    this.paintLegend(list);
    return list;
  }

  private paintLegend(list: ParentNode = this.root): void {
    const swatches = list.querySelectorAll<HTMLElement>(".swatch");
    let k = 0;
    this.entries.forEach((entry, i) => {
      if (!entry) return;
      swatches[k++].style.color = toneColor(this.plot.series[i].tone, this.linked.theme);
      entry.classList.toggle("off", this.alone.size > 0 && !this.alone.has(i));
      entry.classList.toggle("seen", this.focus === i);
      entry.setAttribute("aria-pressed", String(this.alone.has(i)));
    });
  }

  isolate(i: number, more: boolean): void {
    const alone = new Set(this.alone);
    if (more) alone.has(i) ? alone.delete(i) : alone.add(i);
    else if (alone.size === 1 && alone.has(i)) alone.clear();
    else {
      alone.clear();
      alone.add(i);
    }
    if (alone.size === this.plot.series.length) alone.clear();
    this.show(alone, this.focus);
    this.linked.looked(this);
  }

  private look(i: number | null): void {
    if (i === this.focus) return;
    this.show(this.alone, i);
    this.linked.looked(this);
  }

  /** Shows some series alone (none: all), and one as looked at. */
  show(alone: Set<number>, focus: number | null): void {
    const same = alone.size === this.alone.size && [...alone].every((i) => this.alone.has(i));
    this.alone = new Set(alone);
    this.focus = focus;
    this.paintLegend();
    this.tell();
    if (!same)
      this.u.batch(() => this.plot.series.forEach((_, i) => this.u.setSeries(i + 1, { show: !alone.size || alone.has(i) })));
    this.u.redraw(false, false);
  }

  /** Whether another plot has the same series: then they are looked at together. */
  like(other: Panel): boolean {
    const { series } = this.plot;
    return series.length === other.plot.series.length && series.every((one, i) => one.label === other.plot.series[i].label);
  }

  private notes(): string[] {
    const { plot, curves } = this;
    const own = plot.note ? [plot.note] : [];
    const said = plot.note !== undefined && /floor|drawn (at|there)/.test(plot.note);
    return curves.clamped && !said ? [...own, `Values below ${significant(curves.floor)} are drawn there.`] : own;
  }

  // ---- cursor --------------------------------------------------------------------------------------------------------

  now(): void {
    this.place();
    if (this.hoverX === null) this.read();
  }

  hover(x: number | null): void {
    if (this.hoverX === null && x === null) return;
    this.hoverX = x;
    this.place();
    this.read();
  }

  private place(): void {
    if (this.plot.clock) this.put(this.line, this.linked.now());
    this.put(this.ghost, this.hoverX);
  }

  private put(line: HTMLElement, x: number | null): void {
    const at = x === null ? NaN : this.u.valToPos(x, "x");
    line.hidden = !(at >= -0.5 && at <= this.u.over.clientWidth + 0.5);
    if (!line.hidden) line.style.transform = `translateX(${at}px)`;
  }

  /** Writes the values at the cursor: where the pointer is, else where the clock is. */
  private read(): void {
    const x = this.hoverX ?? (this.plot.clock ? this.linked.now() : null);
    this.values.forEach((value, i) => {
      if (!value) return;
      const text = x === null ? "" : this.written(this.curves.at(i, x));
      if (value.textContent !== text) value.textContent = text;
    });
    this.tell();
  }

  private written(value: number): string {
    return this.plot.log || this.decimals > 6 ? significant(value, 3, false) : fixed(value, this.decimals);
  }

  private tell(): void {
    let text = "";
    if (this.hoverX !== null) text = this.plot.clock ? this.linked.timeText(this.hoverX) : significant(this.hoverX, 4);
    const limit = this.focus === null ? undefined : this.limits(new Set([this.focus]))[0];
    if (limit) text += `${text ? " \u00b7 " : ""}${limitText(limit, this.plot.unit)}`;
    if (this.told.textContent !== text) this.told.textContent = text;
  }

  private listen(over: HTMLElement): void {
    const x = (event: PointerEvent | MouseEvent) => this.u.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
    const { clock } = this.plot;
    over.addEventListener("pointerdown", (event) => {
      if (!clock || event.button !== 0) return;
      over.setPointerCapture(event.pointerId);
      if (event.shiftKey) this.from = x(event);
      else this.linked.seek(x(event));
    });
    over.addEventListener("pointermove", (event) => {
      if (clock) this.linked.hover(x(event));
      else this.hover(x(event));
      if (this.from !== null) this.mark(this.from, x(event));
      else if (clock && event.buttons & 1) this.linked.seek(x(event));
      else this.look(this.nearest(event, over));
    });
    over.addEventListener("pointerup", (event) => {
      if (this.from === null) return;
      const [low, high] = [this.from, x(event)].sort((a, b) => a - b);
      this.from = null;
      this.shade.hidden = true;
      const { left, width } = over.getBoundingClientRect();
      if (Math.abs(this.u.valToPos(low, "x") - this.u.valToPos(high, "x")) > 6 && left <= event.clientX + 1 && width > 0)
        this.linked.zoom([low, high]);
    });
    over.addEventListener("pointerleave", () => {
      if (clock) this.linked.hover(null);
      else this.hover(null);
      this.look(null);
    });
    over.addEventListener("dblclick", () => clock && this.linked.zoom(null));
  }

  private mark(from: number, to: number): void {
    const [a, b] = [this.u.valToPos(from, "x"), this.u.valToPos(to, "x")].sort((p, q) => p - q);
    this.shade.hidden = false;
    this.shade.style.left = `${a}px`;
    this.shade.style.width = `${b - a}px`;
  }

  private nearest(event: PointerEvent, over: HTMLElement): number | null {
    const { left, top } = over.getBoundingClientRect();
    const x = this.u.posToVal(event.clientX - left, "x");
    let [best, found]: [number, number | null] = [NEAR, null];
    this.plot.series.forEach((series, i) => {
      if (series.faint || (this.alone.size && !this.alone.has(i))) return;
      const value = this.curves.place(this.curves.at(i, x));
      const away = value === null ? Infinity : Math.abs(this.u.valToPos(value, "y") - (event.clientY - top));
      if (away < best) [best, found] = [away, i];
    });
    return found;
  }

  /** Another theme, or another part of the time. */
  redraw(): void {
    this.paintLegend();
    const [min, max] = this.xRange();
    this.u.setScale("x", { min, max });
    this.u.redraw(false, true);
    this.place();
  }
}

function tickTexts(ticks: number[]): string[] {
  const step = ticks.length > 1 ? Math.abs(ticks[1] - ticks[0]) : 1;
  const size = Math.max(...ticks.map(Math.abs));
  if (size >= 1e5 || (size > 0 && size < 1e-3)) return ticks.map((tick) => significant(tick, 3));
  let decimals = 0;
  while (decimals < 9 && Math.abs(step * 10 ** decimals - Math.round(step * 10 ** decimals)) > 1e-6 * step * 10 ** decimals) decimals++;
  return ticks.map((tick) => fixed(tick, decimals));
}

function limitText(limit: { lower: number | null; upper: number | null }, unit: string): string {
  const { lower, upper } = limit;
  if (lower === null && upper === null) return "no limit";
  if (lower !== null && upper !== null && lower === -upper) return `limit \u00b1${withUnit(significant(upper, 4), unit)}`;
  if (lower === null) return `limit \u2264 ${withUnit(significant(upper!, 4), unit)}`;
  if (upper === null) return `limit \u2265 ${withUnit(significant(lower, 4), unit)}`;
  return `limits ${significant(lower, 4)} \u2026 ${withUnit(significant(upper, 4), unit)}`;
}
