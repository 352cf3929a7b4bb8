// Questions to the fleet database, over the connection of the page. Knows no browser. A question has a key: a newer question
// of the same key replaces the older one, so that a late answer never covers a newer one.

import { encode } from "./frames.js";

const MOST_OPEN = 8; // the server allows 12

export class FleetClient {
  // `send(text)`: to the server.
  constructor(send) {
    this.send = send;
    this.nextId = 1;
    this.connected();
  }

  // A new connection: what was asked before is never answered.
  connected() {
    this.open = new Map(); // id -> key, sent
    this.waiting = new Map(); // key -> {question, on}
    this.asked = new Map(); // key -> {id, on}: the newest question that was sent
    this.away = ""; // why the database does not answer
    this.revision = (this.revision ?? 0) + 1;
  }

  isOpen(key) {
    return this.waiting.has(key) || this.asked.has(key);
  }

  // `on`: {answer(frame), refused(text)}, both optional.
  ask(key, question, on) {
    this.waiting.set(key, { question, on });
    this.#sendNext();
  }

  // No answer for this key is wanted any more.
  forget(key) {
    this.waiting.delete(key);
    this.asked.delete(key);
  }

  #sendNext() {
    for (const [key, { question, on }] of this.waiting) {
      if (this.open.size >= MOST_OPEN) return;
      this.waiting.delete(key);
      const id = this.nextId;
      this.nextId += 1;
      this.open.set(id, key);
      this.asked.set(key, { id, on });
      this.send(encode.fleet({ ...question, id }));
    }
  }

  // A frame of the server; returns true if it is an answer.
  hear(frame) {
    if (!frame.type.startsWith("fleet_")) return false;
    const key = this.open.get(frame.id);
    this.open.delete(frame.id);
    const asked = this.asked.get(key);
    if (asked?.id === frame.id) {
      this.asked.delete(key);
      if (frame.type !== "fleet_error") asked.on.answer?.(frame);
      else if (!frame.away) asked.on.refused?.(frame.text);
    }
    this.away = frame.type === "fleet_error" ? (frame.away ? frame.text : this.away) : "";
    this.revision += 1;
    this.#sendNext();
    return true;
  }
}
