// The devices of a machine of the fleet with their last values, and its alarms of a time.

import { KeyedList, element, setHidden, setText, setUnit } from "./dom.js";
import { addressOf } from "./fleet_place.js";
import { deviceState } from "./fleet_rows.js";
import { StateBadge, severitySign } from "./icons.js";
import { count, dateText, duration, quantity, timeOfDay, unitText } from "./numbers.js";
import { readable } from "./words.js";

export function tableOf(heads, rows) {
  return element(
    "table.commands",
    {},
    element("thead", {}, element("tr", {}, ...heads.map((head) => element("th", { scope: "col" }, head)))),
    rows,
  );
}

class DeviceLine {
  constructor({ device, link }) {
    this.badge = new StateBadge();
    this.reason = element("span.reason");
    this.value = element("span.number");
    this.unit = element("span.unit");
    this.age = element("td.when");
    this.bus = element("td");
    this.model = element("td");
    this.link = element("a", { href: link }, device.device);
    this.root = element(
      "tr",
      { "data-device": device.device },
      element("th", { scope: "row" }, this.link),
      element("td", {}, element("span.value", {}, this.value, this.unit)),
      this.age,
      element("td", {}, this.badge.root, " ", this.reason),
      this.bus,
      this.model,
    );
  }

  update({ device, link, now }) {
    if (this.link.getAttribute("href") !== link) this.link.setAttribute("href", link);
    this.badge.update(deviceState(device));
    setText(this.reason, readable(device.reason));
    setText(this.value, quantity(device.value, device.unit));
    setUnit(this.unit, unitText(device.unit));
    this.root.classList.toggle("old", device.valid !== true);
    setText(this.age, device.utime === null ? "" : `${duration(now - device.utime)} ago`);
    setText(this.bus, device.bus ?? "");
    setText(this.model, [device.model, device.serial].filter(Boolean).join(" · "));
  }
}

export class DeviceTable {
  constructor() {
    this.rows = element("tbody");
    this.list = new KeyedList(
      this.rows,
      (item) => item.device.device,
      (item) => new DeviceLine(item),
    );
    this.empty = element("p.empty", {}, "No device of this machine is in the database.");
    this.table = tableOf(["Device", "Last value", "Measured", "State", "Bus", "Model"], this.rows);
    this.root = element("div", {}, this.empty, element("div.panel.scroll", {}, this.table));
  }

  // `frame`: fleet_devices; `place`: where the page is; `now`: the server's time in µs.
  update(frame, place, now) {
    const item = (device) => {
      const column = device.kind === "motor" ? "power_w" : "value";
      const channels = [`${device.device}.${column}`];
      return { device, now, link: addressOf({ ...place, tab: "history", channels }) };
    };
    this.list.update(frame.devices.map(item));
    setHidden(this.empty, frame.devices.length > 0);
    setHidden(this.table, frame.devices.length === 0);
  }
}

const CHANGES = { appeared: "came", changed: "changed", cleared: "gone" };

class AlarmLine {
  constructor(alarm) {
    this.root = element(
      "tr",
      { "data-alarm": `${alarm.device}/${alarm.name}` },
      element("td.when", { title: dateText(alarm.utime) }, `${dateText(alarm.utime)} ${timeOfDay(alarm.utime)}`),
      element("td", {}, alarm.device),
      element("th.alarm-name", { scope: "row" }, severitySign(alarm.severity), " ", readable(alarm.name)),
      element("td", {}, CHANGES[alarm.state] ?? readable(alarm.state)),
      element("td", {}, count(alarm.count)),
      element("td.text", {}, alarm.action),
    );
  }

  update() {}
}

export class AlarmTable {
  constructor() {
    this.rows = element("tbody");
    this.list = new KeyedList(
      this.rows,
      (alarm) => [alarm.utime, alarm.device, alarm.source, alarm.code, alarm.state].join("/"),
      (alarm) => new AlarmLine(alarm),
    );
    this.empty = element("p.empty", {}, "No alarm came or went in this time.");
    this.table = tableOf(["Time", "Device", "Alarm", "Change", "Times", "What to do"], this.rows);
    this.root = element("div", {}, this.empty, element("div.panel.scroll", {}, this.table));
  }

  update(frame) {
    this.list.update(frame.alarms);
    setHidden(this.empty, frame.alarms.length > 0);
    setHidden(this.table, frame.alarms.length === 0);
  }
}
