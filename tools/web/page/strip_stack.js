// Strips above one another with one axis of time: follows the newest, is paused, panned and zoomed by pointer, touch, keys
// and buttons. Draws only when something has moved by a pixel.

import { element, setAttribute, setHidden, setText } from "./dom.js";
import { picture } from "./icons.js";
import { duration, timeOfDay } from "./numbers.js";
import { Strip, hasCurves } from "./strip.js";
import { TimeWindow } from "./time_window.js";

const BEHIND_S = 0.12; // the right edge is as old as the newest readings are on their way
const LONGEST_S = 600;
const SPANS = [2, 5, 10, 30, 60, 120, 300, 600];
const DRAW_EVERY_MS = 30;
const ZOOM_STEP = 0.7;
const LEAST_HEIGHT = 104;
const TIME_HEIGHT = 26;
const MOST_HEIGHT = 420;
const NO_CURVES =
  "This build draws no curves: uPlot was not there when axlecast was built. Everything else works. " +
  "To add them, build again with -DAXLECAST_UPLOT=npm or -DAXLECAST_UPLOT=FOLDER; docs/web.md describes both.";

export class StripStack {
  // `time`: {now(): the server's instant in s, 0 unknown; speed(): of its time against ours}.
  // `spans`: choices of the time shown, in s; `longest`: the most of it; `behind`: how old the right edge is.
  constructor(machine, time, { spans = SPANS, longest = LONGEST_S, behind = BEHIND_S } = {}) {
    this.machine = machine;
    this.time = time;
    this.spans = spans;
    this.behind = behind;
    this.window = new TimeWindow(10, longest);
    this.strips = [];
    this.channels = [];
    this.cursorShare = null; // place of the cursor, 0 left to 1 right
    this.pointers = new Map();
    this.stale = true;
    this.drawnMs = 0;
    this.body = element("div.strips", {
      tabIndex: 0,
      role: "group",
      "aria-label":
        "Strip charts. Space: pause. Arrow keys: move. Plus and minus: zoom. Comma and full stop: cursor. End: newest.",
    });
    this.empty = element("p.empty", {}, hasCurves ? "No channel chosen." : NO_CURVES);
    this.root = element("div.strip-stack", {}, this.#makeTools(), this.body, this.empty);
    this.root.classList.toggle("without-curves", !hasCurves);
    this.#listen();
    new ResizeObserver(() => this.#layOut()).observe(this.body);
  }

  get now() {
    return this.time.now() - this.behind * Math.max(1, this.time.speed());
  }

  #button(name, label, act) {
    const button = element(
      "button.square",
      { type: "button", title: label, "aria-label": label, "data-act": name },
      picture(name),
    );
    button.addEventListener("click", act);
    return button;
  }

  #makeTools() {
    this.pause = element("button.primary", { type: "button", "data-act": "pause" });
    this.pause.addEventListener("click", () => this.togglePause());
    this.span = element("select", { "aria-label": "Time shown", "data-act": "span" });
    this.span.addEventListener("change", () =>
      this.#change(() =>
        this.window.zoom(Number(this.span.value) / this.window.span, this.window.right(this.now), this.now),
      ),
    );
    this.where = element("p.where", { role: "status" });
    return element(
      "div.tools",
      { role: "toolbar", "aria-label": "Charts" },
      this.pause,
      this.span,
      element(
        "span.group",
        {},
        this.#button("back", "Move back", () => this.#pan(-0.25)),
        this.#button("forth", "Move forth", () => this.#pan(0.25)),
      ),
      element(
        "span.group",
        {},
        this.#button("farther", "Zoom out", () => this.#zoom(1 / ZOOM_STEP)),
        this.#button("closer", "Zoom in", () => this.#zoom(ZOOM_STEP)),
      ),
      this.where,
    );
  }

  // The channels to show, in their order.
  show(wantedChannels) {
    const channels = hasCurves ? wantedChannels : [];
    const wanted = new Set(channels.map((channel) => channel.key));
    const known = new Map(this.strips.map((strip) => [strip.channel.key, strip]));
    for (const [key, strip] of known) if (!wanted.has(key)) strip.destroy();
    const isTail = this.channels.at(-1)?.key !== channels.at(-1)?.key;
    this.channels = channels;
    if (isTail) for (const strip of known.values()) strip.destroy(); // another strip carries the axis of time
    this.strips = channels.map((channel, index) => {
      const kept = isTail ? undefined : known.get(channel.key);
      return kept ?? new Strip(channel, { width: 600, height: LEAST_HEIGHT, withTime: index === channels.length - 1 });
    });
    this.body.append(...this.strips.map((strip) => strip.root));
    setHidden(this.empty, channels.length > 0);
    this.#layOut();
    this.recolour();
  }

  recolour() {
    for (const strip of this.strips) strip.readColours();
    this.stale = true;
  }

  #layOut() {
    const place = this.strips[0]?.plotPlace;
    if (!place || place.clientWidth === 0) return;
    const room = this.body.clientHeight - TIME_HEIGHT - this.strips.length;
    const height = Math.floor(Math.min(MOST_HEIGHT, Math.max(LEAST_HEIGHT, room / this.strips.length)));
    this.strips.forEach((strip, index) =>
      strip.resize(place.clientWidth, height + (index === this.strips.length - 1 ? TIME_HEIGHT : 0)),
    );
    this.stale = true;
  }

  togglePause() {
    this.#change(() => (this.window.following ? this.window.hold(this.now) : this.window.follow()));
  }

  follow() {
    this.#change(() => this.window.follow());
  }

  #change(act) {
    act();
    this.stale = true;
  }

  #pan(share) {
    this.#change(() => this.window.pan(share * this.window.span, this.now));
  }

  #zoom(factor, share = this.cursorShare ?? (this.window.following ? 1 : 0.5)) {
    const now = this.now;
    this.#change(() => this.window.zoom(factor, this.window.left(now) + share * this.window.span, now));
  }

  // -- drawing

  // Samples of a device, or of one channel alone.
  #samplesOf({ channel }) {
    return this.machine.samples.get(channel.source ?? channel.device);
  }

  // Once a frame, of which `frameMs` is the time. Thirty pictures a second are smooth, and leave a tablet its battery.
  draw(frameMs) {
    if (this.strips.length === 0 || this.time.now() === 0) return;
    if (!this.stale && frameMs - this.drawnMs < DRAW_EVERY_MS) return;
    const now = this.now;
    const width = this.strips[0].plot.bbox.width;
    const pixel = this.window.span / Math.max(1, width);
    const right = Math.floor(this.window.right(now) / pixel) * pixel;
    const version = this.strips.reduce(
      (sum, strip) => sum + (this.#samplesOf(strip)?.version ?? 0),
      0,
    );
    const isNew = this.stale || right !== this.right || version !== this.version;
    if (!isNew) return;
    this.drawnMs = frameMs;
    this.right = right;
    this.version = version;
    this.stale = false;
    const from = right - this.window.span;
    for (const strip of this.strips) {
      strip.draw(
        this.#samplesOf(strip),
        from,
        right,
        this.machine.stateOf.device.get(strip.channel.device)?.max_age_us,
      );
    }
    this.#read(from, now);
  }

  #read(from, now) {
    const cursor = this.cursorShare === null ? null : from + this.cursorShare * this.window.span;
    for (const strip of this.strips) strip.read(cursor);
    const held = this.window.following ? "Follows the newest" : `Held ${duration((now - this.window.end) * 1e6)} ago`;
    const at = cursor === null ? "" : ` · cursor ${timeOfDay(Math.round(cursor * 1e6), 3)}`;
    setText(this.where, held + at);
    this.#showTools();
  }

  #showTools() {
    const { following, span } = this.window;
    if (this.shownFollowing !== following) {
      this.shownFollowing = following;
      this.pause.replaceChildren(
        picture(following ? "pause" : "live"),
        element("span", {}, following ? "Pause" : "Go to newest"),
      );
      setAttribute(this.root, "data-following", following);
    }
    if (this.shownSpan === span) return;
    this.shownSpan = span;
    setAttribute(this.root, "data-span", span.toFixed(3));
    const choices = this.spans.includes(span) ? this.spans : [...this.spans, span].sort((a, b) => a - b);
    this.span.replaceChildren(
      ...choices.map((choice) =>
        element("option", { value: String(choice), selected: choice === span }, spanText(choice)),
      ),
    );
  }

  // -- pointer, touch and keys

  #share(event) {
    const rect = this.strips[0].plot.over.getBoundingClientRect();
    return (event.clientX - rect.left) / rect.width;
  }

  #listen() {
    const { body } = this;
    body.addEventListener(
      "wheel",
      (event) => {
        if (!event.target.closest(".strip-plot")) return;
        event.preventDefault();
        this.#zoom(1.0015 ** event.deltaY, this.window.following ? 1 : this.#share(event));
      },
      { passive: false },
    );
    body.addEventListener("pointerdown", (event) => this.#press(event));
    body.addEventListener("pointermove", (event) => this.#move(event));
    for (const end of ["pointerup", "pointercancel"])
      body.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    body.addEventListener("pointerleave", () => this.#setCursor(null));
    body.addEventListener("dblclick", () => this.follow());
    body.addEventListener("keydown", (event) => this.#key(event));
  }

  #press(event) {
    if (event.button !== 0 || !event.target.closest(".strip-plot")) return;
    this.pointers.set(event.pointerId, this.#share(event));
    this.body.setPointerCapture(event.pointerId);
  }

  #move(event) {
    if (this.strips.length === 0) return;
    const share = this.#share(event);
    const before = this.pointers.get(event.pointerId);
    if (before !== undefined && share !== before) {
      const others = [...this.pointers].filter(([id]) => id !== event.pointerId);
      if (others.length === 0) this.#pan(before - share);
      else this.#pinch(others[0][1], before, share);
      this.pointers.set(event.pointerId, share);
    }
    this.#setCursor(share >= 0 && share <= 1 ? share : null);
  }

  #pinch(still, before, share) {
    const apart = Math.abs(share - still);
    if (apart > 0.02) this.#zoom(Math.abs(before - still) / apart, still);
  }

  #setCursor(share) {
    if (share === this.cursorShare) return;
    this.cursorShare = share;
    this.stale = true;
  }

  #key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const acts = {
      " ": () => this.togglePause(),
      ArrowLeft: () => this.#pan(event.shiftKey ? -0.5 : -0.1),
      ArrowRight: () => this.#pan(event.shiftKey ? 0.5 : 0.1),
      "+": () => this.#zoom(ZOOM_STEP),
      "=": () => this.#zoom(ZOOM_STEP),
      "-": () => this.#zoom(1 / ZOOM_STEP),
      End: () => this.follow(),
      ",": () => this.#setCursor(Math.max(0, (this.cursorShare ?? 1) - 0.01)),
      ".": () => this.#setCursor(Math.min(1, (this.cursorShare ?? 0) + 0.01)),
      Escape: () => this.#setCursor(null),
    };
    if (!(event.key in acts)) return;
    event.preventDefault();
    acts[event.key]();
  }
}

function spanText(span) {
  if (span >= 86400 && span % 86400 === 0) return `${span / 86400} d`;
  if (span >= 3600 && span % 3600 === 0) return `${span / 3600} h`;
  if (span >= 60 && span % 60 === 0) return `${span / 60} min`;
  return span >= 10 || Number.isInteger(span) ? `${Math.round(span)} s` : `${span.toFixed(2)} s`;
}
