import { decimalsOf, fixed } from "./dom";

export const SPEEDS = [0.25, 0.5, 1, 2, 4, 8];

const STEPS_PER_SECOND = 10; // of a clock that counts, at speed 1
const UNHURRIED = 25; // [s] that playing takes at most at the speed that is set first
const TICK = 1 / 100; // of the duration: what an arrow key steps

/** The time that is shown, in a view's unit; it runs while it plays. */
export class Clock {
  t = 0;
  playing = false;
  speed = 1;
  repeat = false;
  unit = "s";
  duration = 0;
  whole = false;
  speeds = SPEEDS;
  private frame = 0;
  private last = 0;
  private exact = 0;

  constructor(private readonly changed: (t: number) => void, private readonly state: () => void) {}

  begin(clock: { unit: string; duration: number; step?: number }): void {
    this.pause();
    this.unit = clock.unit;
    this.duration = clock.duration;
    this.whole = clock.step !== undefined;
    const length = this.duration / this.rate;
    this.speeds = SPEEDS.concat([16, 32, 64, 128].filter((speed) => length / speed > UNHURRIED / 2));
    this.speed = this.speeds.find((speed) => speed >= 1 && length / speed <= UNHURRIED) ?? this.speeds[this.speeds.length - 1];
    this.state();
    this.seek(0);
  }

  /** Units of the clock that pass in a second at speed 1. */
  private get rate(): number {
    return this.whole ? STEPS_PER_SECOND : this.unit === "min" ? 1 / 60 : 1;
  }

  seek(t: number): void {
    this.exact = Math.min(this.duration, Math.max(0, Number.isNaN(t) ? 0 : t));
    this.t = this.whole ? Math.round(this.exact) : this.exact;
    this.changed(this.t);
  }

  /** Goes on or back by steps; by infinitely many to an end. */
  step(count: number): void {
    this.pause();
    const step = this.whole ? 1 : this.duration * TICK;
    this.seek(Number.isFinite(count) ? this.t + count * step : count);
  }

  toggle(): void {
    if (this.playing) this.pause();
    else this.play();
  }

  play(): void {
    if (this.playing || this.duration <= 0) return;
    if (this.t >= this.duration) this.seek(0);
    this.playing = true;
    this.last = performance.now();
    this.frame = requestAnimationFrame((now) => this.run(now));
    this.state();
  }

  pause(): void {
    if (!this.playing) return;
    this.playing = false;
    cancelAnimationFrame(this.frame);
    this.state();
  }

  setSpeed(speed: number): void {
    this.speed = speed;
    this.state();
  }

  faster(by: 1 | -1): void {
    const at = this.speeds.indexOf(this.speed) + by;
    this.setSpeed(this.speeds[Math.min(this.speeds.length - 1, Math.max(0, at))]);
  }

  setRepeat(on: boolean): void {
    this.repeat = on;
    this.state();
  }

  private run(now: number): void {
    const passed = (Math.max(0, now - this.last) / 1000) * this.speed * this.rate;
    this.last = now;
    const next = this.exact + passed;
    if (next >= this.duration && !this.repeat) {
      this.pause();
      this.seek(this.duration);
      return;
    }
    this.seek(next >= this.duration ? 0 : next);
    this.frame = requestAnimationFrame((later) => this.run(later));
  }

  text(t: number): string {
    return fixed(t, this.whole ? 0 : Math.min(4, Math.max(2, decimalsOf(this.duration))));
  }
}
