// One device on the machine's view: state, value, turns, speed, and its worst alarm.

import { Dial } from "./dial.js";
import { element, setAttribute, setHidden, setText, setUnit } from "./dom.js";
import { StateBadge, severitySign } from "./icons.js";
import { count, duration, fixed, quantity, rate, unitText } from "./numbers.js";
import { Sparkline } from "./sparkline.js";
import { readable } from "./words.js";

function fact(label) {
  const value = element("dd");
  return { row: element("div", {}, element("dt", {}, label), value), value };
}

class EncoderFace {
  constructor() {
    this.dial = new Dial();
    this.facts = { turns: fact("Turns"), speed: fact("Speed") };
    this.root = element(
      "div.face",
      {},
      this.dial.root,
      element("dl.facts", {}, this.facts.turns.row, this.facts.speed.row),
    );
  }

  update(reading) {
    this.dial.update(reading?.angle_deg, reading?.speed_rpm);
    setText(this.facts.turns.value, fixed(reading?.turns, 3));
    setText(this.facts.speed.value, `${quantity(reading?.speed_rpm, "rpm")} rpm`);
    return [quantity(reading?.value, reading?.unit), unitText(reading?.unit)];
  }
}

class MotorFace {
  constructor() {
    this.spark = new Sparkline();
    this.facts = { voltage: fact("V"), current: fact("A"), temperature: fact("°C") };
    const { voltage, current, temperature } = this.facts;
    this.root = element(
      "div.face.motor",
      {},
      element("dl.facts.row", {}, voltage.row, current.row, temperature.row),
      this.spark.root,
    );
  }

  update(reading, trend) {
    setText(this.facts.voltage.value, quantity(reading?.voltage_v, "V"));
    setText(this.facts.current.value, quantity(reading?.current_a, "A"));
    setText(this.facts.temperature.value, quantity(reading?.temperature_c, "°C"));
    if (trend && trend !== this.trend) this.spark.begin(trend);
    this.trend = trend;
    if (reading) this.spark.add(reading.utime, reading.power_w);
    return [quantity(reading?.power_w, "W"), "W"];
  }
}

function silenceText(heard, now) {
  return heard ? `Nothing heard for ${duration(now - heard)}` : "Not heard yet";
}

export class DeviceTile {
  constructor(device) {
    this.badge = new StateBadge();
    this.value = element("span.number");
    this.unit = element("span.unit");
    this.face = device.kind === "motor" ? new MotorFace() : new EncoderFace();
    this.note = element("p.tile-note");
    this.rate = element("span");
    this.root = element(
      "a.tile",
      { href: `#device/${device.device}`, "data-device": device.device },
      element("header", {}, element("h3", {}, device.device), this.badge.root),
      element("div.value", {}, this.value, this.unit),
      this.face.root,
      this.note,
      element("footer", {}, element("span", {}, `${device.bus} · ${device.model}`), this.rate),
    );
  }

  update({ device, state, alarms, trend, now }) {
    const reading = state?.reading ?? null;
    this.badge.update(state?.state);
    const [value, unit] = this.face.update(reading, trend);
    setText(this.value, value);
    setUnit(this.unit, unit);
    setText(this.rate, state ? `${rate(state.rate_hz)}/s` : "");
    this.root.classList.toggle("old", !reading || reading.stale || !reading.valid || state.state === null);
    this.#tell(state, alarms, reading, now);
    setAttribute(this.root, "data-worst", alarms?.entries[0]?.severity ?? null);
    setAttribute(
      this.root,
      "aria-label",
      `${device.device}, ${this.badge.word}, ${value} ${unit}` +
        (alarms?.total ? `, ${count(alarms.total)} alarms` : ""),
    );
  }

  // One line: the worst alarm, else why the value is not to be trusted.
  #tell(state, alarms, reading, now) {
    const worst = alarms?.entries[0];
    let text = "";
    if (worst) text = readable(worst.name) + (alarms.total > 1 ? ` and ${alarms.total - 1} more` : "");
    else if (state?.state === null) text = silenceText(state.heard_utime, now);
    else if (reading?.stale) text = `Value is ${duration(reading.age_us)} old`;
    else if (reading && !reading.valid) text = "Reading is not valid";
    else if (state?.reason) text = state.reason;
    const key = `${worst?.severity}/${text}`;
    if (this.noteKey === key) return;
    this.noteKey = key;
    setHidden(this.note, text === "");
    this.note.replaceChildren(...(worst ? [severitySign(worst.severity)] : []), element("span", {}, text));
  }
}
