// Alarms in plain words: what, since when, and what to do about it.

import { KeyedList, element, setHidden, setText } from "./dom.js";
import { severitySign } from "./icons.js";
import { timeOfDay } from "./numbers.js";
import { alarmStateWord, readable, severityWord } from "./words.js";

class AlarmItem {
  constructor({ device, entry }) {
    this.device = element("a.alarm-device", { href: deviceLink(device) }, device);
    this.when = element("span.alarm-when");
    this.state = element("span.alarm-state");
    this.action = element("p.alarm-action");
    this.root = element(
      `li.alarm.${entry.severity}`,
      { "data-alarm": `${device}/${entry.name}` },
      severitySign(entry.severity),
      element(
        "div.alarm-text",
        {},
        element("div.alarm-head", {}, element("strong", {}, readable(entry.name)), this.device, this.when),
        this.action,
        this.state,
      ),
    );
  }

  update({ entry }) {
    setText(this.action, entry.action);
    setHidden(this.action, entry.action === "");
    const times = entry.count > 1 ? ` · ${entry.count} times` : "";
    setText(this.when, timeOfDay(entry.first_utime));
    setText(
      this.state,
      `${severityWord(entry.severity)} · ${alarmStateWord(entry.state)}` + `${times} · code ${entry.code}`,
    );
  }
}

function deviceLink(device) {
  return /^(bridge$|recorder\/)/.test(device) ? "#recorders" : `#device/${device}`;
}

export class AlarmList {
  constructor(emptyText) {
    this.list = element("ul.alarms", { role: "list" });
    this.empty = element("p.empty", {}, emptyText);
    this.more = element("p.more");
    this.root = element("div", {}, this.empty, this.list, this.more);
    this.items = new KeyedList(
      this.list,
      (alarm) => `${alarm.device}/${alarm.entry.code}/${alarm.entry.severity}`,
      (alarm) => new AlarmItem(alarm),
    );
  }

  // `hidden`: alarms that there are, but not in the list.
  update(alarms, hidden = 0) {
    this.items.update(alarms);
    setHidden(this.empty, alarms.length + hidden > 0);
    setHidden(this.more, hidden === 0);
    setText(this.more, `and ${hidden} more`);
  }
}
