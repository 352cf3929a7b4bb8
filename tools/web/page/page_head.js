// The head of the page: which machine, where to go, how it is, and whether what is shown is fresh.

import { element, setAttribute, setHidden, setText } from "./dom.js";
import { picture, severitySign } from "./icons.js";
import { count, timeOfDay, zoneText } from "./numbers.js";
import { SEVERITIES, severityWord } from "./words.js";

const VIEWS = [
  ["machine", "Machine"],
  ["charts", "Charts"],
  ["buses", "Buses"],
  ["trips", "Trips"],
  ["commands", "Commands"],
  ["recorders", "Recording"],
  ["fleet", "Fleet"],
];

const MODE_WORDS = { log: "Log", fleet: "Connected" };

export class PageHead {
  constructor(machine, link, themeButton) {
    this.machine = machine;
    this.link = link;
    this.name = element("span.machine-name");
    this.links = new Map(VIEWS.map(([view, word]) => [view, element("a", { href: `#${view}` }, word)]));
    this.tags = element("div.tags");
    this.simulated = element("span.tag", { hidden: true, title: "Simulators answer on at least one bus" }, "Simulated");
    this.dropped = element("span.tag.warn", { hidden: true });
    this.alarms = element("a.alarm-counts", { href: "#machine" });
    this.freshness = element("span.freshness");
    this.clock = element("span.clock");
    this.notice = document.getElementById("notice");
    this.root = element(
      "div.head-row",
      {},
      element(
        "a.brand",
        { href: "#machine", "aria-label": "axlecast, machine" },
        logo(),
        element("span", {}, "axlecast"),
      ),
      this.name,
      element("nav", { "aria-label": "Views" }, ...this.links.values()),
      element(
        "div.head-end",
        {},
        this.dropped,
        this.simulated,
        this.alarms,
        element("span.live", {}, this.freshness, this.clock),
        themeButton,
      ),
    );
  }

  goTo(view) {
    for (const [name, anchor] of this.links) setAttribute(anchor, "aria-current", name === view ? "page" : null);
  }

  update(nowUtime) {
    const { machine, link } = this;
    const isFleet = machine.hello?.mode === "fleet";
    setText(this.name, isFleet ? "Fleet" : (machine.hello?.machine ?? ""));
    for (const [view, anchor] of this.links) setHidden(anchor, view === "fleet" ? !machine.hello?.fleet : isFleet);
    setHidden(this.simulated, !machine.isSimulated);
    const { dropped } = machine;
    setHidden(this.dropped, dropped === 0);
    setText(this.dropped, dropped === 0 ? "" : `${count(dropped)} readings left out`);
    this.dropped.title = "This browser was too slow for them. Alarms and states are never left out.";
    this.#countAlarms();
    const isFresh = link().state === "open" && !link().isSilent;
    const word = isFresh ? (MODE_WORDS[machine.hello?.mode] ?? "Live") : "Old";
    setText(this.freshness, word);
    setAttribute(this.freshness, "data-fresh", isFresh);
    setText(this.clock, machine.state ? `${timeOfDay(nowUtime)} ${zoneText(nowUtime)}` : "");
    this.#notify(link(), isFresh);
  }

  #countAlarms() {
    if (this.shownAlarms === this.machine.revision.alarms) return;
    this.shownAlarms = this.machine.revision.alarms;
    const counts = new Map();
    for (const { entry } of this.machine.allAlarms()) counts.set(entry.severity, (counts.get(entry.severity) ?? 0) + 1);
    const parts = SEVERITIES.filter((severity) => counts.has(severity));
    this.alarms.replaceChildren(
      ...parts.map((severity) => element("span.alarm-count", {}, severitySign(severity), String(counts.get(severity)))),
    );
    setHidden(this.alarms, parts.length === 0);
    setAttribute(
      this.alarms,
      "aria-label",
      `Alarms: ${parts.map((severity) => `${counts.get(severity)} ${severityWord(severity)}`).join(", ")}`,
    );
  }

  // Says why what is shown may be old, where it is.
  #notify(link, isFresh) {
    let text = "";
    if (link.state === "refused") text = link.text;
    else if (!isFresh && this.machine.state) {
      const until = `What is shown is of ${timeOfDay(this.machine.state.utime)}.`;
      text =
        link.state === "open"
          ? `Nothing comes from the server. ${until}`
          : `${link.text} Connection lost: tries again. ${until}`.trim();
    } else if (link.state === "lost") text = "No connection to the server: tries again.";
    else if (link.badFrames > 0) text = `${link.text} (${link.badFrames} times)`;
    setText(this.notice, text);
    setHidden(this.notice, text === "");
    document.body.classList.toggle("not-fresh", !isFresh && link.state !== "connecting");
  }
}

function logo() {
  const mark = picture("clockwise");
  mark.classList.add("logo");
  return mark;
}
