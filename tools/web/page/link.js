// The connection to the server. It comes back by itself, later and later; what it hears it gives to `onFrame`.

import { BadFrame, decode } from "./frames.js";

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 5000;
const SILENT_AFTER_MS = 2000; // `state` comes four times a second
const REFUSALS = new Map([
  [1002, "The server did not understand this page. Load the page again."],
  [1003, "The server did not understand this page. Load the page again."],
  [1007, "The server did not understand this page. Load the page again."],
  [1008, "The server has closed the connection: this page asked for too much. Load the page again."],
  [1009, "The server has closed the connection: this page asked for too much. Load the page again."],
]);

export function waitBefore(attempt) {
  return Math.min(LONGEST_WAIT_MS, FIRST_WAIT_MS * 2 ** attempt);
}

// `world`: {open(): WebSocket, after(ms, f), now(): ms}. `on`: {open(), frame(frame), change()}.
export class Link {
  constructor(world, on) {
    this.world = world;
    this.on = on;
    this.state = "connecting"; // "open", "lost", "refused"
    this.text = "";
    this.attempt = 0;
    this.heardAt = null;
    this.badFrames = 0;
    this.#connect();
  }

  // Nothing came for a while although the connection stands.
  get isSilent() {
    return this.state === "open" && this.heardAt !== null && this.world.now() - this.heardAt > SILENT_AFTER_MS;
  }

  get retryInMs() {
    return this.state === "lost" ? Math.max(0, this.retryAt - this.world.now()) : 0;
  }

  send(text) {
    if (this.state === "open") this.socket.send(text);
  }

  #connect() {
    this.socket = this.world.open();
    this.socket.onopen = () => {
      this.heardAt = this.world.now();
      this.#become("open", "");
      this.on.open();
    };
    this.socket.onmessage = (event) => this.#hear(event.data);
    this.socket.onclose = (event) => this.#closed(event.code);
  }

  #hear(data) {
    this.heardAt = this.world.now();
    this.attempt = 0;
    try {
      const frame = decode(data);
      if (frame !== null) this.on.frame(frame);
    } catch (error) {
      if (!(error instanceof BadFrame)) throw error;
      this.badFrames += 1;
      this.text = `Not understood: ${error.message}`;
      this.on.change();
    }
  }

  #closed(code) {
    if (REFUSALS.has(code)) {
      this.#become("refused", REFUSALS.get(code));
      return;
    }
    const wait = waitBefore(this.attempt);
    this.attempt += 1;
    this.retryAt = this.world.now() + wait;
    this.#become("lost", code === 1013 ? "This browser was too slow to keep up." : "");
    this.world.after(wait, () => this.#connect());
  }

  #become(state, text) {
    this.state = state;
    this.text = text;
    this.on.change();
  }
}
