// Strip charts of any channels of the machine.

import { channelOf, channelsOf, firstChannels } from "./channels.js";
import { element } from "./dom.js";
import { StripStack } from "./strip_stack.js";
import { columnWord } from "./words.js";

export class ChartView {
  constructor(machine, time, navigate) {
    this.machine = machine;
    this.navigate = navigate;
    this.keys = null; // nothing chosen yet
    this.stack = new StripStack(machine, time);
    this.choices = element("div.choices");
    this.root = element(
      "div.chart-view",
      {},
      element(
        "details.panel.chooser",
        { open: matchMedia("(min-width: 1200px)").matches },
        element("summary", {}, "Channels"),
        this.choices,
      ),
      this.stack.root,
    );
  }

  // The part of the address behind #charts/.
  open(keys) {
    if (keys) this.keys = keys.split(",").map(decodeURIComponent);
    this.shown = undefined;
  }

  get channels() {
    this.keys ??= this.machine.hello ? firstChannels(this.machine) : null;
    return (this.keys ?? []).map((key) => channelOf(this.machine, key)).filter((channel) => channel !== null);
  }

  get devices() {
    return this.channels.map((channel) => channel.device);
  }

  update() {
    const revision = this.machine.revision.hello;
    if (this.shown === revision || !this.machine.hello) return;
    this.shown = revision;
    this.stack.show(this.channels);
    this.#offer();
  }

  draw(frameMs) {
    this.stack.draw(frameMs);
  }

  #offer() {
    const chosen = new Set(this.keys);
    this.choices.replaceChildren(
      ...[...this.machine.devices.keys()].map((device) =>
        element(
          "fieldset",
          {},
          element("legend", {}, device),
          ...channelsOf(this.machine, device).map((channel) => this.#choice(channel, chosen)),
        ),
      ),
    );
  }

  #choice(channel, chosen) {
    const box = element("input", { type: "checkbox", checked: chosen.has(channel.key), value: channel.key });
    box.addEventListener("change", () => this.#choose(channel.key, box.checked));
    return element(`label.check.hue-${channel.colour}`, {}, box, element("span", {}, columnWord(channel.column)));
  }

  #choose(key, isWanted) {
    this.keys = this.keys.filter((known) => known !== key);
    if (isWanted) this.keys.push(key);
    this.stack.show(this.channels);
    this.navigate(`#charts/${this.keys.map(encodeURIComponent).join(",")}`);
  }
}
