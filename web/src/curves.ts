import type { Plot } from "./data";
import { unpack } from "./kinematics";

/** A plot's numbers: as they are, and as they are drawn (on a logarithmic axis nothing is below the floor). */
export class Curves {
  readonly x: number[];
  readonly exact: number[][];
  readonly drawn: (number | null)[][];
  readonly floor: number; // 0 on a linear axis
  readonly clamped: boolean; // whether a value is drawn at the floor that is below it

  constructor(readonly plot: Plot) {
    this.x = Array.from(unpack(plot.x));
    this.exact = plot.series.map((series) => Array.from(unpack(series.values)).slice(0, this.x.length));
    this.floor = plot.log ? plot.floor ?? leastPositive(this.exact) : 0;
    this.clamped = this.floor > 0 && this.exact.some((values) => values.some((value) => value < this.floor));
    if (plot.logX) this.dropWhatHasNoLogarithm();
    this.drawn = this.exact.map((values) => values.map((value) => this.place(value)));
  }

  /** Where a value is drawn; null: nowhere. */
  place(value: number): number | null {
    if (!Number.isFinite(value)) return null;
    return this.floor > 0 ? Math.max(value, this.floor) : value;
  }

  /** A series' value at x: on the line between its neighbours, or on its step; NaN outside and in gaps. */
  at(series: number, x: number): number {
    const { x: xs } = this;
    const values = this.exact[series];
    const last = xs.length - 1;
    if (last < 0 || !(x >= xs[0] - 1e-9 * Math.abs(xs[0])) || x > xs[last] + 1e-6 * Math.abs(xs[last])) return NaN;
    const i = this.before(x);
    if (i >= last) return values[last];
    if (this.plot.series[series].steps || x <= xs[i]) return values[i];
    const share = (x - xs[i]) / (xs[i + 1] - xs[i]);
    return values[i] + (values[i + 1] - values[i]) * share;
  }

  /** The last index whose x is not above a value (0 if all are). */
  before(x: number): number {
    let [low, high] = [0, this.x.length];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.x[middle] <= x) low = middle;
      else high = middle;
    }
    return low;
  }

  private dropWhatHasNoLogarithm(): void {
    const kept = this.x.map((x) => x > 0);
    if (kept.every(Boolean)) return;
    for (const values of [this.x, ...this.exact]) {
      const left = values.filter((_, i) => kept[i]);
      values.length = 0;
      values.push(...left);
    }
  }
}

function leastPositive(all: number[][]): number {
  let least = Infinity;
  for (const values of all) for (const value of values) if (value > 0 && value < least) least = value;
  return Number.isFinite(least) ? least : 1e-12;
}

/** The range of a linear axis around values, with air; of a constant one something to look at. */
export function airy(low: number, high: number): [number, number] {
  const size = Math.max(Math.abs(low), Math.abs(high));
  if (!(high - low > 1e-9 * size)) {
    const half = size > 0 ? 0.1 * size : 1;
    return [low - half, high + half];
  }
  const air = 0.07 * (high - low);
  return [low - air, high + air];
}

/** The range of a logarithmic axis around values; at least a third of a decade. `held`: nothing below the
 * least; `labelled`: room for a label there. */
export function airyLog(low: number, high: number, held: boolean, labelled = false): [number, number] {
  const [a, b] = [Math.log10(low), Math.log10(high)];
  const air = Math.max(0.06 * (b - a), 0.12);
  return [10 ** (held ? a : a - (labelled ? Math.max(air, 0.15 * (b - a), 0.15) : air)), 10 ** Math.max(b + air, a + 0.33)];
}

/** Ticks of a logarithmic axis: 1, 2, 5 in each decade if there are few decades, else every decade or some of them. */
export function logTicks(low: number, high: number, most: number): number[] {
  const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const decades = Math.log10(high / low);
  const within = (digits: number[], stride: number): number[] => {
    const ticks: number[] = [];
    for (let k = Math.ceil(first / stride) * stride; k <= last; k += stride)
      for (const digit of digits) ticks.push(Number(`${digit}e${k}`));
    return ticks.filter((tick) => tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9));
  };
  for (const digits of [[1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 2, 5], [1, 3]]) if (decades < 3 && within(digits, 1).length <= most) return within(digits, 1);
  for (let stride = 1; ; stride++) if (within([1], stride).length <= most || stride > 400) return within([1], stride);
}
