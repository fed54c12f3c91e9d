/** What lies over the 3-D picture as HTML and SVG: names that do not overlap, the axes' gizmo, the legend of a colour scale. */
import * as THREE from "three";
import { SCENE, type scaleColor, scaleGradient, type Theme } from "./palette";

/** Text at a place of the scene. */
export interface Label {
  element: HTMLElement;
  at: THREE.Vector3;
  rank: number; // smaller ones keep their place where labels overlap
  shown: boolean; // whether it is wanted
  hidden: boolean; // whether it has no place now
  width: number; // 0 until it has been measured
  height: number;
  way: "above" | "centred" | "beside"; // where it stands by its place if it can; a line leads to one that is further off
  leader: SVGElement | null;
  last: number; // where it stood, of the boxes where it may
  extent: number; // of what it names [m]: the name is left out where that is seen small; 0: never
}

const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif";
const SVG = "http://www.w3.org/2000/svg";
const GIZMO = 74;
const SMALLEST = 72; // px: links that are seen smaller are not named

export class Overlay {
  readonly root = document.createElement("div");
  private labels: Label[] = [];
  private readonly gizmo = document.createElementNS(SVG, "svg");
  private readonly legend = document.createElement("div");
  private readonly arms: { line: SVGElement; knob: SVGElement; text: SVGElement }[] = [];
  private readonly leaders = document.createElementNS(SVG, "svg");
  private readonly tip = document.createElement("div"); // of the pointer
  private readonly note = document.createElement("div"); // of the grid
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
    Object.assign(this.leaders.style, { position: "absolute", left: "0", top: "0", width: "100%", height: "100%" });
    Object.assign(this.tip.style, { position: "absolute", left: "0", top: "0", padding: "1px 6px", borderRadius: "3px", font: `11px/1.5 ${FONT}`, whiteSpace: "nowrap", zIndex: "2" });
    this.tip.className = "stage-pointer";
    this.note.className = "stage-note";
    Object.assign(this.note.style, { position: "absolute", right: "12px", top: "8px", font: `10px ${FONT}`, opacity: "0.65" });
    this.root.append(this.leaders, this.legend, this.note, this.gizmo, this.tip);
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
    Object.assign(this.tip.style, { background: SCENE[theme].text, color: SCENE[theme].top });
    this.arms.forEach(({ line, knob, text }, axis) => {
      line.setAttribute("stroke", SCENE[theme].axes[axis]);
      knob.setAttribute("fill", SCENE[theme].axes[axis]);
      text.setAttribute("fill", theme === "light" ? "#ffffff" : "#0b0f15");
    });
  }

  clear(): void {
    for (const { element } of this.labels) element.remove();
    this.leaders.replaceChildren();
    this.tell("", 0, 0);
    this.labels = [];
    this.legend.style.display = "none";
  }

  /** A new label: "mark" is plain small text, "name" has a ground behind it, "value" is strong. */
  label(text: string, kind: "mark" | "name" | "value", rank: number, way: Label["way"] = "above"): Label {
    const element = document.createElement("div");
    element.className = `stage-label stage-${kind}`;
    element.textContent = text;
    const style = { position: "absolute", left: "0", top: "0", whiteSpace: "nowrap", willChange: "transform", visibility: "hidden" };
    Object.assign(element.style, style, { font: `${kind === "value" ? "600 12px" : kind === "name" ? "11px" : "10px"}/1.35 ${FONT}` });
    if (kind === "mark") element.style.opacity = "0.6";
    else Object.assign(element.style, { padding: "0 4px", borderRadius: "3px", background: SCENE[this.theme].halo });
    this.root.append(element);
    const label = { element, at: new THREE.Vector3(), rank, shown: true, hidden: false, width: 0, height: 0, way, leader: way === "centred" ? null : this.leader(), extent: 0, last: Infinity };
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

  setNote(text: string): void {
    this.note.textContent = text;
  }

  setLegend(title: string, low: string, high: string, of: typeof scaleColor): void {
    const bar = `<div style="height:6px;max-width:150px;border-radius:3px;background:${scaleGradient(this.theme, of)};margin:3px 0"></div>`;
    this.legend.innerHTML = `<div></div>${bar}<div style="display:flex;justify-content:space-between;max-width:150px"><span></span><span></span></div>`;
    this.legend.firstElementChild!.textContent = title;
    this.legend.querySelectorAll("span").forEach((span, i) => (span.textContent = i ? high : low));
    Object.assign(this.legend.style, { display: "block", width: "min(220px, 42%)", fontVariantNumeric: "tabular-nums" });
  }

  hideLegend(): void {
    this.legend.style.display = "none";
  }

  /** Puts the labels where the camera sees their places: beside `clear`, the points of the arm, and beside each other. Where there
   * is no room, the labels of the greater rank are hidden. */
  place(camera: THREE.PerspectiveCamera, width: number, height: number, clear: THREE.Vector3[]): void {
    const taken: number[][] = [[width - GIZMO - 8, height - GIZMO - 6, width, height]];
    taken.push([width - 150, 0, width, 24]); // the note
    for (const other of this.root.parentElement!.children) {
      if (other === this.root || other instanceof HTMLCanvasElement || !(other instanceof HTMLElement)) continue;
      const [left, top] = [other.offsetLeft - this.root.offsetLeft, other.offsetTop - this.root.offsetTop];
      if (other.offsetWidth && other.offsetHeight < height / 2) taken.push([left, top, left + other.offsetWidth, top + other.offsetHeight]); // what the page writes
    }
    if (this.legend.style.display !== "none") taken.push([0, height - this.legend.offsetHeight - 16, this.legend.offsetWidth + 22, height]);
    const arm = clear.map((point) => point.clone().project(camera)).filter((p) => Math.abs(p.z) < 1);
    const kept = arm.map((p) => [((p.x + 1) / 2) * width, ((1 - p.y) / 2) * height]).map(([x, y]) => [x - 9, y - 8, x + 9, y + 8]);
    const seen = this.labels.filter((label) => label.shown && !label.hidden);
    for (const label of this.labels) {
      if (label.shown && !label.hidden) continue;
      label.element.style.visibility = "hidden";
      label.leader?.setAttribute("visibility", "hidden");
    }
    for (const label of seen) {
      if (label.width) continue;
      label.width = label.element.offsetWidth;
      label.height = label.element.offsetHeight;
    }
    const focal = height / 2 / Math.tan((camera.fov * Math.PI) / 360);
    const projected = seen.map((label) => ({ label, p: label.at.clone().project(camera) }));
    projected.sort((a, b) => a.label.rank - b.label.rank || a.p.z - b.p.z);
    for (const { label, p } of projected) {
      const [x, y] = [((p.x + 1) / 2) * width, ((1 - p.y) / 2) * height];
      const large = label.extent === 0 || label.extent * focal > SMALLEST * label.at.distanceTo(camera.position);
      const found = large && Math.abs(p.z) < 1 ? this.free(label, x, y, taken, kept, width, height) : null;
      label.element.style.visibility = found ? "visible" : "hidden";
      label.leader?.setAttribute("visibility", found && apart(found, x, y) > 12 ? "visible" : "hidden");
      if (!found) continue;
      taken.push(found);
      label.element.style.transform = `translate(${found[0]}px, ${found[1]}px)`;
      const end = [Math.min(found[2], Math.max(found[0], x)), Math.min(found[3], Math.max(found[1], y))];
      if (label.leader) [x, y, ...end].forEach((v, k) => label.leader!.setAttribute(["x1", "y1", "x2", "y2"][k], v.toFixed(1)));
    }
    this.turn(camera);
  }

  /** A box for a label that overlaps nothing: the one that it had is tried first, so that names do not jump. */
  private free(label: Label, x: number, y: number, taken: number[][], kept: number[][], width: number, height: number): number[] | null {
    const boxes = places(label, x, y);
    if (label.way === "centred") return isFree(boxes[0], taken, width, height) ? boxes[0] : null;
    const order = [label.last, ...boxes.keys()].filter((i) => i < boxes.length);
    const open = order.filter((i) => isFree(boxes[i], taken, width, height));
    const best = open.find((i) => isFree(boxes[i], kept, width, height)) ?? (label.rank < 20 ? open[0] : undefined);
    if (best === undefined) return null;
    label.last = best;
    return boxes[best];
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

  private leader(): SVGElement {
    const line = document.createElementNS(SVG, "line");
    line.setAttribute("stroke", SCENE[this.theme].text);
    line.setAttribute("stroke-opacity", "0.55");
    this.leaders.append(line);
    return line;
  }

  /** Tells the name of what is under the pointer. */
  tell(text: string, x: number, y: number): void {
    this.tip.style.display = text ? "block" : "none";
    if (!text) return;
    this.tip.textContent = text;
    const right = x + 14 + this.tip.offsetWidth > this.root.clientWidth;
    this.tip.style.transform = `translate(${Math.round(right ? x - 10 - this.tip.offsetWidth : x + 14)}px, ${Math.round(y + 12)}px)`;
  }

  dispose(): void {
    this.root.remove();
  }
}

/** The boxes where a label may stand by its place, the best first: left, top, right, bottom. */
function places(label: Label, x: number, y: number): number[][] {
  const { width, height, way } = label;
  const box = (left: number, top: number) => [Math.round(left), Math.round(top), Math.round(left) + width, Math.round(top) + height];
  if (way === "centred") return [box(x - width / 2, y - height / 2)];
  const found = way === "above" ? [box(x - width / 2, y - height - 7), box(x - width / 2, y + 7)] : [];
  for (const reach of [24, 48, 84]) {
    for (const [side, up] of [[1, -0.8], [-1, -0.8], [1, 0.8], [-1, 0.8], [0, -1], [0, 1], [1, 0], [-1, 0]]) {
      const left = side > 0 ? x + reach : side < 0 ? x - reach - width : x - width / 2;
      found.push(box(left, y + up * reach - (up > 0 ? 0 : up < 0 ? height : height / 2)));
    }
  }
  return found;
}

/** How far a place is from a box [px]. */
function apart(box: number[], x: number, y: number): number {
  return Math.hypot(Math.max(box[0] - x, 0, x - box[2]), Math.max(box[1] - y, 0, y - box[3]));
}

function isFree(box: number[], taken: number[][], width: number, height: number): boolean {
  if (box[0] < 1 || box[1] < 1 || box[2] > width - 1 || box[3] > height - 1) return false;
  return taken.every((t) => box[2] + 2 < t[0] || t[2] + 2 < box[0] || box[3] + 1 < t[1] || t[3] + 1 < box[1]);
}
