// One machine of the fleet: its devices, their past, and the alarms, commands and trips of a time.

import { CommandTable } from "./command_view.js";
import { element, setAttribute, setHidden, setText } from "./dom.js";
import { FleetHistory } from "./fleet_history.js";
import { addressOf, utimesOf } from "./fleet_place.js";
import { deviceSummary } from "./fleet_rows.js";
import { AlarmTable, DeviceTable } from "./fleet_tables.js";
import { picture } from "./icons.js";
import { dateText, timeOfDay } from "./numbers.js";
import { TripView } from "./trip_view.js";

const REFRESH_MS = 5000;
const TAB_WORDS = { devices: "Devices", history: "History", alarms: "Alarms", commands: "Commands", trips: "Trips" };
const LASTS = [
  [900, "Last 15 min"],
  [3600, "Last hour"],
  [6 * 3600, "Last 6 h"],
  [86400, "Last day"],
  [7 * 86400, "Last 7 days"],
  [30 * 86400, "Last 30 days"],
  [365 * 86400, "Last year"],
];

// The text of an input of the type datetime-local, where the reader is.
function localText(seconds) {
  return `${dateText(seconds * 1e6)}T${timeOfDay(seconds * 1e6)}`;
}

export class FleetMachine {
  // `navigate(address)` goes to another place; `note(address)` only keeps the address.
  constructor(client, time, { navigate, note }) {
    this.client = client;
    this.time = time;
    this.navigate = navigate;
    this.place = null;
    this.frames = {}; // newest answer by tab
    this.problems = {}; // why a question was refused, by tab
    this.askedAt = {};
    this.trips = new Map();
    this.parts = {
      devices: new DeviceTable(),
      history: new FleetHistory(client, time, (shown) => {
        this.place = { ...this.place, ...shown };
        this.#showRange();
        note(addressOf(this.place));
      }),
      alarms: new AlarmTable(),
      commands: new CommandTable("No command was given in this time.", () => addressOf({ ...this.place, tab: "devices" })),
      trips: new TripView({ trips: this.trips }, (address) => {
        this.parts.trips.open(address.slice("#trips/".length));
        this.parts.trips.update();
      }),
    };
    this.title = element("h2");
    this.summary = element("p.summary", { role: "status" });
    this.tabs = new Map(
      Object.entries(TAB_WORDS).map(([tab, word]) => [tab, element("a", { href: "#fleet", "data-tab": tab }, word)]),
    );
    this.note = element("p.more", { role: "status", hidden: true });
    this.place_ = element("div.fleet-part");
    this.root = element(
      "section.fleet-machine",
      {},
      element(
        "div.section-head",
        {},
        element("a.button.square", { href: "#fleet", "aria-label": "Back to the fleet", title: "Back to the fleet" }, picture("back")),
        this.title,
        this.summary,
        element("nav.fleet-tabs", { "aria-label": "Views of the machine" }, ...this.tabs.values()),
      ),
      this.#makeRange(),
      this.note,
      this.place_,
    );
  }

  #makeRange() {
    this.last = element("select", { "aria-label": "Time shown", "data-act": "last" });
    this.last.addEventListener("change", () => this.#goTo({ last: Number(this.last.value) }));
    this.from = element("input", { type: "datetime-local", step: "1", "aria-label": "From" });
    this.to = element("input", { type: "datetime-local", step: "1", "aria-label": "To" });
    const show = element("button", { type: "submit" }, "Show");
    this.range = element("form.fleet-range", {}, this.last, this.from, element("span", {}, "to"), this.to, show);
    this.range.addEventListener("submit", (event) => {
      event.preventDefault();
      const [from, to] = [this.from, this.to].map((input) => Math.round(new Date(input.value).getTime() / 1000));
      const isWrong = !(from > 0 && to > from);
      this.to.setCustomValidity(isWrong ? "This time must be after the first one." : "");
      if (isWrong) this.to.reportValidity();
      else this.#goTo({ from, to });
    });
    this.to.addEventListener("input", () => this.to.setCustomValidity(""));
    return this.range;
  }

  #goTo(range) {
    this.navigate(addressOf({ ...this.place, range }));
  }

  open(place) {
    const isOther = this.place?.machine !== place.machine;
    const time = JSON.stringify(place.range);
    if (isOther || time !== this.timeOfFrames) {
      this.timeOfFrames = time;
      for (const tab of ["alarms", "commands", "trips", ...(isOther ? ["devices"] : [])]) {
        this.client.forget(tab);
        for (const kept of [this.frames, this.problems, this.askedAt]) delete kept[tab];
      }
    }
    this.place = place;
    setText(this.title, place.machine);
    for (const [tab, link] of this.tabs) {
      setAttribute(link, "aria-current", tab === place.tab ? "page" : null);
    }
    this.parts.history.open(place);
    this.part = this.parts[place.tab];
    if (this.place_.firstChild !== this.part.root) this.place_.replaceChildren(this.part.root);
    setHidden(this.range, place.tab === "devices");
    this.#showRange();
  }

  connected() {
    this.askedAt = {};
    this.parts.history.connected();
  }

  #showRange() {
    const { range } = this.place;
    const { last } = range;
    const now = this.time.now();
    const choices = LASTS.some(([seconds]) => seconds === last) ? LASTS : [...LASTS, [last ?? 0, last ? "Following" : "A time"]];
    this.last.replaceChildren(
      ...choices.map(([seconds, word]) =>
        element("option", { value: String(seconds), selected: seconds === (last ?? 0), disabled: seconds === 0 }, word),
      ),
    );
    const [from, to] = last === undefined ? [range.from, range.to] : [now - last, now];
    if (now > 0 || last === undefined)
      for (const [input, seconds] of [[this.from, from], [this.to, to]])
        if (document.activeElement !== input) input.value = localText(Math.round(seconds));
    for (const [name, link] of this.tabs) setAttribute(link, "href", addressOf({ ...this.place, tab: name }));
  }

  // A few times a second.
  update() {
    const now = this.time.now();
    if (now === 0 || !this.place) return;
    const { machine, tab, range } = this.place;
    this.#ask("devices", { type: "fleet_devices", machine }, true);
    if (tab === "alarms" || tab === "commands" || tab === "trips")
      this.#ask(tab, { type: `fleet_${tab}`, machine, ...utimesOf(range, now) }, "last" in range);
    if (tab === "history") this.parts.history.update();
    this.#show(tab, now);
  }

  // `isCurrent`: the answer changes with time.
  #ask(tab, question, isCurrent) {
    const age = performance.now() - (this.askedAt[tab] ?? -Infinity);
    const isDue = isCurrent || !this.frames[tab] ? age >= REFRESH_MS : false;
    if (!isDue || this.client.isOpen(tab)) return;
    this.askedAt[tab] = performance.now();
    this.client.ask(tab, question, {
      answer: (frame) => {
        this.frames[tab] = frame;
        delete this.problems[tab];
        if (tab === "devices") this.parts.history.setDevices(frame.devices);
        if (tab === "trips") this.#keepTrips(frame.trips);
      },
      refused: (text) => {
        this.problems[tab] = text;
      },
    });
  }

  #keepTrips(trips) {
    this.trips.clear();
    for (const trip of trips) this.trips.set(`${trip.device}/${trip.trip_count}/${trip.utime}`, trip);
  }

  #show(tab, now) {
    const { devices } = this.frames;
    setText(this.summary, devices ? deviceSummary(devices.devices) : "");
    const frame = this.frames[tab];
    this.place_.classList.toggle("waiting", tab !== "history" && !frame);
    const note = this.problems[tab] ?? (frame?.more ? "There are more. Choose a shorter time to see them." : "");
    setHidden(this.note, note === "");
    setText(this.note, note);
    if (!frame || tab === "history" || this.shown === `${tab}/${frame.id}`) return;
    if (tab === "devices") this.part.update(frame, this.place, now * 1e6);
    else {
      this.shown = `${tab}/${frame.id}`;
      if (tab === "alarms") this.part.update(frame);
      if (tab === "commands") this.part.update(frame.commands);
      if (tab === "trips") this.part.update();
    }
  }

  draw(frameMs) {
    if (this.place?.tab === "history") this.parts.history.draw(frameMs);
  }
}
