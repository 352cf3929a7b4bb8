// The place in a log: slider, play and pause, speed.

import { element, setAttribute, setHidden, setText } from "./dom.js";
import { encode } from "./frames.js";
import { picture } from "./icons.js";
import { dateText, duration, timeOfDay } from "./numbers.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 30, 100];
const SEEK_EVERY_MS = 150; // while the slider is dragged

export class PlaybackBar {
  // `send(text)` goes to the server; `clock.at(ms)` is the log's time.
  constructor(machine, clock, send) {
    this.machine = machine;
    this.clock = clock;
    this.send = send;
    this.dragging = false;
    this.play = element("button.primary.square", { type: "button", "data-act": "play", "aria-label": "Play" });
    this.slider = element("input", {
      type: "range",
      min: 0,
      max: 1,
      step: 0.01,
      value: 0,
      "aria-label": "Place in the log",
    });
    this.place = element("output.place");
    this.ends = element("span.log-name");
    this.speed = element(
      "select",
      { "aria-label": "Speed" },
      ...SPEEDS.map((factor) => element("option", { value: String(factor), selected: factor === 1 }, `${factor} ×`)),
    );
    this.root = element(
      "div.playback",
      { hidden: true, role: "group", "aria-label": "Log" },
      this.play,
      this.place,
      this.slider,
      this.ends,
      this.speed,
    );
    this.play.addEventListener("click", () => send(this.machine.playback?.playing ? encode.pause() : encode.play()));
    this.speed.addEventListener("change", () => send(encode.speed(Number(this.speed.value))));
    this.slider.addEventListener("input", () => this.#drag());
    this.slider.addEventListener("change", () => this.#release());
  }

  #drag() {
    this.dragging = true;
    this.wanted = this.first + Number(this.slider.value) * 1e6;
    this.#show(this.wanted);
    this.waiting ??= setTimeout(() => this.#seek(), SEEK_EVERY_MS);
  }

  #release() {
    this.dragging = false;
    this.#seek();
  }

  #seek() {
    clearTimeout(this.waiting);
    this.waiting = undefined;
    if (this.wanted === undefined) return;
    this.send(encode.seek(this.wanted));
    this.wanted = undefined;
  }

  get first() {
    return this.machine.hello?.log?.first_utime ?? 0;
  }

  update() {
    const log = this.machine.hello?.mode === "log" ? this.machine.hello.log : null;
    setHidden(this.root, !log);
    if (!log) return;
    const length = (log.last_utime - log.first_utime) / 1e6;
    this.length = length;
    setAttribute(this.slider, "max", length.toFixed(2));
    setText(this.ends, `of ${duration(length * 1e6)} · ${log.files.join(", ")}`);
    const { playback } = this.machine;
    if (!playback) return;
    this.#showPlay(playback.playing);
    if (document.activeElement !== this.speed && Number(this.speed.value) !== playback.speed)
      this.speed.value = String(playback.speed);
    setAttribute(this.root, "data-seeking", playback.seeking ? "true" : null);
  }

  // Once a frame.
  draw(nowMs) {
    if (this.root.hidden || this.dragging || !this.machine.playback) return;
    const utime = Math.min(this.clock.at(nowMs), this.machine.hello.log.last_utime);
    const tenths = Math.floor(utime / 1e5);
    if (tenths === this.tenths) return;
    this.tenths = tenths;
    this.slider.value = String((utime - this.first) / 1e6);
    this.#show(utime);
  }

  #show(utime) {
    setText(this.place, `${dateText(utime)} ${timeOfDay(utime, 1)}`);
    setAttribute(this.slider, "aria-valuetext", timeOfDay(utime));
    this.slider.style.setProperty(
      "--share",
      `${this.length > 0 ? ((utime - this.first) / 1e4 / this.length).toFixed(2) : 0}%`,
    );
  }

  #showPlay(playing) {
    if (this.shownPlaying === playing) return;
    this.shownPlaying = playing;
    this.play.replaceChildren(picture(playing ? "pause" : "play"));
    setAttribute(this.play, "aria-label", playing ? "Pause" : "Play");
  }
}
