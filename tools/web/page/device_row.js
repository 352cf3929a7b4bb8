// One device on the machine's view where many are shown: state, name and value in one line.

import { element, setAttribute, setText, setUnit } from "./dom.js";
import { StateSign } from "./icons.js";
import { quantity, unitText } from "./numbers.js";
import { readable, stateLook, stateWord } from "./words.js";

export class DeviceRow {
  constructor(device) {
    this.sign = new StateSign();
    this.value = element("span.number");
    this.unit = element("span.unit");
    this.root = element(
      "a.device-row",
      { href: `#device/${device.device}`, "data-device": device.device },
      this.sign.root,
      element("span.row-name", {}, device.device),
      element("span.value", {}, this.value, this.unit),
    );
  }

  update({ device, state, alarms }) {
    const reading = state?.reading ?? null;
    const isMotor = device.kind === "motor";
    const value = isMotor ? quantity(reading?.power_w, "W") : quantity(reading?.value, reading?.unit);
    const unit = isMotor ? "W" : unitText(reading?.unit);
    const word = stateWord(state?.state);
    const worst = alarms?.entries[0];
    this.sign.show(stateLook(state?.state));
    setText(this.value, value);
    setUnit(this.unit, unit);
    this.root.classList.toggle("old", !reading || reading.stale || !reading.valid || state.state === null);
    setAttribute(this.root, "data-worst", worst?.severity ?? null);
    // The reason, where a row has no place for it.
    const reason = worst ? readable(worst.name) : (state?.reason ?? "");
    setAttribute(this.root, "title", reason === "" ? word : `${word}: ${reason}`);
    setAttribute(this.root, "aria-label", `${device.device}, ${word}, ${value} ${unit}${worst ? `, ${readable(worst.name)}` : ""}`);
  }
}
