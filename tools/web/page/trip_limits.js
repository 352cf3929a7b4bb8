// How far a motor is from each limit that trips it: the reading, the limit, and what is left.

import { KeyedList, element, setAttribute, setHidden, setText } from "./dom.js";
import { UNKNOWN, duration, quantity } from "./numbers.js";
import { limitWord } from "./words.js";

const HEADINGS = ["Trips", "Now", "Limit", "Left"];

// The texts of one row of the `margins` in a `state` frame. A limit of 0 never trips.
export function limitTexts({ name, unit, measured, limit, margin }) {
  return {
    label: `${limitWord(name)}, ${unit}`,
    now: quantity(measured, unit),
    limit: limit === 0 ? "Off" : quantity(limit, unit),
    left: limit === 0 ? UNKNOWN : quantity(margin, unit),
    isBeyond: typeof margin === "number" && margin < 0,
  };
}

class LimitRow {
  constructor() {
    this.label = element("th", { scope: "row" });
    this.cells = ["now", "limit", "left"].map((name) => [name, element("td")]);
    this.root = element("tr", {}, this.label, ...this.cells.map(([, cell]) => cell));
  }

  update(margin) {
    const texts = limitTexts(margin);
    setText(this.label, texts.label);
    for (const [name, cell] of this.cells) setText(cell, texts[name]);
    setAttribute(this.root, "data-limit", margin.name);
    setAttribute(this.root, "data-beyond", texts.isBeyond ? "true" : null);
  }
}

export class TripLimits {
  constructor() {
    const body = element("tbody");
    this.rows = new KeyedList(
      body,
      (margin) => margin.name,
      () => new LimitRow(),
    );
    const headings = HEADINGS.map((text) => element("th", { scope: "col" }, text));
    this.table = element("table.limits", {}, element("thead", {}, element("tr", {}, ...headings)), body);
    this.note = element("p.limits-note");
    this.root = element("section.panel", { hidden: true }, element("h3", {}, "Trip limits"), this.table, this.note);
  }

  // `limits` of a device's state; undefined for a device that has none.
  update(limits, now) {
    setHidden(this.root, limits === undefined);
    setHidden(this.table, !limits);
    this.rows.update(limits?.margins ?? []);
    setText(
      this.note,
      limits ? `Limits received ${duration(now - limits.heard_utime)} ago` : "Not received yet: they come once a minute.",
    );
  }
}
