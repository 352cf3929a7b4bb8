// The last minute or two of a slow quantity, from the states that came.

import { drawing, setAttribute } from "./dom.js";

const WIDTH = 120;
const HEIGHT = 32;
const KEPT_S = 120;

export class Sparkline {
  constructor() {
    this.points = []; // {time in s, value}
    this.line = drawing("path", { class: "spark-line" });
    this.area = drawing("path", { class: "spark-area" });
    this.end = drawing("circle", { class: "spark-end", r: 2.2 });
    this.root = drawing(
      "svg",
      { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "spark", preserveAspectRatio: "none", "aria-hidden": "true" },
      this.area,
      this.line,
    );
  }

  add(utime, value) {
    const time = utime / 1e6;
    const last = this.points.at(-1);
    if (last && time < last.time) this.points = [];
    if (last && time === last.time) return;
    this.points.push({ time, value });
    while (this.points[0].time < time - KEPT_S) this.points.shift();
    this.#draw(time);
  }

  #draw(now) {
    const known = this.points.filter((point) => typeof point.value === "number");
    if (known.length < 2) return;
    const most = Math.max(...known.map((point) => point.value), 0) * 1.1 || 1;
    const least = Math.min(...known.map((point) => point.value), 0);
    const place = ({ time, value }) =>
      `${(WIDTH * (1 - (now - time) / KEPT_S)).toFixed(1)} ${(HEIGHT - 1 - ((value - least) / (most - least)) * (HEIGHT - 3)).toFixed(1)}`;
    const line = `M${known.map(place).join("L")}`;
    setAttribute(this.line, "d", line);
    const left = (WIDTH * (1 - (now - known[0].time) / KEPT_S)).toFixed(1);
    setAttribute(this.area, "d", `${line}L${WIDTH} ${HEIGHT}L${left} ${HEIGHT}z`);
  }
}
