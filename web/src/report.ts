import { Clock } from "./clock";
import type { Closest, Page } from "./data";
import { el } from "./dom";
import { Header } from "./header";
import { Keys } from "./keys";
import { Motion, unpack } from "./kinematics";
import { Player } from "./player";
import { Plots } from "./plots";
import { ScenePane } from "./scenepane";
import { Sections } from "./sections";
import type { Stage } from "./stage";
import { Themes } from "./theme";

const VERSION = 1;

/** What tests, notebooks and makers of films use. */
export interface Handle {
  page: Page | null;
  stage: Stage | null;
  ready: Promise<void>;
  seek(t: number): void;
  tip(actor: number, t: number): number[]; // T_world_tip, 16 numbers, column-major
  view(i: number): void;
}

declare global {
  interface Window {
    spacearm: Handle;
  }
}

/** The report: header, picture with player and switches, plots, sections. */
class Report {
  readonly clock: Clock;
  readonly scene: ScenePane;
  private readonly themes = new Themes();
  private readonly header: Header;
  private readonly player: Player;
  private readonly left: HTMLElement;
  private readonly right = el("div", { class: "right" });
  private readonly instant = el("p", { class: "instant" }); // on paper: of what time the picture and the values are
  private readonly whole: Sections;
  private plots: Plots | null = null;
  private sections: Sections | null = null;
  private motions: Motion[] = [];
  private at = -1;

  constructor(readonly page: Page, app: HTMLElement) {
    this.clock = new Clock(
      (t) => this.moved(t),
      () => this.player.state(),
    );
    this.player = new Player(this.clock);
    this.scene = new ScenePane(page, this.themes);
    const theme = () => this.themes.swap();
    const keys = new Keys(
      { clock: this.clock, player: this.player, scene: this.scene, theme, other: (by) => this.show((this.at + by + page.views.length) % page.views.length) },
      page.views.length > 1,
    );
    this.header = new Header(page, (i) => this.show(i), { theme, help: () => keys.swap(), print: () => window.print() });
    const bar = el("div", { class: "bar" }, this.scene.switches, this.scene.looks);
    this.left = el("div", { class: "left" }, this.scene.root, this.instant, this.player.root, bar);
    this.whole = new Sections(page.sections, this.clock, this.themes);
    const foot = el("footer", {}, "Made by spacearm; the page needs no network. Keys: ?");
    const desk = el("div", { class: "desk" }, this.left, this.right);
    app.replaceChildren(this.header.root, this.header.views, desk, foot, keys.help);
    const above = new ResizeObserver(() => desk.style.setProperty("--above", `${desk.offsetTop}px`)); // the picture fits below
    for (const part of [this.header.root, this.header.views]) above.observe(part);
    this.left.classList.toggle("bare", !this.scene.stage);
    this.themes.follow(() => this.redraw());
    this.printing();
  }

  show(i: number): void {
    const view = this.page.views[i];
    if (!view || i === this.at) return;
    this.at = i;
    this.plots?.dispose();
    this.sections?.dispose();
    this.motions = view.actors.map((actor) => new Motion(this.page.robots[actor.robot], actor.knots));
    this.header.show(view, i);
    this.plots = new Plots(view.plots, this.clock, this.themes);
    this.sections = new Sections(view.sections, this.clock, this.themes);
    this.right.replaceChildren(this.plots.root, this.sections.root, this.whole.root);
    const scene = view.actors.length + view.obstacles.length > 0 || view.cloud !== undefined;
    this.left.hidden = !scene && view.clock.duration <= 0;
    this.scene.root.hidden = this.scene.switches.hidden = this.scene.looks.hidden = !scene;
    document.body.classList.toggle("flat", !scene);
    this.scene.show(view);
    this.plots.mount();
    this.sections.begin();
    this.whole.begin();
    this.clock.begin(view.clock);
    this.player.begin(view.closest ? leastOf(view.closest) : null);
  }

  tip(actor: number, t: number): number[] {
    return this.scene.stage ? this.scene.stage.tip(actor, t) : Array.from(this.motions[actor].tip(t));
  }

  private moved(t: number): void {
    this.player.seek(t);
    this.scene.seek(t);
    this.plots?.moved();
    this.sections?.moved();
    this.whole.moved();
  }

  private redraw(): void {
    this.plots?.redraw();
    this.sections?.redraw();
    this.whole.redraw();
  }

  /** Paper: light, everything open, the picture as a still. */
  private printing(): void {
    let back = () => {};
    window.addEventListener("beforeprint", () => {
      const theme = this.themes.current;
      this.themes.set("light", false);
      const closers = [this.sections?.openAll(), this.whole.openAll()];
      const drawn = [this.plots, this.sections, this.whole];
      for (const part of drawn) part?.paper(true);
      this.scene.keepStill();
      const { clock } = this;
      this.instant.textContent = clock.duration > 0 ? `The picture, and the values beside the labels, at ${clock.text(clock.t)} ${clock.unit}.` : "";
      back = () => {
        for (const part of drawn) part?.paper(false);
        for (const close of closers) close?.();
        this.themes.set(theme, false);
      };
    });
    window.addEventListener("afterprint", () => back());
  }
}

function leastOf(closest: Closest): number | null {
  const [t, distance] = [unpack(closest.t), unpack(closest.distance)];
  let best = -1;
  for (let i = 0; i < t.length; i++) if (best < 0 || distance[i] < distance[best]) best = i;
  return best < 0 ? null : t[best];
}

async function unpacked(packed: string): Promise<Page> {
  if (typeof DecompressionStream === "undefined")
    throw new Error(
      "This browser is too old to unpack the report: it has no DecompressionStream. Chrome and Edge have it from version 80 on, Firefox from 113 and Safari from 16.4.",
    );
  let page: Page;
  try {
    const bytes = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
    page = (await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).json()) as Page;
  } catch (error) {
    throw new Error(`The data of this report cannot be read; the file may have been cut short. Make it again. (${error})`);
  }
  if (page["spacearm-report"] !== VERSION)
    throw new Error(`The data of this report are of version ${page["spacearm-report"]}, its program reads version ${VERSION}. Make it again.`);
  return page;
}

/** What the address asks for, as in report.html#view=2&t=3.5. */
function asked(first: number): { view: number; t: number | null } {
  const given = new URLSearchParams(location.hash.slice(1));
  const t = given.get("t");
  return { view: Math.max(1, Number(given.get("view")) || first + 1) - 1, t: t === null ? null : Number(t) };
}

async function main(): Promise<void> {
  const app = document.getElementById("app")!;
  try {
    const page = await unpacked(document.getElementById("data")!.textContent!.trim());
    document.title = page.title;
    const report = new Report(page, app);
    const { view, t } = asked(page.open ?? 0);
    report.show(Math.min(view, page.views.length - 1));
    if (t !== null) report.clock.seek(t);
    Object.assign(window.spacearm, {
      page,
      stage: report.scene.stage,
      seek: (at: number) => (report.clock.pause(), report.clock.seek(at)),
      tip: (actor: number, at: number) => report.tip(actor, at),
      view: (i: number) => report.show(i),
    });
  } catch (error) {
    app.replaceChildren(el("p", { class: "broken", role: "alert" }, error instanceof Error ? error.message : String(error)));
    throw error;
  }
}

const early = () => {
  throw new Error("the report is not ready yet; wait for spacearm.ready");
};
window.spacearm = { page: null, stage: null, ready: Promise.resolve(), seek: early, tip: early, view: early };
window.spacearm.ready = main();
window.spacearm.ready.catch(() => {}); // the page says it
