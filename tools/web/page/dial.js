// A shaft's angle as a needle. Where the shaft turns faster than a few looks a second can follow, a needle would show a
// motion that there is not: then the ring says only in which direction it turns.

import { drawing, setAttribute } from "./dom.js";

const FOLLOWED_RPM = 45; // at four looks a second at most 70 degrees between two

export class Dial {
  constructor() {
    this.needle = drawing("path", { class: "needle", d: "M32 36V10" });
    this.turning = drawing("path", {
      class: "turning",
      d: "M32 11a21 21 0 0 1 18.2 10.5M50.2 21.5l.6-6.4M50.2 21.5l-5.6-2.8",
    });
    const again = drawing("path", {
      class: "turning",
      d: "M32 53a21 21 0 0 1-18.2-10.5M13.8 42.5l-.6 6.4M13.8 42.5l5.6 2.8",
    });
    this.arrows = drawing("g", {}, this.turning, again);
    const marks = Array.from({ length: 12 }, (_, hour) =>
      drawing("path", {
        class: hour % 3 === 0 ? "mark main" : "mark",
        d: hour % 3 === 0 ? "M32 4v5" : "M32 4v3",
        transform: `rotate(${hour * 30} 32 32)`,
      }),
    );
    this.root = drawing(
      "svg",
      { viewBox: "0 0 64 64", class: "dial", "aria-hidden": "true", focusable: "false" },
      drawing("circle", { class: "face", cx: 32, cy: 32, r: 30 }),
      ...marks,
      this.arrows,
      this.needle,
      drawing("circle", { class: "hub", cx: 32, cy: 32, r: 3.5 }),
    );
  }

  // Counter-clockwise is positive, as the shaft's end is looked at; 0 is up.
  update(angleDeg, speedRpm) {
    const known = typeof angleDeg === "number";
    const fast = typeof speedRpm === "number" && Math.abs(speedRpm) > FOLLOWED_RPM;
    setAttribute(this.needle, "visibility", known && !fast ? "visible" : "hidden");
    setAttribute(this.arrows, "visibility", known && fast ? "visible" : "hidden");
    if (known && !fast) setAttribute(this.needle, "transform", `rotate(${(-angleDeg).toFixed(1)} 32 32)`);
    if (fast) setAttribute(this.arrows, "transform", speedRpm > 0 ? "matrix(-1 0 0 1 64 0)" : "");
  }
}
