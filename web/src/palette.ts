/** Colours of the page, light and dark. Tones are Okabe's and Ito's for the colour-blind, the same hue in both themes. */
export type Theme = "light" | "dark";

const TONES: Record<Theme, string[]> = {
  light: ["#0072b2", "#d55e00", "#009e73", "#b4578f", "#c48a00", "#3a9bd8", "#4d5761", "#8a6d3b"],
  dark: ["#56b4e9", "#f08a4b", "#2fc59b", "#dd93c0", "#f0c24b", "#8fd0ff", "#b9c3cd", "#c9a66b"],
};

/** The colour of a tone (0, 1, 2, ...); after the eighth they begin again. */
export function toneColor(tone: number, theme: Theme): string {
  const tones = TONES[theme];
  return tones[((Math.trunc(tone) % tones.length) + tones.length) % tones.length];
}

/** Of verdicts, limits and what is closest. */
export const SIGNALS: Record<Theme, { good: string; bad: string; plain: string; limit: string }> = {
  light: { good: "#00795a", bad: "#c24a00", plain: "#4d5761", limit: "#c24a00" },
  dark: { good: "#2fc59b", bad: "#f08a4b", plain: "#b9c3cd", limit: "#f08a4b" },
};

/** Of the scene. */
export interface SceneColors {
  top: string; // the background's gradient
  bottom: string;
  links: [string, string]; // in turn, along the chain
  base: string;
  panel: string;
  payload: string;
  tool: string;
  obstacle: string;
  edge: string;
  edgeOpacity: number;
  grid: string;
  gridOpacity: number;
  text: string;
  halo: string;
  axes: [string, string, string]; // x, y, z
  closest: string;
  start: string;
  goal: string;
  basePath: string;
  envelope: string;
  sky: string; // the lights
  ground: string;
  skyIntensity: number;
  keyIntensity: number;
  fillIntensity: number;
}

export const SCENE: Record<Theme, SceneColors> = {
  light: {
    top: "#f7f9fb",
    bottom: "#d9e0e7",
    links: ["#e9ecef", "#b3bcc6"],
    base: "#cfc8ba",
    panel: "#46689a",
    payload: "#e0a526",
    tool: "#5b6875",
    obstacle: "#8c99a8",
    edge: "#1d2731",
    edgeOpacity: 0.42,
    grid: "#41505f",
    gridOpacity: 0.34,
    text: "#1c2630",
    halo: "rgba(246, 249, 251, 0.86)",
    axes: ["#d55e00", "#009e73", "#0072b2"],
    closest: "#c0257a",
    start: "#4d5761",
    goal: "#008a64",
    basePath: "#8a6d3b",
    envelope: "#0072b2",
    sky: "#ffffff",
    ground: "#a9b3be",
    skyIntensity: 1.55,
    keyIntensity: 1.65,
    fillIntensity: 0.6,
  },
  dark: {
    top: "#1c2430",
    bottom: "#0b0f15",
    links: ["#dfe3e8", "#8d98a5"],
    base: "#b3a88f",
    panel: "#3f6fae",
    payload: "#e8b23a",
    tool: "#6f7f90",
    obstacle: "#6f7e90",
    edge: "#05080c",
    edgeOpacity: 0.6,
    grid: "#9fb2c6",
    gridOpacity: 0.26,
    text: "#e6ecf2",
    halo: "rgba(13, 18, 25, 0.8)",
    axes: ["#f08a4b", "#2fc59b", "#56b4e9"],
    closest: "#ff7ac1",
    start: "#b9c3cd",
    goal: "#2fc59b",
    basePath: "#c9a66b",
    envelope: "#56b4e9",
    sky: "#dfeaf7",
    ground: "#2a3340",
    skyIntensity: 1.15,
    keyIntensity: 1.85,
    fillIntensity: 0.85,
  },
};

// viridis at equal steps
const VIRIDIS = ["#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"];
const STOPS = VIRIDIS.map((color) => [1, 3, 5].map((i) => parseInt(color.slice(i, i + 2), 16) / 255));

/** A colour of a scale that is even to the eye (viridis), as sRGB shares; the ends that vanish in the background are left out. */
export function scaleColor(share: number, theme: Theme): [number, number, number] {
  const [low, high] = theme === "light" ? [0, 0.88] : [0.22, 1];
  const x = (low + (high - low) * Math.min(1, Math.max(0, share || 0))) * (STOPS.length - 1);
  const i = Math.min(STOPS.length - 2, Math.floor(x));
  return [0, 1, 2].map((c) => STOPS[i][c] + (STOPS[i + 1][c] - STOPS[i][c]) * (x - i)) as [number, number, number];
}

/** The scale for what is best at 0: that end stands out from the background. */
export function costColor(share: number, theme: Theme): [number, number, number] {
  return scaleColor(theme === "light" ? share : 1 - share, theme);
}

/** A scale as a CSS gradient, least to most. */
export function scaleGradient(theme: Theme, of: typeof scaleColor = scaleColor): string {
  const stops = Array.from({ length: 9 }, (_, i) => of(i / 8, theme).map((v) => Math.round(255 * v)));
  return `linear-gradient(to right, ${stops.map((rgb) => `rgb(${rgb.join(",")})`).join(", ")})`;
}
