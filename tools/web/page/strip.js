// One strip: the curve of one quantity of one device over the stack's stretch of time, with its name and a read-out.

import uPlot from "./uPlot.esm.js";
import { extent, fitAxis, traceBand, traceCurve } from "./curve.js";
import { element, setHidden, setText, setUnit } from "./dom.js";
import { UNKNOWN, count, dateText, quantity, timeOfDay, unitText } from "./numbers.js";
import { stepDigits, timeMarks, timeStep } from "./time_axis.js";
import { columnWord } from "./words.js";

const MARK_EVERY_PX = 96;
const AXIS_WIDTH = 64;
const AXIS_HEIGHT = 26;
const SHORTEST_GAP_S = 0.25;
// The least that an axis spans, so that the noise of a standing shaft does not fill it.
const LEAST_SPAN = {
  mm: 0.01,
  deg: 0.02,
  rad: 0.0005,
  turn: 0.0005,
  rpm: 1,
  V: 2,
  A: 0.05,
  W: 5,
  "°C": 1,
  "m/s²": 0.5,
};

// False in a build without uPlot: there are no strips then.
export const hasCurves = uPlot !== null;

export class Strip {
  // `channel`: {key, device, column, unit, colour}; colour is the number of a hue of the style sheet.
  constructor(channel, { width, height, withTime }) {
    this.channel = channel;
    this.samples = undefined;
    this.axis = { low: 0, high: 1 };
    this.yRange = [0, 1];
    this.xRange = [0, 1];
    this.range = { low: 0, high: 0 };
    this.upper = { low: 0, high: 0 };
    this.colours = {};
    this.seen = undefined;
    this.#makeParts();
    this.plot = this.#makePlot(width, height, withTime);
    this.cursor = element("div.cursor", { hidden: true });
    this.dot = element("div.cursor-dot", { hidden: true });
    this.plot.over.append(this.cursor, this.dot);
  }

  #makeParts() {
    const { device, column, unit } = this.channel;
    this.value = element("span.number");
    this.swatch = element("span.swatch", { "aria-hidden": "true" });
    this.quantity = element("p.quantity", {}, columnWord(column));
    this.unit = element("span.unit");
    setUnit(this.unit, unitText(unit));
    this.low = element("dd");
    this.high = element("dd");
    this.left = element("p.left-out", { hidden: true });
    this.plotPlace = element("div.strip-plot");
    this.root = element(
      "div.strip",
      { "data-channel": this.channel.key },
      element(
        "div.readout",
        {},
        element("h3", {}, this.swatch, element("span", {}, device)),
        this.quantity,
        element("p.value", {}, this.value, this.unit),
        element(
          "dl.range",
          {},
          element("div", {}, element("dt", {}, "min"), this.low),
          element("div", {}, element("dt", {}, "max"), this.high),
        ),
        this.left,
      ),
      this.plotPlace,
    );
    this.root.classList.add(`hue-${this.channel.colour}`);
  }

  #makePlot(width, height, withTime) {
    const grid = { stroke: () => this.colours.grid, width: 1 };
    const ticks = { show: false };
    const font = "12px Inter, system-ui, sans-serif";
    const stroke = () => this.colours.label;
    const options = {
      width,
      height,
      legend: { show: false },
      cursor: { show: false },
      padding: [8, 12, withTime ? 0 : 8, 0],
      scales: {
        x: { time: false, auto: false, range: () => this.xRange },
        y: { range: () => this.yRange },
      },
      axes: [
        {
          size: withTime ? AXIS_HEIGHT : 0,
          grid,
          ticks,
          font,
          stroke,
          gap: 6,
          splits: (plot, index, left, right) => this.#timeMarks(plot, left, right),
          values: (plot, marks) =>
            withTime ? marks.map((mark) => this.#timeText(mark)) : marks.map(() => ""),
        },
        {
          size: AXIS_WIDTH,
          grid,
          ticks,
          font,
          stroke,
          space: 30,
          gap: 8,
          values: (plot, marks, axis, space, step) => marks.map((mark) => axisText(mark, step)),
        },
      ],
      series: [
        {},
        {
          auto: false,
          scale: "y",
          width: 1.6,
          stroke: () => this.colours.curve,
          fill: () => this.colours.band,
          points: { show: false },
          paths: (plot) => this.#outline(plot),
        },
      ],
    };
    return new uPlot(options, [[], []], this.plotPlace);
  }

  #timeMarks(plot, left, right) {
    const step = timeStep(right - left, Math.max(2, plot.bbox.width / uPlot.pxRatio / MARK_EVERY_PX));
    this.digits = stepDigits(step);
    this.hasDays = step >= 86400;
    return timeMarks(left, right, step);
  }

  #timeText(mark) {
    const utime = Math.round(mark * 1e6);
    return this.hasDays ? dateText(utime) : timeOfDay(utime, this.digits);
  }

  #outline(plot) {
    const stroke = new Path2D();
    const { left, top, width, height } = plot.bbox;
    const [from, to] = this.xRange;
    const first = Math.max(0, this.samples.lowerBound(from) - 1);
    const last = Math.min(this.samples.length - 1, this.samples.lowerBound(to));
    const axes = {
      left: from,
      perSecond: width / (to - from),
      x0: left,
      low: this.yRange[0],
      perUnit: height / (this.yRange[1] - this.yRange[0]),
      y0: top + height,
    };
    const { time } = this.samples;
    traceCurve(stroke, time, this.samples.column(this.channel.column), first, last, axes, this.gap);
    const [low, high] = ["low", "high"].map((name) => this.samples.column(name));
    const fill = low ? traceBand(new Path2D(), time, low, high, first, last, axes, this.gap) : null;
    return { stroke, fill, clip: null, band: null, gaps: null, flags: 0 };
  }

  // Colours as the style sheet has them now. Of the plot's place, `color` is that of the grid.
  readColours() {
    const colour = (node, property) => getComputedStyle(node)[property];
    this.colours = {
      curve: colour(this.swatch, "backgroundColor"),
      band: colour(this.swatch, "outlineColor"),
      grid: colour(this.plotPlace, "color"),
      label: colour(this.quantity, "color"),
    };
  }

  resize(width, height) {
    if (width !== this.plot.width || height !== this.plot.height) this.plot.setSize({ width, height });
  }

  // `samples` of the device (undefined: none yet); `maxAge`: what it calls an old reading, in µs. Samples of intervals have
  // the columns `low` and `high` beside that of the quantity, and know their own `gap` in s.
  draw(samples, from, to, maxAge) {
    this.gap = samples?.gap ?? Math.max(SHORTEST_GAP_S, (3 * (maxAge ?? 0)) / 1e6);
    this.xRange[0] = from;
    this.xRange[1] = to;
    const isNew = samples !== this.samples || samples?.version !== this.seen;
    if (isNew) {
      this.samples = samples;
      this.seen = samples?.version;
      this.data = samples
        ? [samples.time, samples.column(this.channel.column)].map((column) => column.subarray(0, samples.length))
        : [[], []];
    }
    if (this.samples) this.#fit();
    this.plot.batch(() => {
      if (isNew) this.plot.setData(this.data, false);
      this.plot.setScale("x", { min: from, max: to });
    });
  }

  #fit() {
    const { samples, range } = this;
    const values = samples.column(this.channel.column);
    const first = samples.lowerBound(this.xRange[0]);
    const last = samples.lowerBound(this.xRange[1]) - 1;
    extent(samples.column("low") ?? values, first, last, range);
    const highest = samples.column("high");
    if (highest) range.high = extent(highest, first, last, this.upper).high;
    fitAxis(this.axis, this.range, LEAST_SPAN[this.channel.unit] ?? 1e-3);
    this.yRange[0] = this.axis.low;
    this.yRange[1] = this.axis.high;
  }

  // The reading at the cursor, or the newest one in sight. `cursor`: instant in s, or null.
  read(cursor) {
    const { samples, channel } = this;
    const { unit } = channel;
    let at = -1;
    if (samples?.length > 0) at = cursor === null ? samples.lowerBound(this.xRange[1]) - 1 : samples.nearest(cursor);
    const isNear = at >= 0 && (cursor === null || Math.abs(samples.time[at] - cursor) <= this.gap);
    const value = isNear ? samples.column(channel.column)[at] : NaN;
    setText(this.value, quantity(value, unit));
    setText(this.low, samples ? quantity(this.range.low, unit) : UNKNOWN);
    setText(this.high, samples ? quantity(this.range.high, unit) : UNKNOWN);
    setHidden(this.left, !samples?.dropped);
    setText(this.left, samples?.dropped ? `${count(samples.dropped)} left out` : "");
    this.#placeCursor(cursor, at, value);
  }

  #placeCursor(cursor, at, value) {
    setHidden(this.cursor, cursor === null);
    setHidden(this.dot, cursor === null || Number.isNaN(value));
    if (cursor === null) return;
    const { bbox } = this.plot;
    const [from, to] = this.xRange;
    const width = bbox.width / uPlot.pxRatio;
    const place = (time) => ((time - from) / (to - from)) * width;
    this.cursor.style.transform = `translateX(${place(cursor).toFixed(1)}px)`;
    if (this.dot.hidden) return;
    const y = (1 - (value - this.yRange[0]) / (this.yRange[1] - this.yRange[0])) * (bbox.height / uPlot.pxRatio);
    this.dot.style.transform = `translate(${place(this.samples.time[at]).toFixed(1)}px, ${y.toFixed(1)}px)`;
  }

  destroy() {
    this.plot.destroy();
    this.root.remove();
  }
}

// A mark of the value axis: as many digits as its step needs.
function axisText(mark, step) {
  const digits = Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9)));
  return mark
    .toFixed(digits)
    .replace("-", "−")
    .replace(/^−(0(\.0+)?)$/, "$1");
}
