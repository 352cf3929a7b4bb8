// The buses: rate against what the wire allows, exchange times, errors by kind and by device.

import { KeyedList, drawing, element, setAttribute, setHidden, setText } from "./dom.js";
import { StateBadge } from "./icons.js";
import { UNKNOWN, count, duration, fixed, microseconds, percent, rate } from "./numbers.js";
import { errorWord } from "./words.js";

const SHORTEST_US = 10;
const DECADES = 5; // 10 µs to 1 s
const WIDTH = 400;

function place(us) {
  return Math.max(0, Math.min(WIDTH, (Math.log10(us / SHORTEST_US) / DECADES) * WIDTH));
}

// Least, median, 99th percentile and most of the exchange times on an axis of decades.
class ExchangeTimes {
  constructor() {
    this.range = drawing("path", { class: "range" });
    this.middle = drawing("path", { class: "middle" });
    this.median = drawing("path", { class: "median" });
    const decades = ["10 µs", "100 µs", "1 ms", "10 ms", "100 ms", "1 s"];
    const marks = decades.map((_, i) => drawing("path", { class: "mark", d: `M${(i * WIDTH) / DECADES} 2v20` }));
    const labels = decades.map((label, i) =>
      drawing(
        "text",
        { x: (i * WIDTH) / DECADES, y: 36, "text-anchor": i === 0 ? "start" : i === DECADES ? "end" : "middle" },
        label,
      ),
    );
    this.text = element("p.times-text");
    this.root = element(
      "div.times",
      {},
      drawing(
        "svg",
        { viewBox: `-2 0 ${WIDTH + 4} 40`, "aria-hidden": "true" },
        ...marks,
        this.range,
        this.middle,
        this.median,
        ...labels,
      ),
      this.text,
    );
  }

  update(times) {
    const known = typeof times?.p50 === "number";
    for (const part of [this.range, this.middle, this.median])
      setAttribute(part, "visibility", known ? "visible" : "hidden");
    if (known) {
      setAttribute(this.range, "d", `M${place(times.min).toFixed(1)} 12H${place(times.max).toFixed(1)}`);
      setAttribute(
        this.middle,
        "d",
        `M${place(times.p50).toFixed(1)} 12H${Math.max(place(times.p99), place(times.p50) + 1).toFixed(1)}`,
      );
      setAttribute(this.median, "d", `M${place(times.p50).toFixed(1)} 4v16`);
    }
    setText(
      this.text,
      known
        ? `min ${microseconds(times.min)} · median ${microseconds(times.p50)} · 99 % ${microseconds(times.p99)} · max ${microseconds(times.max)}`
        : "No exchange in the last second",
    );
  }
}

function figure(label) {
  const value = element("dd");
  return { root: element("div", {}, element("dt", {}, label), value), value };
}

class BusCard {
  constructor({ bus }) {
    this.badge = new StateBadge();
    this.rate = element("span.number");
    this.limit = element("p.limit");
    this.fill = element("span.meter-fill");
    this.times = new ExchangeTimes();
    this.figures = {
      exchanges: figure("Exchanges"),
      failed: figure("Failed"),
      late: figure("Slots missed"),
      dropped: figure("Lost in the host"),
      reopens: figure("Opened again"),
      can: figure("CAN errors tx / rx"),
    };
    this.errorRows = element("tbody");
    this.errors = new KeyedList(
      this.errorRows,
      (row) => row.key,
      () => {
        const cells = [element("th", { scope: "row" }), element("td"), element("td.text")];
        return {
          root: element("tr", {}, ...cells),
          update: (row) => [row.who, row.times, row.kind].forEach((text, i) => setText(cells[i], text)),
        };
      },
    );
    this.table = element("table.errors", {}, element("caption", {}, "Failed exchanges by kind"), this.errorRows);
    this.lastError = element("p.last-error");
    this.root = element(
      "article.panel.bus-card",
      { "data-bus": bus.bus },
      element(
        "header",
        {},
        element("h3", {}, bus.bus),
        this.badge.root,
        element("p.port", { title: bus.port }, `${bus.family} · ${bus.simulated ? "simulated" : bus.port}`),
      ),
      element(
        "div.bus-rate-block",
        {},
        element("p.value", {}, this.rate, element("span.unit", {}, "exchanges/s")),
        element("span.meter.large", { "aria-hidden": "true" }, this.fill),
        this.limit,
      ),
      element("h4", {}, "Exchange times"),
      this.times.root,
      element("dl.figures", {}, ...Object.values(this.figures).map((each) => each.root)),
      this.table,
      this.lastError,
    );
  }

  update({ bus, state, devices, now }) {
    this.badge.update(state?.state);
    setText(this.rate, rate(state?.rate_hz));
    this.fill.style.width = `${Math.min(100, (state?.utilisation ?? 0) * 100)}%`;
    setText(
      this.limit,
      state?.wire_limit_hz
        ? `${percent(state.utilisation)} of the ${rate(state.wire_limit_hz)}/s that the wire allows`
        : "The wire's limit is not known",
    );
    this.times.update(state?.exchange_us);
    this.#count(state);
    this.#listErrors(
      state,
      devices.filter((device) => bus.devices.includes(device.device)),
    );
    setText(
      this.lastError,
      state?.last_error ? `Last error, ${duration(now - state.last_error_utime)} ago: ${state.last_error}` : "",
    );
  }

  #count(state) {
    const { exchanges, failed, late, dropped, reopens, can } = this.figures;
    setText(exchanges.value, count(state?.exchanges));
    setText(failed.value, state ? failedText(state) : UNKNOWN);
    setText(late.value, count(state?.late));
    setText(dropped.value, count(state?.rx_dropped));
    setText(reopens.value, count(state?.reopens));
    setHidden(can.root, typeof state?.can_tec !== "number");
    setText(can.value, `${count(state?.can_tec)} / ${count(state?.can_rec)}`);
  }

  #listErrors(state, devices) {
    const rows = Object.entries(state?.errors ?? {}).map(([kind, times]) => ({ who: "Bus", kind, times }));
    for (const device of devices) {
      for (const [kind, times] of Object.entries(device.errors ?? {})) rows.push({ who: device.device, kind, times });
    }
    this.errors.update(
      rows.map((row) => ({
        key: `${row.who}/${row.kind}`,
        who: row.who,
        times: count(row.times),
        kind: errorWord(row.kind),
      })),
    );
    setHidden(this.table, rows.length === 0);
  }
}

function failedText(state) {
  const failed = Object.values(state.errors ?? {}).reduce((sum, times) => sum + times, 0);
  if (failed === 0 || !state.exchanges) return count(failed);
  return `${count(failed)} (${fixed((failed / state.exchanges) * 100, 3)} %)`;
}

export class BusView {
  constructor(machine) {
    this.machine = machine;
    this.grid = element("div.bus-cards");
    this.root = element("div.bus-view", {}, element("h2", {}, "Buses"), this.grid);
    this.cards = new KeyedList(
      this.grid,
      (item) => item.bus.bus,
      (item) => new BusCard(item),
    );
  }

  update() {
    const { machine } = this;
    const devices = machine.state?.devices ?? [];
    this.cards.update(
      [...machine.buses.values()].map((bus) => ({
        bus,
        devices,
        state: machine.stateOf.bus.get(bus.bus),
        now: machine.state?.utime ?? 0,
      })),
    );
  }
}
