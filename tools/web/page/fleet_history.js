// The past of a machine's devices as strip charts: asks for the curves of the time that is shown.

import { element, setHidden, setText } from "./dom.js";
import { LoadedCurve, columnsOf, fleetChannel, samplesOf } from "./fleet_curves.js";
import { MOST_CHANNELS } from "./fleet_place.js";
import { StripStack } from "./strip_stack.js";
import { columnWord } from "./words.js";

const SPANS = [10, 60, 600, 3600, 6 * 3600, 86400, 7 * 86400, 30 * 86400, 365 * 86400];
const LONGEST_S = 5 * 365 * 86400;
const RETRY_MS = 2000;

export class FleetHistory {
  // `onPlace({range, channels})`: what is shown has changed.
  constructor(client, time, onPlace) {
    this.client = client;
    this.time = time;
    this.onPlace = onPlace;
    this.machine = null;
    this.devices = [];
    this.keys = [];
    this.store = { samples: new Map(), stateOf: { device: new Map() } };
    this.loaded = new Map(); // key -> LoadedCurve
    this.retryAt = 0;
    this.stack = new StripStack(this.store, time, { spans: SPANS, longest: LONGEST_S, behind: 0 });
    this.choices = element("div.choices");
    this.problem = element("p.empty", { role: "status", hidden: true });
    this.root = element(
      "div.chart-view.fleet-history",
      {},
      element(
        "details.panel.chooser",
        { open: matchMedia("(min-width: 1200px)").matches },
        element("summary", {}, "Channels"),
        this.choices,
      ),
      element("div.fleet-curves", {}, this.problem, this.stack.root),
    );
  }

  // The part of the address that concerns the charts.
  open({ machine, range, channels }) {
    if (machine !== this.machine) {
      this.#forget();
      this.machine = machine;
      this.devices = [];
    }
    this.keys = channels;
    this.isEmptied = false; // by the reader
    this.offered = undefined;
    const { window } = this.stack;
    if ("last" in range) {
      window.span = range.last;
      window.follow();
    } else window.show(range.from, range.to);
    this.stack.stale = true;
  }

  #forget() {
    for (const key of this.loaded.keys()) this.client.forget(`curve ${key}`);
    this.loaded.clear();
    this.store.samples.clear();
  }

  // After a new connection everything is asked again.
  connected() {
    this.loaded.clear();
    this.retryAt = 0;
  }

  // `devices`: rows of fleet_devices.
  setDevices(devices) {
    this.devices = devices;
  }

  get channels() {
    return this.keys.map((key) => fleetChannel(this.devices, key)).filter((channel) => channel !== null);
  }

  get #signature() {
    return JSON.stringify([this.keys, this.devices.map(({ device, kind, unit }) => [device, kind, unit])]);
  }

  // The strips need their colours from the style sheet: they are made when this view is in the page.
  #showChannels() {
    const first = this.devices.find((device) => columnsOf(device).length > 0);
    if (this.keys.length === 0 && !this.isEmptied && first) this.keys = [`${first.device}.${columnsOf(first)[0].name}`];
    if (this.offered === this.#signature) return;
    this.offered = this.#signature;
    this.stack.show(this.channels);
    this.#offer();
  }

  #offer() {
    const chosen = new Set(this.keys);
    this.boxes = [];
    this.choices.replaceChildren(
      ...this.devices
        .filter((device) => columnsOf(device).length > 0)
        .map((device) =>
          element(
            "fieldset",
            {},
            element("legend", {}, device.device),
            ...columnsOf(device).map((column) => this.#choice(`${device.device}.${column.name}`, column.name, chosen)),
          ),
        ),
    );
    this.#limit();
  }

  #choice(key, column, chosen) {
    const box = element("input", { type: "checkbox", checked: chosen.has(key), value: key });
    box.addEventListener("change", () => {
      this.keys = this.keys.filter((each) => each !== key);
      if (box.checked) this.keys.push(key);
      this.isEmptied = this.keys.length === 0;
      this.offered = this.#signature; // the boxes stay, and with them the focus
      this.stack.show(this.channels);
      this.#limit();
      this.onPlace(this.place);
    });
    this.boxes.push(box);
    const colour = fleetChannel(this.devices, key).colour;
    return element(`label.check.hue-${colour}`, {}, box, element("span", {}, columnWord(column)));
  }

  #limit() {
    for (const box of this.boxes) box.disabled = !box.checked && this.keys.length >= MOST_CHANNELS;
  }

  get place() {
    const { window } = this.stack;
    const now = this.time.now();
    const range = window.following
      ? { last: Math.max(1, Math.round(window.span)) }
      : { from: Math.floor(window.left(now)), to: Math.max(Math.ceil(window.right(now)), Math.floor(window.left(now)) + 1) };
    return { range, channels: this.keys };
  }

  // A few times a second: asks for what is shown and not loaded.
  update() {
    this.#showChannels();
    const now = this.time.now();
    if (now === 0 || performance.now() < this.retryAt) return;
    const { window } = this.stack;
    for (const channel of this.channels) {
      const key = `curve ${channel.key}`;
      if (this.client.isOpen(key)) continue;
      const loaded = this.loaded.get(channel.key) ?? new LoadedCurve();
      this.loaded.set(channel.key, loaded);
      const wanted = loaded.wanted(window.left(now), window.right(now), now, window.following);
      if (wanted !== null) this.#ask(key, channel, loaded, wanted, now);
    }
    if (this.settled !== `${window.span}/${window.end}`) {
      this.settled = `${window.span}/${window.end}`;
      this.onPlace(this.place);
    }
  }

  #ask(key, channel, loaded, wanted, now) {
    this.client.ask(
      key,
      {
        type: "fleet_curve",
        machine: this.machine,
        device: channel.device,
        column: channel.column,
        from_utime: Math.round(wanted.from * 1e6),
        to_utime: Math.round(wanted.to * 1e6),
      },
      {
        answer: (frame) => {
          loaded.set(wanted, now);
          this.store.samples.set(channel.key, samplesOf(frame));
          this.#say("");
        },
        refused: (text) => this.#say(text),
      },
    );
    this.retryAt = this.client.away ? performance.now() + RETRY_MS : this.retryAt;
  }

  #say(text) {
    if (text) this.retryAt = performance.now() + RETRY_MS;
    setText(this.problem, text);
    setHidden(this.problem, text === "");
  }

  draw(frameMs) {
    this.stack.draw(frameMs);
  }
}
