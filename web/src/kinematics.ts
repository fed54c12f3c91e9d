/** Motions in plain numbers: packed arrays, cubic Hermite knots, forward kinematics.
 *
 * A matrix is 16 numbers, column-major as three.js keeps them; a frame's matrix takes its coordinates to the world's. */
import type { Joint, Knots, Packed, Robot, Transform } from "./data";

export type Matrix = Float64Array;
export type Numbers = Float32Array | Float64Array | Uint8Array | Uint16Array | Uint32Array;

const KINDS = { f32: Float32Array, f64: Float64Array, u8: Uint8Array, u16: Uint16Array, u32: Uint32Array };

/** The numbers of a packed array, row by row. */
export function unpack(packed: Packed): Numbers {
  const colon = packed.indexOf(":");
  const kind = KINDS[packed.slice(0, colon) as keyof typeof KINDS];
  if (!kind) throw new Error(`packed numbers begin with ${JSON.stringify(packed.slice(0, 8))}, expected f32:, f64:, u8:, u16: or u32:`);
  const text = atob(packed.slice(colon + 1));
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = text.charCodeAt(i);
  return new kind(bytes.buffer);
}

/** Points that are packed as shares of a box: x = low + (high - low) * value / 65535. */
export function unpackShares(packed: Packed, low: number[], high: number[]): Float32Array {
  const shares = unpack(packed);
  const points = new Float32Array(shares.length);
  for (let i = 0; i < points.length; i++) points[i] = low[i % 3] + ((high[i % 3] - low[i % 3]) * shares[i]) / 65535;
  return points;
}

export function identity(): Matrix {
  const m = new Float64Array(16);
  m[0] = m[5] = m[10] = m[15] = 1;
  return m;
}

/** A transform of 12 numbers, row by row, as a matrix. */
export function matrixOf(T: Transform): Matrix {
  const m = new Float64Array(16);
  for (let row = 0; row < 3; row++) for (let column = 0; column < 4; column++) m[4 * column + row] = T[4 * row + column];
  m[15] = 1;
  return m;
}

export function multiply(a: Matrix, b: Matrix, out: Matrix = new Float64Array(16)): Matrix {
  for (let column = 0; column < 4; column++) {
    const [x, y, z, w] = [b[4 * column], b[4 * column + 1], b[4 * column + 2], b[4 * column + 3]];
    for (let row = 0; row < 3; row++) out[4 * column + row] = a[row] * x + a[4 + row] * y + a[8 + row] * z + a[12 + row] * w;
    out[4 * column + 3] = w;
  }
  return out;
}

/** Position p and quaternion wxyz (any length) as a matrix. */
export function pose(p: ArrayLike<number>, quaternion: ArrayLike<number>): Matrix {
  const norm = Math.hypot(quaternion[0], quaternion[1], quaternion[2], quaternion[3]) || 1;
  const [w, x, y, z] = [quaternion[0] / norm, quaternion[1] / norm, quaternion[2] / norm, quaternion[3] / norm];
  const m = new Float64Array(16);
  m[0] = 1 - 2 * (y * y + z * z);
  m[1] = 2 * (x * y + w * z);
  m[2] = 2 * (x * z - w * y);
  m[4] = 2 * (x * y - w * z);
  m[5] = 1 - 2 * (x * x + z * z);
  m[6] = 2 * (y * z + w * x);
  m[8] = 2 * (x * z + w * y);
  m[9] = 2 * (y * z - w * x);
  m[10] = 1 - 2 * (x * x + y * y);
  m[12] = p[0];
  m[13] = p[1];
  m[14] = p[2];
  m[15] = 1;
  return m;
}

/** The last interval whose beginning is not after t: an index in 0 .. k - 2 (0 for a single knot). */
export function intervalAt(t: ArrayLike<number>, at: number): number {
  let [low, high] = [0, t.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (t[middle] <= at) low = middle;
    else high = middle;
  }
  return low;
}

/** A cubic Hermite curve of n numbers. */
export class Hermite {
  readonly n: number;
  constructor(readonly t: ArrayLike<number>, readonly values: ArrayLike<number>, readonly rates: ArrayLike<number>) {
    this.n = t.length ? Math.round(values.length / t.length) : 0;
  }

  /** The values at `at`, held before the first knot and after the last. */
  at(at: number): Float64Array {
    const { t, values, rates, n } = this;
    const out = new Float64Array(n);
    const last = t.length - 1;
    const i = intervalAt(t, at);
    const width = last > 0 ? t[i + 1] - t[i] : 0;
    if (last <= 0 || at <= t[0] || at >= t[last] || width <= 0) {
      const k = last <= 0 || at <= t[0] ? 0 : at >= t[last] ? last : i + 1;
      for (let j = 0; j < n; j++) out[j] = values[n * k + j];
      return out;
    }
    const s = (at - t[i]) / width;
    const [a, b] = [(1 + 2 * s) * (1 - s) * (1 - s), s * (1 - s) * (1 - s) * width];
    const [c, d] = [s * s * (3 - 2 * s), s * s * (s - 1) * width];
    for (let j = 0; j < n; j++) {
      const [k, l] = [n * i + j, n * (i + 1) + j];
      out[j] = a * values[k] + b * rates[k] + c * values[l] + d * rates[l];
    }
    return out;
  }
}

/** Where a robot is at an instant: its base's frame and the joints' moving frames, in the world. */
export interface Placement {
  base: Matrix;
  joints: Matrix[];
}

/** A robot that moves: forward kinematics of its knots. */
export class Motion {
  readonly q: Hermite;
  readonly start: number;
  readonly end: number;
  readonly moving: boolean; // whether the base moves
  private readonly position?: Hermite;
  private readonly attitude?: Hermite;
  private readonly still: Matrix;
  private readonly joints: { joint: Joint; T: Matrix }[];
  private readonly tool: Matrix;

  constructor(readonly robot: Robot, knots: Knots) {
    const t = unpack(knots.t);
    this.q = new Hermite(t, unpack(knots.q), unpack(knots.dq));
    this.start = t[0] ?? 0;
    this.end = t[t.length - 1] ?? 0;
    if (knots.base) {
      this.position = new Hermite(t, unpack(knots.base.p), unpack(knots.base.v));
      this.attitude = new Hermite(t, unpack(knots.base.w), unpack(knots.base.dw));
    }
    this.moving = knots.base !== undefined;
    this.still = matrixOf(knots.baseAt);
    this.joints = robot.joints.map((joint) => ({ joint, T: matrixOf(joint.T) }));
    this.tool = matrixOf(robot.tip.T);
  }

  base(t: number): Matrix {
    return this.position && this.attitude ? pose(this.position.at(t), this.attitude.at(t)) : this.still;
  }

  at(t: number): Placement {
    return this.place(this.q.at(t), this.base(t));
  }

  /** Where the robot is at joint values q with its base at a matrix. */
  place(q: ArrayLike<number>, base: Matrix): Placement {
    const frames: Matrix[] = [];
    for (const { joint, T } of this.joints) {
      const fixed = multiply(joint.parent < 0 ? base : frames[joint.parent], T);
      const value = joint.multiplier * q[joint.dof] + joint.offset;
      frames.push(joint.kind === "prismatic" ? slid(fixed, value) : turned(fixed, value));
    }
    return { base, joints: frames };
  }

  /** T_world_tip. */
  tip(t: number, placement: Placement = this.at(t)): Matrix {
    const { joint } = this.robot.tip;
    return multiply(joint < 0 ? placement.base : placement.joints[joint], this.tool);
  }
}

function turned(m: Matrix, angle: number): Matrix {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const out = m.slice();
  for (let row = 0; row < 3; row++) {
    out[row] = c * m[row] + s * m[4 + row];
    out[4 + row] = c * m[4 + row] - s * m[row];
  }
  return out;
}

function slid(m: Matrix, distance: number): Matrix {
  const out = m.slice();
  for (let row = 0; row < 3; row++) out[12 + row] += distance * m[8 + row];
  return out;
}
