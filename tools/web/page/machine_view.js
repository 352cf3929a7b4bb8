// The whole machine at a glance: a tile per device, beside it all alarms with what to do, and the buses.

import { AlarmList } from "./alarm_list.js";
import { DeviceGrid } from "./device_grid.js";
import { KeyedList, element, setHidden, setText } from "./dom.js";
import { StateBadge } from "./icons.js";
import { percent, rate, timeOfDay } from "./numbers.js";
import { readable, stateLook } from "./words.js";

const SHOWN_NOTES = 6;
const MAX_BUS_LINES = 16; // of more buses, only those that are not up have a line

class BusLine {
  constructor(bus) {
    this.badge = new StateBadge();
    this.rate = element("span.bus-rate");
    this.meter = element("span.meter-fill");
    this.root = element(
      "li",
      {},
      element("a", { href: "#buses" }, element("strong", {}, bus.bus)),
      this.badge.root,
      this.rate,
      element("span.meter", { "aria-hidden": "true" }, this.meter),
    );
  }

  update({ state }) {
    this.badge.update(state?.state);
    setText(this.rate, state ? `${rate(state.rate_hz)}/s · ${percent(state.utilisation)}` : "");
    this.meter.style.width = `${Math.min(100, (state?.utilisation ?? 0) * 100)}%`;
  }
}

// An alarm that came or went since the page was opened.
class Note {
  constructor({ utime, device, name, change }) {
    this.root = element(
      "li",
      {},
      element("span.note-when", {}, timeOfDay(utime)),
      element("span", {}, `${device}: ${readable(name)}`),
      element("span.note-change", {}, change === "appeared" ? "came" : "gone"),
    );
  }

  update() {}
}

export class MachineView {
  constructor(machine) {
    this.machine = machine;
    this.search = element("input", {
      type: "search",
      id: "device-filter",
      placeholder: "Filter",
      "aria-label": "Filter devices by name, bus or model",
    });
    this.onlyTroubled = element("input", { type: "checkbox", id: "only-troubled" });
    this.summary = element("p.summary", { role: "status" });
    this.grid = new DeviceGrid(machine, () => this.update());
    this.nothing = element("p.empty", { hidden: true }, "No device fits the filter.");
    this.alarms = new AlarmList("No alarm.");
    this.alarmCount = element("span.count");
    this.noteList = element("ul.notes", { role: "list" });
    this.notePanel = element(
      "section.panel",
      { "aria-labelledby": "notes-title" },
      element("div.section-head", {}, element("h2", { id: "notes-title" }, "Came and gone")),
      this.noteList,
    );
    this.busList = element("ul.bus-lines", { role: "list" });
    this.busCount = element("span.count");
    this.root = element(
      "div.machine-view",
      {},
      element(
        "section.devices",
        { "aria-labelledby": "devices-title" },
        element(
          "div.section-head",
          {},
          element("h2", { id: "devices-title" }, "Devices"),
          this.summary,
          element("label.check.only", {}, this.onlyTroubled, element("span", {}, "Only what needs attention")),
          ...this.grid.controls,
          this.search,
        ),
        this.grid.root,
        this.nothing,
      ),
      element(
        "aside.side",
        { "aria-label": "Alarms and buses" },
        element(
          "section.panel",
          { "aria-labelledby": "alarms-title" },
          element("div.section-head", {}, element("h2", { id: "alarms-title" }, "Alarms"), this.alarmCount),
          this.alarms.root,
        ),
        this.notePanel,
        element(
          "section.panel",
          { "aria-labelledby": "buses-title" },
          element("div.section-head", {}, element("h2", { id: "buses-title" }, "Buses"), this.busCount),
          this.busList,
        ),
      ),
    );
    this.busLines = new KeyedList(
      this.busList,
      (item) => item.bus.bus,
      (item) => new BusLine(item.bus),
    );
    this.notes = new KeyedList(
      this.noteList,
      (note) => `${note.utime}/${note.device}/${note.name}/${note.change}`,
      (note) => new Note(note),
    );
    for (const input of [this.search, this.onlyTroubled]) input.addEventListener("input", () => this.update());
  }

  update() {
    const machine = this.machine;
    const now = machine.state?.utime ?? 0;
    const items = [...machine.devices.values()].map((device) => ({
      device,
      now,
      state: machine.stateOf.device.get(device.device),
      alarms: machine.alarms.get(device.device),
      trend: machine.trends.get(device.device),
    }));
    const shown = items.filter((item) => this.#fits(item));
    this.grid.update(shown);
    setHidden(this.nothing, shown.length > 0 || items.length === 0);
    this.#summarise(items);
    const all = machine.allAlarms();
    const total = [...machine.alarms.values()].reduce((sum, frame) => sum + frame.total, 0);
    this.alarms.update(all, total - all.length);
    setText(this.alarmCount, total === 0 ? "" : String(total));
    this.notes.update(machine.notes.slice(0, SHOWN_NOTES));
    setHidden(this.notePanel, machine.notes.length === 0);
    this.#showBuses([...machine.buses.values()].map((bus) => ({ bus, state: machine.stateOf.bus.get(bus.bus) })));
  }

  #showBuses(buses) {
    const notUp = buses.filter(({ state }) => stateLook(state?.state) !== "good");
    this.busLines.update(buses.length > MAX_BUS_LINES ? notUp : buses);
    setText(this.busCount, buses.length > MAX_BUS_LINES ? `${buses.length - notUp.length} of ${buses.length} up` : "");
  }

  #fits({ device, state, alarms }) {
    if (this.onlyTroubled.checked && !alarms?.total && stateLook(state?.state) === "good" && !state?.reading?.stale)
      return false;
    const wanted = this.search.value.trim().toLowerCase();
    return [device.device, device.bus, device.model, device.family].some((text) => text.toLowerCase().includes(wanted));
  }

  #summarise(items) {
    const good = items.filter((item) => stateLook(item.state?.state) === "good").length;
    setText(this.summary, items.length === 0 ? "" : `${good} of ${items.length} online`);
    const isWell = good === items.length;
    setText(this.alarms.empty, isWell ? "No alarm. All devices say that they are well." : "No alarm is known.");
  }
}
