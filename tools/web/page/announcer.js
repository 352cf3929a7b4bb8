// New alarms, said once: on a card that goes away again, and to who listens instead of looking.

import { element } from "./dom.js";
import { severitySign } from "./icons.js";
import { readable, severityWord } from "./words.js";

const SHOWN_MS = 8000;
const AT_ONCE = 2;

export class Announcer {
  constructor(place) {
    this.place = place; // aria-live
    this.known = new Set(); // devices whose alarms were told before
  }

  forget() {
    this.known.clear();
  }

  hear(frame) {
    const isFirst = !this.known.has(frame.device);
    this.known.add(frame.device);
    if (isFirst) return; // it was there when the page came
    for (const entry of frame.entries) {
      if (frame.appeared.includes(entry.name) && entry.severity !== "info") this.#show(frame.device, entry);
    }
  }

  #show(device, entry) {
    const card = element(
      `div.toast.${entry.severity}`,
      {},
      severitySign(entry.severity),
      element(
        "div",
        {},
        element("strong", {}, `${device}: ${readable(entry.name)}`),
        element("p", {}, `${severityWord(entry.severity)}. ${entry.action}`),
      ),
    );
    while (this.place.childElementCount >= AT_ONCE) this.place.firstChild.remove();
    this.place.append(card);
    setTimeout(() => card.remove(), SHOWN_MS);
  }
}
