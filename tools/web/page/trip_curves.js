// The recorded curves of a trip: a panel for each quantity, the trip at the right end, older trips of the same motor behind it.

import { drawing, element, setAttribute, setText } from "./dom.js";
import { fixed, quantity, unitText } from "./numbers.js";
import { columnWord } from "./words.js";

const WIDTH = 250;
const HEIGHT = 136;
const GUTTER = 58; // for the scale
const LAST = 19;

const x = (index) => (index / LAST) * WIDTH;

// Loads are seen against nothing; of the rest the change matters, but not each flicker of it.
const LEAST_SPAN = { V: 20, "°C": 5, "m/s²": 2 };

function rangeOf(values, unit) {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  if (!(unit in LEAST_SPAN)) return [Math.min(0, low), Math.max(high, 1e-3)];
  const spare = Math.max(0, LEAST_SPAN[unit] - (high - low)) / 2;
  return [low - spare, high + spare];
}

class Panel {
  constructor(name, unit, curves, seconds) {
    const known = curves.flat().filter((value) => typeof value === "number");
    const [low, high] = rangeOf(known, unit);
    const pad = (high - low) * 0.08;
    this.unit = unit;
    this.samples = curves[0];
    this.y = (value) => HEIGHT - ((value - low + pad) / (high - low + 2 * pad)) * HEIGHT;
    this.reading = element("span.number");
    this.dot = drawing("circle", { class: "dot", r: 4 });
    this.cursor = drawing("path", { class: "cursor" });
    const older = curves.slice(1).map((curve) => drawing("path", { class: "older", d: this.#outline(curve) }));
    const labels = [high, low].map((value) =>
      drawing("text", { class: "scale", x: -6, y: this.y(value) + 4, "text-anchor": "end" }, quantity(value, unit)),
    );
    this.picture = drawing(
      "svg",
      {
        viewBox: `${-GUTTER} 0 ${GUTTER + WIDTH + 8} ${HEIGHT + 18}`,
        class: "trip-curve",
        role: "img",
        "aria-label": `${columnWord(name)}: ${quantity(this.samples[LAST], unit)} ${unit} at the trip`,
      },
      drawing("path", { class: "base", d: `M0 ${this.y(low).toFixed(1)}H${WIDTH}` }),
      ...labels,
      ...older,
      drawing("path", { class: "curve", d: this.#outline(this.samples) }),
      this.cursor,
      this.dot,
      drawing("text", { class: "scale", x: 0, y: HEIGHT + 14 }, `${fixed(-LAST * seconds, 1)} s`),
      drawing("text", { class: "scale", x: WIDTH, y: HEIGHT + 14, "text-anchor": "end" }, "trip"),
    );
    this.root = element(
      "figure.trip-panel",
      { "data-quantity": name },
      element(
        "figcaption",
        {},
        element("span", {}, columnWord(name)),
        element("span.reading", {}, this.reading, element("span.unit", {}, unitText(unit))),
      ),
      this.picture,
    );
    this.point(LAST);
  }

  #outline(curve) {
    let path = "";
    let penDown = false;
    curve.forEach((value, index) => {
      const known = typeof value === "number";
      if (known) path += `${penDown ? "L" : "M"}${x(index).toFixed(1)} ${this.y(value).toFixed(1)}`;
      penDown = known;
    });
    return path;
  }

  point(index) {
    const value = this.samples[index];
    const known = typeof value === "number";
    setText(this.reading, quantity(value, this.unit));
    setAttribute(this.dot, "visibility", known ? "visible" : "hidden");
    setAttribute(this.cursor, "d", `M${x(index).toFixed(1)} 0V${HEIGHT}`);
    if (!known) return;
    setAttribute(this.dot, "cx", x(index).toFixed(1));
    setAttribute(this.dot, "cy", this.y(value).toFixed(1));
  }
}

export class TripCurves {
  // `trip` and `older` are trip frames; `index` is the sample that is read out at first.
  constructor(trip, older, index = LAST) {
    this.seconds = trip.interval_us / 1e6;
    this.panels = trip.quantities.flatMap(({ name, unit }, i) => {
      const curves = [trip, ...older].map((each) => each.samples[i]).filter((samples) => samples !== null);
      return trip.samples[i] ? [new Panel(name, unit, curves, this.seconds)] : [];
    });
    this.where = element("p.where", { role: "status" });
    this.grid = element(
      "div.trip-panels",
      { tabIndex: 0, role: "group", "aria-label": "Curves of the trip. Arrow keys move the read-out." },
      ...this.panels.map((panel) => panel.root),
    );
    this.root = element("div", {}, this.where, this.grid);
    this.#point(index);
    this.grid.addEventListener("pointermove", (event) => this.#follow(event));
    this.grid.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (step) this.#point(this.index + step);
    });
  }

  #follow(event) {
    const picture = event.target.closest(".trip-curve");
    if (!picture) return;
    const rect = picture.getBoundingClientRect();
    this.#point(
      Math.round(((((event.clientX - rect.left) / rect.width) * (GUTTER + WIDTH + 8) - GUTTER) / WIDTH) * LAST),
    );
  }

  #point(index) {
    this.index = Math.max(0, Math.min(LAST, index));
    for (const panel of this.panels) panel.point(this.index);
    const before = (LAST - this.index) * this.seconds;
    setText(this.where, this.index === LAST ? "At the trip" : `${fixed(before, 1)} s before the trip`);
  }
}
