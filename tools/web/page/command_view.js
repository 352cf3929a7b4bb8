// What was commanded, by the CLI or the library, and how it ended. The page itself commands nothing.

import { KeyedList, element, setHidden, setText } from "./dom.js";
import { StateBadge } from "./icons.js";
import { dateText, duration, timeOfDay } from "./numbers.js";
import { outcomeLook, outcomeWord, readable, sentence } from "./words.js";

class CommandRow {
  constructor(command, linkOf) {
    this.badge = new StateBadge();
    this.text = element("p");
    this.changes = element("p.changes");
    this.took = element("td.took");
    this.root = element(
      "tr",
      { "data-command": command.id },
      element("td.when", { title: dateText(command.utime) }, timeOfDay(command.started_utime || command.utime)),
      element(
        "th",
        { scope: "row" },
        element("a", { href: linkOf(command.device) }, command.device),
      ),
      element(
        "td.operation",
        {},
        readable(command.operation),
        ...(command.unsigned ? [element("span.tag", { title: "Accepted without a signature" }, "unsigned")] : []),
      ),
      element("td.outcome", {}, this.badge.root),
      element("td.text", {}, this.text, this.changes),
      this.took,
    );
  }

  update(command) {
    this.badge.show(outcomeLook(command.state), outcomeWord(command.state, command.verified));
    const reason = command.reason && command.reason !== "none" ? `${readable(command.reason)}. ` : "";
    setText(this.text, reason + sentence(command.text));
    setText(
      this.changes,
      command.changes
        .map(({ key, before, after }) => `${readable(key)}: ${before || "?"} → ${after || "?"}`)
        .join(" · "),
    );
    setHidden(this.changes, command.changes.length === 0);
    const { started_utime: from, finished_utime: to } = command;
    setText(this.took, from && to ? duration(to - from) : "");
  }
}

// Commands in a table, the newest first. `linkOf(device)`: the address of a device.
export class CommandTable {
  constructor(emptyText, linkOf) {
    this.rows = element("tbody");
    this.list = new KeyedList(
      this.rows,
      (command) => command.id,
      (command) => new CommandRow(command, linkOf),
    );
    const heads = ["Time", "Device", "Operation", "Outcome", "What happened", "Took"];
    this.table = element(
      "table.commands",
      {},
      element("thead", {}, element("tr", {}, ...heads.map((head) => element("th", { scope: "col" }, head)))),
      this.rows,
    );
    this.empty = element("p.empty", {}, emptyText);
    this.root = element("div", {}, this.empty, element("div.panel.scroll", {}, this.table));
  }

  update(commands) {
    const newest = [...commands].sort((a, b) => (b.started_utime || b.utime) - (a.started_utime || a.utime));
    this.list.update(newest);
    setHidden(this.empty, newest.length > 0);
    setHidden(this.table, newest.length === 0);
  }
}

export class CommandView {
  constructor(machine) {
    this.machine = machine;
    this.table = new CommandTable(
      "No command was seen. Commands are given with the axlecast program, for example: axlecast zero axis1",
      (device) => `#device/${encodeURIComponent(device)}`,
    );
    this.root = element("div.command-view", {}, element("h2", {}, "Commands"), this.table.root);
  }

  update() {
    if (this.shown === this.machine.revision.commands) return;
    this.shown = this.machine.revision.commands;
    this.table.update(this.machine.commands.values());
  }
}
