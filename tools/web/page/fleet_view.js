// The fleet: all machines, or one of them. What the database answers is shown; if it is away, the last answers stay, faint.

import { element, setHidden, setText } from "./dom.js";
import { FleetList } from "./fleet_list.js";
import { FleetMachine } from "./fleet_machine.js";
import { placeOf } from "./fleet_place.js";

const REFRESH_MS = 5000;

export class FleetView {
  constructor(client, time, address) {
    this.client = client;
    this.time = time;
    this.askedAt = -Infinity;
    this.list = new FleetList();
    this.machine = new FleetMachine(client, time, address);
    this.away = element("p.fleet-away", { role: "alert", hidden: true });
    this.place_ = element("div.fleet-place");
    this.root = element("div.fleet-view", {}, this.away, this.place_);
    this.open();
  }

  // For the colours of a new theme.
  get stack() {
    return this.machine.parts.history.stack;
  }

  // The part of the address behind #fleet/.
  open(rest) {
    const place = placeOf(rest);
    this.shown = place.machine === null ? this.list : this.machine;
    if (this.shown === this.machine) this.machine.open(place);
    if (this.place_.firstChild !== this.shown.root) this.place_.replaceChildren(this.shown.root);
  }

  connected() {
    this.askedAt = -Infinity;
    this.machine.connected();
  }

  update() {
    if (this.shown === this.list) this.#askMachines();
    else this.machine.update();
    const { away } = this.client;
    setHidden(this.away, away === "");
    setText(this.away, away === "" ? "" : `Database away: ${away} Live data are not concerned. Tries again.`);
    this.place_.classList.toggle("old", away !== "");
  }

  #askMachines() {
    if (this.client.isOpen("machines") || performance.now() - this.askedAt < REFRESH_MS) return;
    this.askedAt = performance.now();
    this.client.ask("machines", { type: "fleet_machines" }, {
      answer: (frame) => this.list.show(frame),
      refused: (text) => this.list.refuse(text),
    });
  }

  draw(frameMs) {
    if (this.shown === this.machine) this.machine.draw(frameMs);
  }
}
