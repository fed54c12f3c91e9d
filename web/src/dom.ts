/** Elements, icons, and how numbers are written. */

type Child = Node | string | null | undefined | false;
type Attributes = Record<string, string | number | boolean | ((event: any) => void) | null | undefined>;

/** An element; attributes that are functions listen to the event of their name, false and null are left out. */
export function el<K extends keyof HTMLElementTagNameMap>(
  name: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === "function") made.addEventListener(key, value);
    else if (value === true) made.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(key, String(value));
  }
  for (const child of children) if (child) made.append(child);
  return made;
}

const ICONS = {
  play: "M4.5 2.5v11l9-5.5z",
  pause: "M4 2.5h3v11H4zM9 2.5h3v11H9z",
  back: "M11.5 3v10L5.5 8zM3.5 3h1.6v10H3.5z",
  ahead: "M4.5 3v10l6-5zM10.9 3h1.6v10h-1.6z",
  least: "M1 7.2h3V5l3 3-3 3V8.8H1zM15 7.2h-3V5L9 8l3 3V8.8h3z",
  repeat: "M3 7.5A4 4 0 0 1 7 4h3V2l3.5 2.8L10 7.6V5.5H7a2.5 2.5 0 0 0-2.5 2zM13 8.5A4 4 0 0 1 9 12H6v2l-3.5-2.8L6 8.4v2.1h3a2.5 2.5 0 0 0 2.5-2z",
  theme: "M8 1.5a6.5 6.5 0 1 0 0 13 6.5 6.5 0 0 0 0-13zM8 3a5 5 0 0 1 0 10z",
  print: "M4.5 1.5h7v3h-7zM2.5 5.5h11v6h-2v-2h-7v2h-2zM5.5 10.5h5v4h-5z",
  wide: "M2 2h5v1.5H4.6l2.5 2.5L6 7.1 3.5 4.6V7H2zM14 14H9v-1.5h2.4L8.9 10 10 8.9l2.5 2.5V9H14z",
  copy: "M5.5 1.5h8v9h-8zM7 3v6h5V3zM2.5 5h1.5v8h6v1.5h-7.5z",
};

/** A drawn sign, 16 x 16, in the colour of the text around it. */
export function icon(name: keyof typeof ICONS): SVGSVGElement {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  for (const [key, value] of Object.entries({ viewBox: "0 0 16 16", class: "icon", "aria-hidden": "true" })) svg.setAttribute(key, value);
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", ICONS[name]);
  svg.append(path);
  return svg;
}

/** A button; a press by mouse leaves no focus behind, so that the space bar goes on to play and pause. */
export function button(attributes: Attributes, press: () => void, ...children: Child[]): HTMLButtonElement {
  return el("button", { type: "button", ...attributes, click: (event: MouseEvent) => released(event, press) }, ...children);
}

function released(event: MouseEvent, press: () => void): void {
  if (event.detail > 0) (event.currentTarget as HTMLElement).blur();
  press();
}

const MINUS = "\u2212";

/** A number with some significant digits; small and large ones with a power of ten. `short`: without zeros at the end. */
export function significant(value: number, digits = 3, short = true): string {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "\u2013" : value > 0 ? "\u221e" : `${MINUS}\u221e`;
  if (value === 0) return "0";
  const size = Math.abs(value);
  const cut = short ? trimmed : (text: string) => text;
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return `${signed(cut(mantissa))}e${signed(String(Number(exponent)))}`;
  }
  return signed(cut(value.toPrecision(digits + (size >= 1000 ? 1 : 0)).replace(/\.$/, "")));
}

/** A number with a number of decimals. */
export function fixed(value: number, decimals: number): string {
  if (!Number.isFinite(value)) return significant(value);
  const text = value.toFixed(decimals);
  return signed(Number(text) === 0 ? text.replace("-", "") : text);
}

/** Decimals that tell apart some thousand steps of a span. */
export function decimalsOf(span: number): number {
  return span > 0 && Number.isFinite(span) ? Math.min(9, Math.max(0, 3 - Math.ceil(Math.log10(span)))) : 3;
}

function trimmed(text: string): string {
  return text.includes(".") && !text.includes("e") ? text.replace(/\.?0+$/, "") : text;
}

function signed(text: string): string {
  return text.replace("-", MINUS);
}

/** A number and its unit; none after a bare "-". */
export function withUnit(text: string, unit: string): string {
  return unit && unit !== "-" && unit !== "1" ? `${text} ${unit}` : text;
}
