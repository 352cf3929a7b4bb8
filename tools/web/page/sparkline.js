// The last two minutes of a slow quantity: those that the server remembers, then the states that came while one looked.

import { drawing, setAttribute } from "./dom.js";

const WIDTH = 120;
const HEIGHT = 32;
const KEPT_S = 120;
const GAP_S = 10; // nobody looked, or the motor was silent: what was then is not known

export class Sparkline {
  constructor() {
    this.points = []; // {time in s, value}
    this.line = drawing("path", { class: "spark-line" });
    this.area = drawing("path", { class: "spark-area" });
    this.root = drawing(
      "svg",
      { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "spark", preserveAspectRatio: "none", "aria-hidden": "true" },
      this.area,
      this.line,
    );
  }

  // What the server remembers, a `trend` frame.
  begin({ utimes, values }) {
    this.points = [];
    utimes.forEach((utime, i) => this.add(utime, values[i]));
  }

  add(utime, value) {
    if (typeof value !== "number") return;
    const time = utime / 1e6;
    const last = this.points.at(-1);
    if (last && time < last.time) this.points = [];
    if (last && time === last.time) return;
    this.points.push({ time, value });
    while (this.points[0].time < time - KEPT_S) this.points.shift();
    this.#draw(time);
  }

  #draw(now) {
    const values = this.points.map((point) => point.value);
    const most = Math.max(...values, 0) * 1.1 || 1;
    const least = Math.min(...values, 0);
    const x = (time) => (WIDTH * (1 - (now - time) / KEPT_S)).toFixed(1);
    const y = (value) => (HEIGHT - 1 - ((value - least) / (most - least)) * (HEIGHT - 3)).toFixed(1);
    const outlines = this.#runs().map((run) => run.map((point) => `${x(point.time)} ${y(point.value)}`).join("L"));
    setAttribute(this.line, "d", outlines.map((outline) => `M${outline}`).join(""));
    const areas = this.#runs().map(
      (run, i) => `M${outlines[i]}L${x(run.at(-1).time)} ${HEIGHT}L${x(run[0].time)} ${HEIGHT}z`,
    );
    setAttribute(this.area, "d", areas.join(""));
  }

  // The points in stretches without a gap.
  #runs() {
    const runs = [];
    let before = -Infinity;
    for (const point of this.points) {
      if (point.time - before > GAP_S) runs.push([]);
      runs.at(-1).push(point);
      before = point.time;
    }
    return runs;
  }
}
