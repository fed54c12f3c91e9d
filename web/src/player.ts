import type { Clock } from "./clock";
import { button, el, icon } from "./dom";

/** The slider of the clock, play and pause, steps, speed. */
export class Player {
  readonly root: HTMLElement;
  private readonly slider: HTMLInputElement;
  private readonly what = el("span", { class: "end" }); // what a clock counts
  private readonly now = el("span", { class: "now" });
  private readonly end = el("span", { class: "end" });
  private readonly playing: HTMLButtonElement;
  private readonly repeat: HTMLButtonElement;
  private readonly speed: HTMLSelectElement;
  private readonly least: HTMLButtonElement;
  private readonly mark = el("span", { class: "mark", hidden: true });
  private leastAt: number | null = null;

  constructor(private readonly clock: Clock) {
    this.slider = el("input", {
      type: "range",
      min: 0,
      step: "any",
      "aria-label": "time",
      input: () => {
        clock.pause();
        clock.seek(Number(this.slider.value));
      },
    });
    this.playing = button({ class: "tool play", title: "play, pause (space)", "aria-label": "play" }, () => clock.toggle(), icon("play"));
    const back = button({ class: "tool", title: "step back (\u2190)", "aria-label": "step back" }, () => clock.step(-1), icon("back"));
    const ahead = button({ class: "tool", title: "step ahead (\u2192)", "aria-label": "step ahead" }, () => clock.step(1), icon("ahead"));
    this.repeat = button({ class: "tool", title: "repeat (o)", "aria-label": "repeat" }, () => clock.setRepeat(!clock.repeat), icon("repeat"));
    this.least = button(
      { class: "tool", title: "go to the least clearance (m)", "aria-label": "go to the least clearance" },
      () => this.toLeast(),
      icon("least"),
    );
    this.speed = el("select", {
      "aria-label": "speed",
      title: "speed (, slower . faster)",
      change: () => {
        clock.setSpeed(Number(this.speed.value));
        this.speed.blur();
      },
    });
    this.root = el(
      "div",
      { class: "player", role: "group", "aria-label": "time" },
      el("div", { class: "buttons" }, back, this.playing, ahead),
      el("div", { class: "track" }, this.slider, this.mark),
      el("output", { class: "time" }, this.what, this.now, this.end),
      el("div", { class: "buttons" }, this.least, this.repeat, this.speed),
    );
  }

  /** A view's clock begins: its duration, and the instant of the least clearance, if there is one. */
  begin(leastAt: number | null): void {
    const { clock } = this;
    this.root.hidden = clock.duration <= 0;
    this.slider.max = String(clock.duration);
    this.what.textContent = clock.whole ? `${clock.unit} ` : "";
    this.end.textContent = ` / ${clock.text(clock.duration)}${clock.whole ? "" : ` ${clock.unit}`}`;
    this.now.style.minWidth = `${clock.text(clock.duration).length}ch`;
    this.speed.replaceChildren(...clock.speeds.map((speed) => el("option", { value: speed }, `${speed}\u00d7`)));
    this.leastAt = leastAt;
    this.least.hidden = this.mark.hidden = leastAt === null;
    this.mark.style.setProperty("--at", String(clock.duration > 0 && leastAt !== null ? leastAt / clock.duration : 0));
    this.state();
    this.seek(clock.t);
  }

  toLeast(): void {
    if (this.leastAt === null) return;
    this.clock.pause();
    this.clock.seek(this.leastAt);
  }

  seek(t: number): void {
    this.slider.value = String(t);
    this.slider.style.setProperty("--share", String(this.clock.duration > 0 ? t / this.clock.duration : 0));
    const text = this.clock.text(t);
    this.slider.setAttribute("aria-valuetext", `${text} ${this.clock.unit}`);
    this.now.textContent = text;
  }

  state(): void {
    const { clock } = this;
    this.playing.replaceChildren(icon(clock.playing ? "pause" : "play"));
    this.playing.setAttribute("aria-label", clock.playing ? "pause" : "play");
    this.repeat.setAttribute("aria-pressed", String(clock.repeat));
    this.speed.value = String(clock.speed);
  }
}
