// Which stretch of time the charts show, in seconds: either the last `span` up to now (following), or one that was held by
// pausing, panning or zooming into the past.

export const SHORTEST = 0.05;

export class TimeWindow {
  constructor(span, longest) {
    this.longest = longest;
    this.span = span;
    this.end = null; // null: follows
  }

  get following() {
    return this.end === null;
  }

  // The right edge, given the newest instant there is.
  right(now) {
    return this.end ?? now;
  }

  left(now) {
    return this.right(now) - this.span;
  }

  hold(now) {
    this.end ??= now;
  }

  follow() {
    this.end = null;
  }

  // Zooms by `factor` (below 1: closer) around `anchor`, which keeps its place. While following, the right edge keeps its.
  zoom(factor, anchor, now) {
    const span = Math.min(this.longest, Math.max(SHORTEST, this.span * factor));
    if (this.end !== null) this.end = anchor + ((this.end - anchor) * span) / this.span;
    this.span = span;
    this.#stopAt(now);
  }

  // Moves by `seconds` (below 0: into the past) and holds. Beyond now there is nothing.
  pan(seconds, now) {
    this.end = this.right(now) + seconds;
    this.#stopAt(now);
  }

  show(from, to) {
    this.span = Math.min(this.longest, Math.max(SHORTEST, to - from));
    this.end = to;
  }

  #stopAt(now) {
    if (this.end !== null) this.end = Math.min(this.end, now);
  }
}
