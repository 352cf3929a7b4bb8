// All machines of the fleet in one table: filtered, and sorted by the column whose head was pressed.

import { KeyedList, element, setAttribute, setHidden, setText } from "./dom.js";
import { addressOf } from "./fleet_place.js";
import { filtered, fleetSummary, machineState, sorted } from "./fleet_rows.js";
import { StateBadge, severitySign } from "./icons.js";
import { bytes, count, dateText, duration, timeOfDay } from "./numbers.js";

const COLUMNS = [
  ["machine", "Machine"],
  ["lag", "Last data"],
  ["backlog", "Not sent yet"],
  ["alarms", "Alarms"],
  ["devices", "Devices online"],
  ["holes", "Holes"],
];

class MachineRow {
  constructor({ machine }) {
    this.badge = new StateBadge();
    this.lag = element("span");
    this.backlog = element("td.backlog");
    this.sign = element("span.sign");
    this.alarms = element("span");
    this.devices = element("td");
    this.holes = element("td.holes");
    this.root = element(
      "tr",
      { "data-machine": machine },
      element("th", { scope: "row" }, element("a", { href: addressOf({ machine }) }, machine)),
      element("td.when", {}, this.badge.root, " ", this.lag),
      this.backlog,
      element("td.alarms-of", {}, this.sign, this.alarms),
      this.devices,
      this.holes,
    );
  }

  update(machine) {
    const { look, word } = machineState(machine);
    this.badge.show(look, word);
    setText(this.lag, machine.lag_us === null ? "" : `${duration(machine.lag_us)} ago`);
    this.lag.title = machine.last_utime ? `${dateText(machine.last_utime)} ${timeOfDay(machine.last_utime)}` : "";
    setText(this.backlog, machine.lag_bytes ? bytes(machine.lag_bytes) : "");
    if (this.worst !== machine.worst) {
      this.worst = machine.worst;
      this.sign.replaceChildren(...(machine.worst ? [severitySign(machine.worst)] : []));
      setAttribute(this.root, "data-worst", machine.worst);
    }
    setText(this.alarms, machine.alarms > 0 ? ` ${count(machine.alarms)}` : "");
    setText(this.devices, `${machine.online} of ${machine.devices}`);
    setText(this.holes, machine.holes > 0 ? count(machine.holes) : "");
    this.holes.title = machine.holes > 0 ? `${count(machine.lost_messages)} messages are lost for good` : "";
  }
}

export class FleetList {
  constructor() {
    this.frame = null;
    this.problem = "";
    this.sort = { column: "machine", descending: false };
    this.search = element("input", {
      type: "search",
      id: "fleet-filter",
      placeholder: "Filter",
      "aria-label": "Filter machines by name",
    });
    this.onlyTroubled = element("input", { type: "checkbox", id: "fleet-troubled" });
    this.summary = element("p.summary", { role: "status" });
    this.rows = element("tbody");
    this.list = new KeyedList(
      this.rows,
      (machine) => machine.machine,
      (machine) => new MachineRow(machine),
    );
    this.heads = new Map(COLUMNS.map(([column, word]) => [column, this.#head(column, word)]));
    this.table = element(
      "table.commands.fleet-table",
      {},
      element("thead", {}, element("tr", {}, ...this.heads.values())),
      this.rows,
    );
    this.empty = element("p.empty");
    this.root = element(
      "section.fleet-list",
      { "aria-labelledby": "fleet-title" },
      element(
        "div.section-head",
        {},
        element("h2", { id: "fleet-title" }, "Fleet"),
        this.summary,
        element("label.check.only", {}, this.onlyTroubled, element("span", {}, "Only what needs attention")),
        this.search,
      ),
      this.empty,
      element("div.panel.scroll", {}, this.table),
    );
    for (const input of [this.search, this.onlyTroubled]) input.addEventListener("input", () => this.#draw());
  }

  #head(column, word) {
    const button = element("button.quiet", { type: "button", "data-sort": column }, word);
    button.addEventListener("click", () => {
      const isSame = this.sort.column === column;
      this.sort = { column, descending: isSame ? !this.sort.descending : column !== "machine" };
      this.#draw();
    });
    return element("th", { scope: "col" }, button);
  }

  // `frame`: fleet_machines.
  show(frame) {
    this.frame = frame;
    this.problem = "";
    this.#draw();
  }

  // The question was refused.
  refuse(text) {
    this.problem = text;
    this.#draw();
  }

  #emptyText(all) {
    if (!this.frame) return "Asks the database …";
    return all.length === 0 ? "The database has no machine yet." : "No machine fits the filter.";
  }

  #draw() {
    const all = this.frame?.machines ?? [];
    const { column, descending } = this.sort;
    const shown = sorted(filtered(all, this.search.value, this.onlyTroubled.checked), column, descending);
    this.list.update(shown);
    for (const [name, head] of this.heads)
      setAttribute(head, "aria-sort", name === column ? (descending ? "descending" : "ascending") : null);
    setText(this.summary, this.frame ? fleetSummary(all, this.frame.more) : "");
    setText(this.empty, this.problem || this.#emptyText(all));
    setHidden(this.empty, shown.length > 0 && !this.problem);
    setHidden(this.table, shown.length === 0);
  }
}
