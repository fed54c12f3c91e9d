/** Lines across a plot, with labels where they hide least. */
import type uPlot from "uplot";
import { styled } from "./theme";

/** A line across the plot, with a label above or below it (preferably so) where it lies over the fewest curves. */
export function across(u: uPlot, y: number, color: string, dash: number[], label: string, below: boolean): void {
  const { ctx } = u;
  const ratio = devicePixelRatio;
  ctx.strokeStyle = ctx.fillStyle = color;
  ctx.lineWidth = ratio;
  ctx.setLineDash(dash.map((length) => length * ratio));
  ctx.beginPath();
  ctx.moveTo(u.bbox.left, y);
  ctx.lineTo(u.bbox.left + u.bbox.width, y);
  ctx.stroke();
  if (!label) return;
  const width = ctx.measureText(label).width + 8 * ratio;
  const [first, room] = [u.bbox.left + 4 * ratio, Math.max(0, u.bbox.width - width - 8 * ratio)];
  const sides = [below, !below].filter((under) => (under ? y + 16 * ratio < u.bbox.top + u.bbox.height : y - 16 * ratio > u.bbox.top));
  let [best, x, under] = [Infinity, first + room, below];
  for (const side of sides.length ? sides : [below])
    for (const share of [1, 0, 0.5, 0.75, 0.25]) {
      const covered = pointsIn(u, first + share * room, side ? y + ratio : y - 15 * ratio, width, 14 * ratio);
      if (covered < best) [best, x, under] = [covered, first + share * room, side];
    }
  x += 4 * ratio;
  const base = y + (under ? 3 : -2) * ratio;
  ctx.textAlign = "left";
  ctx.textBaseline = under ? "top" : "bottom";
  ctx.setLineDash([]);
  ctx.strokeStyle = styled("--sheet");
  ctx.lineWidth = 3 * ratio;
  ctx.lineJoin = "round";
  ctx.strokeText(label, x, base);
  ctx.fillText(label, x, base);
}

/** How many points of the curves that are shown lie in a box of the canvas. */
function pointsIn(u: uPlot, left: number, top: number, width: number, height: number): number {
  const from = Math.max(0, u.valToIdx(u.posToVal(left, "x", true)) - 1);
  const to = Math.min(u.data[0].length - 1, u.valToIdx(u.posToVal(left + width, "x", true)) + 1);
  let count = 0;
  for (let k = 1; k < u.data.length; k++) {
    if (!u.series[k].show) continue;
    for (let i = from; i <= to; i++) {
      const value = u.data[k]![i];
      const y = value === null || value === undefined ? NaN : u.valToPos(value, "y", true);
      if (y >= top && y <= top + height) count++;
    }
  }
  return count;
}

/** Whether a value lies in the part of y that is shown. */
export function within(u: uPlot, value: number): boolean {
  const y = u.valToPos(value, "y", true);
  return y >= u.bbox.top - 1 && y <= u.bbox.top + u.bbox.height + 1;
}
