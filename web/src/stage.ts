import type { Page, View } from "./data";
import { Motion } from "./kinematics";
import type { Theme } from "./palette";

export type Toggle = "visuals" | "shapes" | "path" | "basePath" | "axes" | "names" | "closest" | "ghosts" | "targets" | "cloud" | "grid";
export type Viewpoint = "top" | "front" | "side" | "corner" | "tool";

/** The 3-D picture of a view. (Its skeleton: it draws nothing yet.) */
export class Stage {
  closest: { name: string; distance: number } | null = null;
  private motions: Motion[] = [];
  static available(): boolean {
    return document.createElement("canvas").getContext("webgl2") !== null;
  }
  constructor(readonly canvas: HTMLCanvasElement, readonly page: Page, public theme: Theme) {}
  show(view: View): void {
    this.motions = view.actors.map((actor) => new Motion(this.page.robots[actor.robot], actor.knots));
  }
  seek(_t: number): void {}
  has(_toggle: Toggle): boolean {
    return true;
  }
  get(_toggle: Toggle): boolean {
    return true;
  }
  set(_toggle: Toggle, _on: boolean): void {}
  look(_from: Viewpoint): void {}
  setTheme(theme: Theme): void {
    this.theme = theme;
  }
  resize(): void {}
  dispose(): void {}
  tip(actor: number, t: number): number[] {
    return Array.from(this.motions[actor].tip(t));
  }
  draw(): void {}
}
