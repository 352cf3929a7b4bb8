// Trips of monitored motors: which, why, when, and the curves that led to them.

import { KeyedList, element, setAttribute, setHidden, setText } from "./dom.js";
import { dateText, timeOfDay } from "./numbers.js";
import { TripCurves } from "./trip_curves.js";
import { readable } from "./words.js";

const keyOf = (trip) => `${trip.device}/${trip.trip_count}`;

function causeText(trip) {
  return trip.factors.length > 0 ? trip.factors.map(readable).join(", ") : "Cause not known";
}

function whenText(trip) {
  const after = trip.not_after_utime;
  const before = trip.not_before_utime;
  if (!after) return "Time not known";
  const end = `${dateText(after)} ${timeOfDay(after)}`;
  return before ? `Between ${timeOfDay(before)} and ${end}` : `Before ${end}`;
}

class TripItem {
  constructor(trip, choose) {
    this.cause = element("span.trip-cause");
    this.when = element("span.trip-when");
    this.button = element(
      "button.trip-item",
      { type: "button", "data-trip": keyOf(trip) },
      element("strong", {}, `${trip.device}, trip ${trip.trip_count}`),
      this.cause,
      this.when,
    );
    this.button.addEventListener("click", () => choose(keyOf(trip)));
    this.root = element("li", {}, this.button);
  }

  update({ trip, isChosen }) {
    setText(this.cause, causeText(trip));
    setText(this.when, timeOfDay(trip.not_after_utime || trip.utime));
    setAttribute(this.button, "aria-current", isChosen ? "true" : null);
  }
}

export class TripView {
  constructor(machine, navigate) {
    this.machine = machine;
    this.chosen = null;
    this.shown = {}; // the key and the content of what is drawn
    this.list = element("ul.trip-list", { role: "list" });
    this.items = new KeyedList(
      this.list,
      ({ trip }) => keyOf(trip),
      ({ trip }) => new TripItem(trip, (key) => navigate(`#trips/${key}`)),
    );
    this.empty = element(
      "p.empty",
      {},
      "No trip has been recorded. When a motor trips, its monitor keeps the last 20 samples of each quantity; they are shown here.",
    );
    this.title = element("h3");
    this.when = element("p");
    this.curves = null;
    this.place = element("div");
    this.detail = element("section.panel.trip-detail", {}, this.title, this.when, this.place);
    this.root = element(
      "div.trip-view",
      {},
      element("h2", {}, "Trips"),
      this.empty,
      element("div.columns", {}, this.list, this.detail),
    );
  }

  open(key) {
    this.chosen = key ?? null;
  }

  update() {
    const trips = [...this.machine.trips.values()].sort(
      (a, b) => (b.not_after_utime || b.utime) - (a.not_after_utime || a.utime) || b.trip_count - a.trip_count,
    );
    setHidden(this.empty, trips.length > 0);
    const chosen = trips.find((trip) => keyOf(trip) === this.chosen) ?? trips[0];
    this.items.update(trips.map((trip) => ({ trip, isChosen: trip === chosen })));
    setHidden(this.detail, !chosen);
    if (chosen) this.#show(chosen, trips);
  }

  #show(chosen, trips) {
    const older = trips
      .filter((trip) => trip.device === chosen.device && trip.trip_count < chosen.trip_count)
      .slice(0, 2);
    const key = keyOf(chosen);
    const content = JSON.stringify([chosen, older]);
    if (this.shown.content === content) return;
    const isSame = this.shown.key === key;
    this.shown = { key, content };
    setText(this.title, `${chosen.device}: ${causeText(chosen)}`);
    const legend = older.length > 0 ? " Older trips of this motor are drawn dashed." : "";
    setText(this.when, `Trip ${chosen.trip_count}. ${whenText(chosen)}.${legend}`);
    this.#draw(chosen, older, isSame ? this.curves : null);
  }

  // A trip that is sent again, or an older one that comes later, moves neither the read-out nor the focus.
  #draw(chosen, older, before) {
    const hasFocus = before !== null && document.activeElement === before.grid;
    this.curves = new TripCurves(chosen, older, before?.index);
    this.place.replaceChildren(this.curves.root);
    if (hasFocus) this.curves.grid.focus();
  }
}
