import type { Clock } from "./clock";
import { button, el } from "./dom";
import type { Player } from "./player";
import { type ScenePane, TOGGLES, VIEWPOINTS } from "./scenepane";

export interface Keyed {
  clock: Clock;
  player: Player;
  scene: ScenePane;
  theme(): void;
  other(by: 1 | -1): void; // view
}

/** The keyboard, and the list of its keys. */
export class Keys {
  readonly help = el("dialog", { class: "help", "aria-label": "keys" });

  constructor(private readonly to: Keyed, several: boolean) {
    this.help.append(
      el("h2", {}, "Keys"),
      el("dl", {}, ...this.list(several).map(([keys, what]) => el("div", {}, el("dt", {}, ...keys.map((key) => el("kbd", {}, key))), el("dd", {}, what)))),
      el("h2", {}, "Pointer"),
      el(
        "ul",
        {},
        el("li", {}, "Picture: drag turns, right button or two fingers move, wheel comes closer."),
        el("li", {}, "Plot: press or drag sets the time; Shift and drag shows a part of it, a double click all again."),
        el("li", {}, "Legend: a press shows one curve alone with its limits; Shift adds another."),
      ),
      button({ class: "close" }, () => this.help.close(), "Close"),
    );
    this.help.addEventListener("click", (event) => event.target === this.help && this.help.close());
    document.addEventListener("keydown", (event) => this.press(event));
  }

  private list(several: boolean): [string[], string][] {
    const keys: [string[], string][] = [
      [["space"], "play, pause"],
      [["\u2190", "\u2192"], "step; with Shift ten steps"],
      [["Home", "End"], "the beginning, the end"],
      [[",", "."], "slower, faster"],
      [["o"], "repeat"],
      [["m"], "the least clearance"],
    ];
    if (several) keys.push([["[", "]"], "the view before, the next"]);
    if (this.to.scene.stage) {
      for (const [from, digit] of VIEWPOINTS) keys.push([[digit], `look: ${from}`]);
      for (const [, name, letter] of TOGGLES) keys.push([[letter], name]);
    }
    keys.push([["l"], "light, dark"], [["?"], "this list"]);
    return keys;
  }

  swap(): void {
    if (this.help.open) this.help.close();
    else this.help.showModal();
  }

  private press(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    if (this.help.open && event.key !== "?") return;
    const at = event.target as HTMLElement;
    if (at.matches?.("select, textarea, input:not([type=range])")) return;
    if (event.key === " " && at.matches?.("button, summary, a")) return;
    if (/^(Arrow|Home|End)/.test(event.key) && at.matches?.(".table")) return;
    if (this.act(event.key, event.shiftKey)) event.preventDefault();
  }

  private act(key: string, shift: boolean): boolean {
    const { clock, player, scene } = this.to;
    const look = VIEWPOINTS.find(([, digit]) => digit === key);
    const toggle = TOGGLES.find(([, , letter]) => letter === key);
    if (key === "?") this.swap();
    else if (key === " ") clock.toggle();
    else if (key === "ArrowLeft" || key === "ArrowRight") clock.step((key === "ArrowLeft" ? -1 : 1) * (shift ? 10 : 1));
    else if (key === "Home" || key === "End") this.to.clock.step(key === "Home" ? -Infinity : Infinity);
    else if (key === ",") clock.faster(-1);
    else if (key === ".") clock.faster(1);
    else if (key === "o") clock.setRepeat(!clock.repeat);
    else if (key === "m") player.toLeast();
    else if (key === "l") this.to.theme();
    else if (key === "[") this.to.other(-1);
    else if (key === "]") this.to.other(1);
    else if (look) scene.look(look[0]);
    else if (toggle) scene.toggle(toggle[0]);
    else return false;
    return true;
  }
}
