// Signs that differ in shape, not in colour alone. Severities: octagon, diamond, triangle, circle. Each is drawn in a square
// of 16 and takes its colours from the style sheet.

import { drawing } from "./dom.js";
import { severityWord, stateLook, stateWord } from "./words.js";

const SHAPES = {
  critical: ["M5 1h6l4 4v6l-4 4H5l-4-4V5z", "M8 4v5M8 11.2v.6"],
  error: ["M8 .7 15.3 8 8 15.3.7 8z", "M8 4.2v4.6M8 11v.6"],
  warning: ["M8 1.2 15.4 14.6H.6z", "M8 6v4M8 12v.6"],
  info: ["M8 1a7 7 0 1 1 0 14A7 7 0 1 1 8 1z", "M8 7.3v4.2M8 4.3v.6"],
};

const STATES = {
  good: "M8 2a6 6 0 1 1 0 12A6 6 0 1 1 8 2zM5.2 8.2l2 2 3.6-4.2",
  starting: "M8 2a6 6 0 0 1 6 6M8 14a6 6 0 0 1-6-6",
  warning: "M8 2.4 14.4 13.8H1.6zM8 6.6v3.6M8 11.8v.5",
  bad: "M8 2a6 6 0 1 1 0 12A6 6 0 1 1 8 2zM5.6 5.6l4.8 4.8M10.4 5.6l-4.8 4.8",
  silent: "M3 8h2M7 8h2M11 8h2",
};

const PICTURES = {
  pause: "M5 3v10M11 3v10",
  play: "M4.5 2.5v11l9-5.5z",
  live: "M3 3v10M6 8h7M10 4.5 13.5 8 10 11.5",
  closer: "M7 2.5a4.5 4.5 0 1 1 0 9 4.5 4.5 0 1 1 0-9zM10.5 10.5 14 14M5 7h4M7 5v4",
  farther: "M7 2.5a4.5 4.5 0 1 1 0 9 4.5 4.5 0 1 1 0-9zM10.5 10.5 14 14M5 7h4",
  back: "M10 3 5 8l5 5",
  forth: "M6 3l5 5-5 5",
  close: "M4 4l8 8M12 4l-8 8",
  sun: "M8 5a3 3 0 1 1 0 6 3 3 0 1 1 0-6zM8 1v1.5M8 13.5V15M1 8h1.5M13.5 8H15M3 3l1 1M12 12l1 1M13 3l-1 1M4 12l-1 1",
  moon: "M13 9.6A5.5 5.5 0 1 1 6.4 3a4.5 4.5 0 0 0 6.6 6.6z",
  auto: "M8 2a6 6 0 1 1 0 12zM8 2a6 6 0 1 0 0 12",
  chart: "M2 13.5h12M2.5 10l3-4 3 2.5 5-6",
  clockwise: "M12.8 5.5A5.5 5.5 0 1 0 13.5 9M13.5 2.5v3.2h-3.2",
};

function svg(name, ...children) {
  return drawing(
    "svg",
    { viewBox: "0 0 16 16", class: `icon icon-${name}`, "aria-hidden": "true", focusable: "false" },
    ...children,
  );
}

export function picture(name) {
  return svg(name, drawing("path", { d: PICTURES[name], class: "stroke" }));
}

export function severitySign(severity) {
  const [shape, mark] = SHAPES[severity] ?? SHAPES.info;
  const sign = svg(
    `severity ${severity}`,
    drawing("path", { d: shape, class: "shape" }),
    drawing("path", { d: mark, class: "mark" }),
  );
  sign.removeAttribute("aria-hidden");
  sign.setAttribute("role", "img");
  sign.setAttribute("aria-label", severityWord(severity));
  return sign;
}

// A state's sign alone, where a row has no place for the word.
export class StateSign {
  constructor() {
    this.root = document.createElement("span");
    this.look = undefined;
  }

  show(look) {
    if (this.look === look) return;
    this.look = look;
    this.root.className = `state state-${look}`;
    this.root.replaceChildren(svg("state", drawing("path", { d: STATES[look], class: "stroke" })));
  }
}

// A state's sign and word, to be told of changes.
export class StateBadge {
  constructor() {
    this.root = document.createElement("span");
    this.look = undefined;
  }

  update(state) {
    this.show(stateLook(state), stateWord(state));
  }

  show(look, word) {
    if (this.look === look && this.word === word) return;
    this.look = look;
    this.word = word;
    this.root.className = `state state-${look}`;
    this.root.replaceChildren(svg("state", drawing("path", { d: STATES[look], class: "stroke" })), word);
  }
}
