/** What lies over the 3-D picture as HTML and SVG: names that do not overlap, the axes' gizmo, the legend of a colour scale. */
import * as THREE from "three";
import { SCENE, scaleGradient, type Theme } from "./palette";

/** Text at a place of the scene. */
export interface Label {
  element: HTMLElement;
  at: THREE.Vector3;
  rank: number; // smaller ones keep their place where labels overlap
  shown: boolean; // whether it is wanted
  width: number; // 0 until it has been measured
  height: number;
  centred: boolean; // over its place; else above it
}

const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif";
const SVG = "http://www.w3.org/2000/svg";
const GIZMO = 74;

export class Overlay {
  readonly root = document.createElement("div");
  private labels: Label[] = [];
  private readonly gizmo = document.createElementNS(SVG, "svg");
  private readonly legend = document.createElement("div");
  private readonly arms: { line: SVGElement; knob: SVGElement; text: SVGElement }[] = [];
  private theme: Theme = "light";

  constructor(canvas: HTMLCanvasElement, pick: (axis: number) => void) {
    const parent = canvas.parentElement!;
    if (getComputedStyle(parent).position === "static") parent.style.position = "relative";
    this.root.className = "stage-overlay";
    this.root.setAttribute("aria-hidden", "true");
    Object.assign(this.root.style, { position: "absolute", overflow: "hidden", pointerEvents: "none", fontFamily: FONT, userSelect: "none" });
    Object.assign(this.legend.style, { position: "absolute", left: "12px", bottom: "10px", font: `11px ${FONT}`, display: "none" });
    this.legend.className = "stage-legend";
    this.gizmo.setAttribute("class", "stage-gizmo");
    this.gizmo.setAttribute("viewBox", `${-GIZMO / 2} ${-GIZMO / 2} ${GIZMO} ${GIZMO}`);
    Object.assign(this.gizmo.style, { position: "absolute", right: "8px", bottom: "6px", width: `${GIZMO}px`, height: `${GIZMO}px` });
    for (let axis = 0; axis < 3; axis++) this.arms.push(this.arm(axis, pick));
    this.root.append(this.legend, this.gizmo);
    canvas.after(this.root);
  }

  private arm(axis: number, pick: (axis: number) => void): { line: SVGElement; knob: SVGElement; text: SVGElement } {
    const [group, line, knob, text] = ["g", "line", "circle", "text"].map((name) => document.createElementNS(SVG, name));
    line.setAttribute("stroke-width", "2.2");
    line.setAttribute("stroke-linecap", "round");
    knob.setAttribute("r", "8");
    text.setAttribute("text-anchor", "middle");
    text.setAttribute("dominant-baseline", "central");
    text.setAttribute("font-size", "10.5");
    text.setAttribute("font-weight", "700");
    text.textContent = "xyz"[axis];
    Object.assign(group.style, { pointerEvents: "auto", cursor: "pointer" });
    group.addEventListener("click", () => pick(axis));
    group.append(line, knob, text);
    this.gizmo.append(group);
    return { line, knob, text };
  }

  /** Takes the canvas's place and the theme's colours. */
  fit(canvas: HTMLCanvasElement, theme: Theme): void {
    this.theme = theme;
    const { offsetLeft: left, offsetTop: top, clientWidth: width, clientHeight: height } = canvas;
    Object.assign(this.root.style, { left: `${left}px`, top: `${top}px`, width: `${width}px`, height: `${height}px` });
    this.root.style.color = SCENE[theme].text;
    this.arms.forEach(({ line, knob, text }, axis) => {
      line.setAttribute("stroke", SCENE[theme].axes[axis]);
      knob.setAttribute("fill", SCENE[theme].axes[axis]);
      text.setAttribute("fill", theme === "light" ? "#ffffff" : "#0b0f15");
    });
  }

  clear(): void {
    for (const { element } of this.labels) element.remove();
    this.labels = [];
    this.legend.style.display = "none";
  }

  /** A new label: "mark" is plain small text, "name" has a ground behind it, "value" is strong. */
  label(text: string, kind: "mark" | "name" | "value", rank: number, centred = false): Label {
    const element = document.createElement("div");
    element.className = `stage-label stage-${kind}`;
    element.textContent = text;
    const style = { position: "absolute", left: "0", top: "0", whiteSpace: "nowrap", willChange: "transform", visibility: "hidden" };
    Object.assign(element.style, style, { font: `${kind === "value" ? "600 12px" : kind === "name" ? "11px" : "10px"}/1.35 ${FONT}` });
    if (kind === "mark") element.style.opacity = "0.6";
    else Object.assign(element.style, { padding: "0 4px", borderRadius: "3px", background: SCENE[this.theme].halo });
    this.root.append(element);
    const label = { element, at: new THREE.Vector3(), rank, shown: true, width: 0, height: 0, centred };
    this.labels.push(label);
    return label;
  }

  /** Changes a label's text; it is measured again. */
  write(label: Label, text: string, color = ""): void {
    if (label.element.textContent !== text) {
      label.element.textContent = text;
      label.width = 0;
    }
    label.element.style.color = color;
  }

  setLegend(title: string, low: string, high: string): void {
    const bar = `<div style="height:6px;border-radius:3px;background:${scaleGradient(this.theme)};margin:3px 0"></div>`;
    this.legend.innerHTML = `<div class="title"></div>${bar}<div style="display:flex;justify-content:space-between"><span></span><span></span></div>`;
    this.legend.firstElementChild!.textContent = title;
    this.legend.querySelectorAll("span").forEach((span, i) => (span.textContent = i ? high : low));
    Object.assign(this.legend.style, { display: "block", minWidth: "132px", fontVariantNumeric: "tabular-nums" });
  }

  hideLegend(): void {
    this.legend.style.display = "none";
  }

  /** Puts the labels where the camera sees their places; where two overlap, the one of the greater rank is hidden. */
  place(camera: THREE.PerspectiveCamera, width: number, height: number): void {
    const taken: number[][] = [[width - GIZMO - 8, height - GIZMO - 6, width, height]];
    if (this.legend.style.display !== "none") taken.push([0, height - 52, 160, height]);
    const seen = this.labels.filter((label) => label.shown);
    for (const label of this.labels) if (!label.shown) label.element.style.visibility = "hidden";
    for (const label of seen) {
      if (label.width) continue;
      label.width = label.element.offsetWidth;
      label.height = label.element.offsetHeight;
    }
    const projected = seen.map((label) => ({ label, p: label.at.clone().project(camera) }));
    projected.sort((a, b) => a.label.rank - b.label.rank || a.p.z - b.p.z);
    for (const { label, p } of projected) {
      const x = Math.round(((p.x + 1) / 2) * width - label.width / 2);
      const y = Math.round(((1 - p.y) / 2) * height - (label.centred ? label.height / 2 : label.height + 7));
      const box = [x, y, x + label.width, y + label.height];
      const inside = Math.abs(p.z) < 1 && x > 1 && y > 1 && box[2] < width - 1 && box[3] < height - 1;
      const free = inside && taken.every((t) => box[2] + 2 < t[0] || t[2] + 2 < box[0] || box[3] + 1 < t[1] || t[3] + 1 < box[1]);
      label.element.style.visibility = free ? "visible" : "hidden";
      if (!free) continue;
      taken.push(box);
      label.element.style.transform = `translate(${x}px, ${y}px)`;
    }
    this.turn(camera);
  }

  /** Turns the gizmo with the camera. */
  private turn(camera: THREE.PerspectiveCamera): void {
    const m = camera.matrixWorldInverse.elements;
    const reach = GIZMO / 2 - 10;
    const order = [0, 1, 2].sort((a, b) => m[4 * a + 2] - m[4 * b + 2]);
    for (const axis of order) {
      const [x, y, z] = [m[4 * axis] * reach, -m[4 * axis + 1] * reach, m[4 * axis + 2]];
      const { line, knob, text } = this.arms[axis];
      line.setAttribute("x2", x.toFixed(1));
      line.setAttribute("y2", y.toFixed(1));
      for (const [name, value] of [["cx", x], ["cy", y]] as const) knob.setAttribute(name, value.toFixed(1));
      for (const [name, value] of [["x", x], ["y", y]] as const) text.setAttribute(name, value.toFixed(1));
      const group = line.parentElement as unknown as SVGElement;
      group.style.opacity = z < -0.3 ? "0.55" : "1";
      this.gizmo.append(group);
    }
  }

  dispose(): void {
    this.root.remove();
  }
}
