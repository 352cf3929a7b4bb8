// What is recorded, what is missing in it and by whose fault, and the bridge.

import { AlarmList } from "./alarm_list.js";
import { KeyedList, element, factList, setHidden, setText } from "./dom.js";
import { StateBadge } from "./icons.js";
import { bytes, count, duration, rate } from "./numbers.js";

class RecorderCard {
  constructor({ recorder }) {
    this.badge = new StateBadge();
    this.file = element("p.port");
    this.lost = element("span.number");
    this.lostText = element("span.unit", {}, "messages missing");
    this.figures = element("dl.figures");
    this.facts = factList(this.figures);
    this.rows = element("tbody");
    this.senders = new KeyedList(
      this.rows,
      (sender) => sender.sender,
      (sender) => {
        const lost = element("td");
        return {
          root: element("tr", {}, element("th", { scope: "row" }, sender.sender), lost),
          update: ({ lost: number }) => setText(lost, count(number)),
        };
      },
    );
    this.table = element("table.errors", {}, element("caption", {}, "Missing by sender"), this.rows);
    this.error = element("p.last-error");
    this.root = element(
      "article.panel.recorder-card",
      { "data-recorder": recorder.recorder },
      element("header", {}, element("h3", {}, recorder.recorder), this.badge.root, this.file),
      element("p.value", {}, this.lost, this.lostText),
      this.figures,
      this.table,
      this.error,
    );
  }

  update({ recorder, now }) {
    this.badge.update(recorder.state);
    setText(this.file, recorder.file ?? "");
    setText(this.lost, count(recorder.lost));
    this.root.classList.toggle("losing", recorder.lost > 0);
    this.facts.update([
      ["Messages", count(recorder.messages)],
      ["Rate", `${rate(recorder.messages_hz)}/s`],
      ["Written", `${bytes(recorder.bytes_hz)}/s`],
      ["This file", bytes(recorder.file_bytes)],
      ["Since the start", bytes(recorder.total_bytes)],
      ["Free on the disk", bytes(recorder.free_bytes)],
      ["Dropped by the host", count(recorder.kernel_dropped)],
    ]);
    const losing = (recorder.senders ?? []).filter((sender) => sender.lost > 0);
    this.senders.update(losing);
    setHidden(this.table, losing.length === 0);
    setText(
      this.error,
      recorder.last_error ? `Last error, ${duration(now - recorder.last_error_utime)} ago: ${recorder.last_error}` : "",
    );
  }
}

// What the page's server lost or refused of LCM's datagrams, and why it receives none; empty when nothing.
function receptionText(reception) {
  const parts = [
    [reception?.dropped, "lost because the page's server was too slow"],
    [reception?.outside, "from other hosts refused"],
    [reception?.malformed, "malformed"],
  ].filter(([number]) => number > 0);
  const network = reception?.network ? `LCM: ${reception.network}. ` : "";
  if (parts.length === 0) return network;
  return `${network}Datagrams at the page's server: ${parts.map(([number, what]) => `${count(number)} ${what}`).join(", ")}.`;
}

export class RecorderView {
  constructor(machine) {
    this.machine = machine;
    this.grid = element("div.bus-cards");
    this.empty = element("p.empty", {}, "No recorder runs. Start one with: axlecast record run.lcm");
    this.cards = new KeyedList(
      this.grid,
      ({ recorder }) => recorder.recorder,
      (item) => new RecorderCard(item),
    );
    this.bridge = new StateBadge();
    this.alarms = new AlarmList("No alarm of a recorder or of the bridge.");
    this.reception = element("p.reception");
    this.root = element(
      "div.recorder-view",
      {},
      element("h2", {}, "Recording"),
      this.empty,
      this.grid,
      element(
        "section.panel.bridge",
        {},
        element("header", {}, element("h3", {}, "Bridge"), this.bridge.root),
        this.alarms.root,
      ),
      this.reception,
    );
  }

  update() {
    const { state, alarms } = this.machine;
    const recorders = state?.recorders ?? [];
    const now = state?.utime ?? 0;
    this.cards.update(recorders.map((recorder) => ({ recorder, now })));
    setHidden(this.empty, recorders.length > 0);
    const serves = state?.bridge?.serves;
    this.bridge.show(serves ? "good" : "silent", serves ? "Serves commands" : "Not heard");
    setText(this.reception, receptionText(state?.reception));
    const own = [...alarms.values()].filter((frame) => /^(bridge$|recorder\/)/.test(frame.device));
    this.alarms.update(own.flatMap((frame) => frame.entries.map((entry) => ({ device: frame.device, entry }))));
  }
}
