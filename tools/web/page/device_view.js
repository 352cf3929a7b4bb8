// Everything about one device: its reading with what its flags mean, alarms with what to do, curves, errors by kind.

import { AlarmList } from "./alarm_list.js";
import { channelsOf } from "./channels.js";
import { Dial } from "./dial.js";
import { element, factList, setHidden, setText, setUnit } from "./dom.js";
import { StateBadge, picture } from "./icons.js";
import { UNKNOWN, count, duration, fixed, microseconds, quantity, rate, timeOfDay, unitText } from "./numbers.js";
import { StripStack } from "./strip_stack.js";
import { TripLimits } from "./trip_limits.js";
import { errorWord, flagWords, readable } from "./words.js";

const FIRST_COLUMNS = { position: ["value", "speed_rpm"], motor: ["power_w", "current_a", "temperature_c"] };

function encoderFacts(state, reading) {
  return [
    ["Turns", fixed(reading?.turns, 4)],
    ["Speed", `${quantity(reading?.speed_rpm, "rpm")} rpm`],
    ["Angle of the shaft", `${fixed(reading?.angle_deg, 2)}°`],
    ["Counts", count(reading?.counts)],
    ["As the device said", `${count(reading?.raw_counts)} in turn ${count(reading?.raw_turns)}`],
    ["Resolution", `${count(state?.counts_per_turn)} a turn`],
    ["Range of turns", state?.turns_range ? count(state.turns_range) : "single-turn"],
    ["Counts up", state?.direction === "cw" ? "clockwise" : "counter-clockwise"],
    ["Datum epoch", count(reading?.datum_epoch)],
    ["Reference", state?.reference_lost ? "Lost: set the datum" : "Not in doubt"],
  ];
}

function motorFacts(state, reading) {
  const accel = reading?.accel_mps2 ?? [];
  const known = (value, yes, no) => (value === 1 ? yes : value === 0 ? no : UNKNOWN);
  return [
    ["Voltage", `${quantity(reading?.voltage_v, "V")} V`],
    ["Current", `${quantity(reading?.current_a, "A")} A`],
    ["Temperature", `${quantity(reading?.temperature_c, "°C")} °C`],
    ["Acceleration x, y, z", `${[0, 1, 2].map((axis) => fixed(accel[axis], 2)).join("  ")} m/s²`],
    ["Status", reading?.status?.length ? reading.status.map(readable).join(", ") : "No trip"],
    ["Trips", count(reading?.trip_count)],
    ["Stop over the bus", known(reading?.stop_coil, "Commanded", "Not commanded")],
    ["Login", known(reading?.logged_in, "Logged in", "Logged out")],
    ["Mains", reading?.mains_hz ? `${reading.mains_hz} Hz` : UNKNOWN],
  ];
}

function commonFacts(device, state) {
  return [
    ["Bus", device.bus],
    ["Model", state?.model || device.model],
    ...(state?.serial ? [["Serial number", state.serial]] : []),
    ...(state?.firmware ? [["Firmware", state.firmware]] : []),
    ...(state?.product_code ? [["Product code", state.product_code]] : []),
    ["Readings", `${rate(state?.rate_hz)}/s`],
    ["Polled every", state?.poll_us ? microseconds(state.poll_us) : "as fast as the bus allows"],
    ["Good readings", count(state?.good)],
    ["Last good reading", timeOfDay(state?.last_good_utime, 3)],
    ["Messages lost on the way here", count(state?.lost)],
    ["Writes to its memory", count(state?.nv_writes)],
  ];
}

class Facts {
  constructor() {
    this.root = element("dl.fact-list");
    this.rows = factList(this.root);
  }

  update(facts) {
    this.rows.update(facts);
  }
}

export class DeviceView {
  constructor(machine, time) {
    this.machine = machine;
    this.name = null;
    this.badge = new StateBadge();
    this.title = element("h2", { tabIndex: -1 });
    this.reason = element("p.reason");
    this.value = element("span.number");
    this.unit = element("span.unit");
    this.dial = new Dial();
    this.flags = element("p.flags");
    this.facts = new Facts();
    this.device = new Facts();
    this.errors = new Facts();
    this.noErrors = element("p.empty", {}, "No failed reading since the driver started.");
    this.alarms = new AlarmList("No alarm.");
    this.limits = new TripLimits();
    this.stack = new StripStack(machine, time);
    this.root = element(
      "div.device-view",
      {},
      element(
        "header.device-head",
        {},
        element(
          "a.button.square",
          { href: "#machine", "aria-label": "Back to the machine", title: "Back to the machine" },
          picture("back"),
        ),
        this.title,
        this.badge.root,
        this.reason,
      ),
      element(
        "div.device-left",
        {},
        element("section.panel.hero", {}, element("div.value", {}, this.value, this.unit), this.dial.root, this.flags),
        element("section.panel", {}, element("h3", {}, "Alarms"), this.alarms.root),
        this.limits.root,
        element("section.panel", {}, element("h3", {}, "Reading"), this.facts.root),
      ),
      this.stack.root,
      element(
        "div.device-right",
        {},
        element("section.panel", {}, element("h3", {}, "Device"), this.device.root),
        element("section.panel", {}, element("h3", {}, "Failed readings by kind"), this.noErrors, this.errors.root),
      ),
    );
  }

  open(name) {
    this.name = decodeURIComponent(name);
    this.shown = undefined;
    setText(this.title, this.name);
  }

  get devices() {
    return this.machine.devices.has(this.name) ? [this.name] : [];
  }

  update() {
    const device = this.machine.devices.get(this.name);
    setHidden(this.stack.root, !device);
    if (!device) {
      this.badge.show("silent", "No such device here");
      return;
    }
    this.#chooseChannels(device);
    const state = this.machine.stateOf.device.get(this.name);
    const reading = state?.reading ?? null;
    this.badge.update(state?.state);
    setText(this.reason, readable(state?.reason));
    this.#showValue(device, state, reading);
    this.limits.update(state?.limits, this.machine.state?.utime ?? 0);
    this.device.update(commonFacts(device, state));
    const errors = Object.entries(state?.errors ?? {}).map(([kind, times]) => [errorWord(kind), count(times)]);
    this.errors.update(errors);
    setHidden(this.noErrors, errors.length > 0);
    const frame = this.machine.alarms.get(this.name);
    const entries = (frame?.entries ?? []).map((entry) => ({ device: this.name, entry }));
    this.alarms.update(entries, (frame?.total ?? 0) - entries.length);
  }

  #chooseChannels(device) {
    const key = `${this.machine.revision.hello}/${this.name}`;
    if (this.shown === key) return;
    this.shown = key;
    const wanted = FIRST_COLUMNS[device.kind];
    this.stack.show(channelsOf(this.machine, this.name).filter((channel) => wanted.includes(channel.column)));
  }

  #showValue(device, state, reading) {
    const isMotor = device.kind === "motor";
    setText(this.value, isMotor ? quantity(reading?.power_w, "W") : quantity(reading?.value, reading?.unit));
    setUnit(this.unit, isMotor ? "W" : unitText(reading?.unit ?? device.unit));
    this.dial.root.style.display = isMotor ? "none" : ""; // a drawing has no `hidden`
    if (!isMotor) this.dial.update(reading?.angle_deg, reading?.speed_rpm);
    const words = flagWords(reading?.flags ?? []);
    if (reading && !reading.valid) words.unshift("Not valid");
    if (reading?.stale) words.unshift(`Old: ${duration(reading.age_us)}`);
    setText(this.flags, words.join(" · "));
    this.root.classList.toggle("old", !reading || reading.stale || !reading.valid);
    this.facts.update(isMotor ? motorFacts(state, reading) : encoderFacts(state, reading));
  }

  draw(frameMs) {
    this.stack.draw(frameMs);
  }
}
