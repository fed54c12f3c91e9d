import type { Page, View } from "./data";
import { button, el, fixed } from "./dom";
import { toneColor } from "./palette";
import { Stage, type Toggle, type Viewpoint } from "./stage";
import type { Themes } from "./theme";

/** Switches of the picture: what they are called, their key, and what they do. */
export const TOGGLES: [Toggle, string, string, string][] = [
  ["visuals", "visuals", "v", "what the robot's file draws"],
  ["shapes", "collision shapes", "c", "the shapes that are kept clear"],
  ["path", "tool path", "p", "the path of the end effector"],
  ["basePath", "base path", "b", "the path of the base"],
  ["axes", "tool axes", "a", "the axes of the end effector: x, y, z"],
  ["names", "names", "n", "names of links and obstacles"],
  ["closest", "closest pair", "d", "the closest pair at this instant, and its distance"],
  ["ghosts", "ghosts", "g", "the other motions, and the ends of this one"],
  ["targets", "start and goal", "t", "where the motion begins and is to end"],
  ["cloud", "particles", "w", "the particles of the swarm"],
  ["grid", "grid", "r", "the ground grid, in metres"],
];

export const VIEWPOINTS: [Viewpoint, string, string][] = [
  ["corner", "1", "from a corner"],
  ["front", "2", "from the front, along x"],
  ["side", "3", "from the side, along y"],
  ["top", "4", "from above, along z"],
  ["tool", "5", "riding with the end effector"],
];

const PAPER = [690, 520]; // [px] of the picture on paper, at most
const WITHOUT = "The 3-D picture needs WebGL 2, which this browser does not offer here. The plots and tables are complete without it.";

/** The 3-D picture with its switches; without WebGL a sentence. */
export class ScenePane {
  readonly root: HTMLElement;
  readonly picture: HTMLElement;
  readonly switches = el("div", { class: "switches" });
  readonly looks = el("div", { class: "looks", role: "group", "aria-label": "viewpoint" });
  readonly stage: Stage | null;
  private readonly canvas = el("canvas", { tabindex: 0, role: "img", "aria-label": "3-D picture; drag to turn, wheel to come closer" });
  private readonly still = el("img", { class: "still", alt: "the 3-D picture" });
  private readonly legend = el("ul", { class: "actors" });
  private readonly near = el("p", { class: "near", hidden: true });
  private readonly chips = new Map<Toggle, HTMLButtonElement>();
  private nearText = "";

  constructor(page: Page, themes: Themes) {
    this.picture = el("div", { class: "picture" }, this.canvas, this.still, el("div", { class: "corner" }, this.legend, this.near));
    this.root = el("div", { class: "scene" }, this.picture);
    this.stage = this.begun(page, themes);
    if (!this.stage) {
      this.picture.replaceChildren(el("p", { class: "without", role: "note" }, WITHOUT));
      this.picture.classList.add("empty");
      return;
    }
    for (const [key, name, letter, about] of TOGGLES) {
      const chip = button({ class: "switch", "aria-pressed": "false", title: `${about} (${letter})`, "data-toggle": key }, () => this.toggle(key), name);
      this.chips.set(key, chip);
      this.switches.append(chip);
    }
    for (const [from, digit, about] of VIEWPOINTS)
      this.looks.append(button({ class: "look", title: `${about} (${digit})`, "data-look": from }, () => this.look(from), from));
    new ResizeObserver(() => this.stage!.resize()).observe(this.picture);
    themes.follow((theme) => {
      this.stage!.setTheme(theme);
      this.named();
    });
    this.themes = themes;
  }

  private readonly themes: Themes | null = null;
  private view: View | null = null;

  private begun(page: Page, themes: Themes): Stage | null {
    try {
      return Stage.available() ? new Stage(this.canvas, page, themes.current) : null;
    } catch {
      return null; // a driver that offers WebGL and cannot
    }
  }

  show(view: View): void {
    this.view = view;
    const { stage } = this;
    if (!stage) return;
    stage.show(view);
    for (const [key, chip] of this.chips) {
      chip.hidden = !stage.has(key);
      chip.setAttribute("aria-pressed", String(stage.get(key)));
    }
    this.named();
    this.said();
  }

  seek(t: number): void {
    this.stage?.seek(t);
    this.said();
  }

  toggle(key: Toggle): void {
    const { stage } = this;
    if (!stage?.has(key)) return;
    stage.set(key, !stage.get(key));
    this.chips.get(key)!.setAttribute("aria-pressed", String(stage.get(key)));
    this.said();
  }

  look(from: Viewpoint): void {
    this.stage?.look(from);
  }

  /** Makes a still of the picture, for paper, in the size that its names are placed for. */
  keepStill(): void {
    if (!this.stage) return;
    this.stage.draw();
    this.still.src = this.canvas.toDataURL("image/png");
    const { clientWidth: width, clientHeight: height, style } = this.picture;
    style.setProperty("--width", `${width}px`);
    style.setProperty("--height", `${height}px`);
    style.setProperty("--zoom", String(Math.min(PAPER[0] / width, PAPER[1] / height)));
  }

  private named(): void {
    const actors = this.view?.actors ?? [];
    this.legend.hidden = actors.length < 2;
    const theme = this.themes?.current ?? "light";
    this.legend.replaceChildren(
      ...actors.map((actor) => {
        const swatch = el("i", { class: "swatch block" });
        swatch.style.color = toneColor(actor.tone, theme);
        return el("li", { class: actor.ghost ? "pale" : null }, swatch, actor.name);
      }),
    );
  }

  private said(): void {
    const now = this.stage?.closest;
    this.near.hidden = !now;
    const actors = this.view?.actors ?? [];
    const whose = actors.length > 1 ? ` of ${actors[0].name}` : "";
    const text = now ? `closest${whose}: ${now.name}: ${millimetres(now.distance)}` : "";
    if (text !== this.nearText) this.near.textContent = this.nearText = text;
  }
}

function millimetres(distance: number): string {
  const size = 1e3 * distance;
  return Math.abs(size) >= 1000 ? `${fixed(distance, 3)} m` : `${fixed(size, Math.abs(size) < 10 ? 2 : 1)} mm`;
}
