/** What a report shows. Python writes it (src/spacearm/report/report_data.py), gzipped JSON in base64; the page reads it.
 *
 * Units are SI and radians unless a field says otherwise; transforms are 12 numbers, a 3 x 4 matrix row by row, from the
 * frame that is named last to the one that is named first. Packed arrays are base64 of little-endian numbers. */

/** Numbers in base64: "f32:", "f64:", "u16:", "u32:" or "u8:", then base64. */
export type Packed = string;

export type Transform = number[];

/** A shape in the frame of its owner. */
export type Geometry =
  | { kind: "box"; size: number[]; T: Transform }
  | { kind: "cylinder"; radius: number; length: number; T: Transform } // along z, centred
  | { kind: "capsule"; radius: number; a: number[]; b: number[] }
  | { kind: "sphere"; radius: number; center: number[] }
  | { kind: "spheres"; centers: Packed; radii: Packed } // many: (k, 3) and (k,) f32
  | { kind: "halfspace"; normal: number[]; offset: number } // all x with normal . x <= offset
  | { kind: "mesh"; mesh: number; T: Transform; scale?: number[] }; // index into `meshes`

/** Triangles. Positions are u16 shares of a box: x = low + (high - low) * value / 65535. */
export interface Mesh {
  low: number[];
  high: number[];
  positions: Packed; // u16 (k, 3)
  indices: Packed; // u32 or u16 (m, 3)
  /** Packed RGB bytes u8 (m, 3) of the triangles; absent where the mesh has one colour. */
  colors?: Packed;
}

export interface Part {
  name: string; // of the link
  joint: number; // whose moving frame it rides on; -1 for the base
  geometry: Geometry;
  color?: string; // CSS, as the robot's file states it
  held?: boolean; // fixed to the end effector's frame, as what it holds is
}

export interface Joint {
  name: string;
  kind: "revolute" | "prismatic";
  parent: number; // -1 for the base
  T: Transform; // this joint's frame at value 0, in the parent's moving frame
  dof: number; // index in q
  multiplier: number;
  offset: number; // value = multiplier * q[dof] + offset; turns about or slides along z
}

export interface Robot {
  name: string;
  joints: Joint[]; // parents before children
  dofNames: string[];
  tip: { name: string; joint: number; T: Transform };
  shapes: Part[]; // the envelope: what is kept clear
  visuals: Part[]; // what the file draws; empty where it draws nothing
}

/** A motion between instants: q is a cubic Hermite curve between knots; so is the base, its quaternion normalised. */
export interface Knots {
  t: Packed; // f64 (k,) [s], ascending; a kink of the rates is stated twice
  q: Packed; // f32 (k, n); all of them f64 where joints turn so far that f32 rounds too much
  dq: Packed; // f32 (k, n)
  base?: { p: Packed; v: Packed; w: Packed; dw: Packed }; // f32 (k, 3), (k, 3), quaternion wxyz (k, 4), its rate (k, 4)
  baseAt: Transform; // where a base is that does not move
}

/** A robot that moves (or stands, with one knot). */
export interface Actor {
  name: string;
  robot: number;
  knots: Knots;
  tone: Tone;
  ghost: boolean; // drawn pale; the first actor never is
}

/** Colours are the page's, of a palette for the colour-blind, for light and dark. Actors and series use 0, 1, 2, ... */
export type Tone = number;

export interface Obstacle {
  name: string;
  parts: Geometry[];
}

export interface Target {
  name: string; // "goal", "start"
  kind: "position" | "pose" | "configuration";
  T: Transform; // of the end effector
  radius: number; // tolerance [m]
}

/** The closest pair over time, of the first actor. */
export interface Closest {
  t: Packed; // f32 (k,)
  distance: Packed; // f32 (k,) [m]
  points: Packed; // f32 (k, 2, 3)
  pair: Packed; // u16 (k,) index into names
  names: string[]; // "link 'hand' and obstacle 'mast'"
}

/** Particles of a swarm over iterations, drawn as points; the clock counts iterations. */
export interface Cloud {
  name: string;
  low: number[];
  high: number[];
  points: Packed; // u16 (k, p, 3), shares of the box
  at?: Packed; // f32 (k,) the clock's instants of the k sets, ascending: one is shown until the next; absent: 0, 1, 2, ...
  value?: Packed; // u8 (k, p): 0 best .. 255 worst, for the colour
  legend?: string;
}

export interface Series {
  label: string;
  tone: Tone;
  values: Packed; // f32 (k,); NaN leaves a gap
  dashed?: boolean;
  steps?: boolean; // a staircase, as success over time is
  faint?: boolean; // one of many lines behind
}

/** Curves over one axis. `limits` of a series are drawn when it is looked at, `lines` always. */
export interface Plot {
  id: string;
  title: string;
  unit: string;
  xLabel: string; // "time [s]"
  x: Packed; // f32 (k,)
  clock: boolean; // whether x is the view's clock: the cursor follows the slider
  log?: boolean; // y
  logX?: boolean;
  floor?: number; // the least y of a logarithmic axis: smaller values are drawn there
  series: Series[];
  limits?: { series: number; lower: number | null; upper: number | null }[];
  lines?: { value: number; label: string }[];
  note?: string;
}

export interface Section {
  title: string;
  rows?: [string, string][];
  notes?: string[];
  table?: { header: string[]; rows: string[][] };
  code?: string;
  plots?: Plot[];
  open: boolean;
}

export interface View {
  name: string;
  verdict: { tone: "good" | "bad" | "plain"; headline: string; text: string };
  clock: { unit: string; duration: number; step?: number }; // step: whole ones only, as iterations
  actors: Actor[];
  obstacles: Obstacle[];
  targets: Target[];
  cloud?: Cloud;
  closest?: Closest;
  plots: Plot[]; // those over the clock come first
  sections: Section[];
}

export interface Page {
  "spacearm-report": 1;
  title: string;
  block: [string, string][]; // the title block
  robots: Robot[];
  meshes: Mesh[];
  views: View[];
  open?: number; // index of the view that is shown first; absent: 0
  sections: Section[];
}
