// The devices of the machine's view: in groups, each device as a tile or, dense, as a row. The choices are remembered by this browser.

import { groupingsOf, groupsOf } from "./device_groups.js";
import { DeviceRow } from "./device_row.js";
import { DeviceTile } from "./device_tile.js";
import { KeyedList, element, setAttribute, setHidden, setText } from "./dom.js";
import { stateLook } from "./words.js";

const DENSE_FROM = 48; // devices; below this number, tiles are shown unless somebody has chosen
const WORDS = { none: "No groups", bus: "Group by bus", host: "Group by host", name: "Group by name" };
const KEYS = { dense: "axlecast-dense", by: "axlecast-groups" };

function remembered(key) {
  try {
    return localStorage.getItem(key);
  } catch {
    return null; // storage is switched off
  }
}

function remember(key, choice) {
  try {
    localStorage.setItem(key, choice);
  } catch {
    // then it holds until the page is left
  }
}

class Group {
  constructor() {
    this.title = element("h3.group-name");
    this.count = element("span.count");
    this.head = element("header.group-head", {}, this.title, this.count);
    this.parts = element("div");
    this.root = element("section.device-group", {}, this.head, this.parts);
    this.list = new KeyedList(
      this.parts,
      (item) => `${item.dense}/${item.device.device}/${item.device.kind}`,
      (item) => (item.dense ? new DeviceRow(item.device) : new DeviceTile(item.device)),
    );
  }

  update({ name, items, dense }) {
    setHidden(this.head, name === "");
    setText(this.title, name);
    const good = items.filter((item) => stateLook(item.state?.state) === "good").length;
    setText(this.count, `${good} of ${items.length}`);
    setAttribute(this.root, "data-group", name);
    setAttribute(this.root, "data-well", good === items.length ? "yes" : null);
    setAttribute(this.parts, "class", dense ? "device-rows" : "tiles");
    this.list.update(items);
  }
}

export class DeviceGrid {
  // `onChange`: called when somebody has chosen.
  constructor(machine, onChange) {
    this.machine = machine;
    this.dense = element("input", { type: "checkbox", id: "dense" });
    this.by = element("select", { id: "group-by", "aria-label": "Groups of devices" });
    this.chosen = remembered(KEYS.dense); // "yes", "no", or null: by the number of devices
    this.wantedBy = remembered(KEYS.by) ?? "none";
    this.controls = [this.by, element("label.check", {}, this.dense, element("span", {}, "Dense"))];
    this.root = element("div.groups");
    this.groups = new KeyedList(
      this.root,
      (group) => group.name,
      () => new Group(),
    );
    this.dense.addEventListener("input", () => {
      this.chosen = this.dense.checked ? "yes" : "no";
      remember(KEYS.dense, this.chosen);
      onChange();
    });
    this.by.addEventListener("input", () => {
      this.wantedBy = this.by.value;
      remember(KEYS.by, this.wantedBy);
      onChange();
    });
  }

  update(items) {
    const choices = groupingsOf(this.machine);
    const by = choices.includes(this.wantedBy) ? this.wantedBy : "none";
    if (this.by.options.length !== choices.length)
      this.by.replaceChildren(...choices.map((choice) => element("option", { value: choice }, WORDS[choice])));
    if (this.by.value !== by) this.by.value = by;
    const dense = this.chosen === null ? this.machine.devices.size >= DENSE_FROM : this.chosen === "yes";
    if (this.dense.checked !== dense) this.dense.checked = dense;
    const shown = items.map((item) => ({ ...item, dense }));
    this.groups.update(groupsOf(shown, by, this.machine.buses).map((group) => ({ ...group, dense })));
  }
}
