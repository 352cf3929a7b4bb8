import assert from "node:assert/strict";
import test from "node:test";
import { extent, fitAxis, traceBand, traceCurve } from "../../../tools/web/page/curve.js";

class Pen {
  constructor() {
    this.strokes = [];
  }

  moveTo(x, y) {
    this.strokes.push([[x, y]]);
  }

  lineTo(x, y) {
    this.strokes.at(-1).push([x, y]);
  }

  closePath() {
    this.strokes.at(-1).push("closed");
  }
}

// 10 pixels a second from x = 0; y upwards from 100, one pixel a unit.
const AXES = { left: 0, perSecond: 10, x0: 0, low: 0, perUnit: 1, y0: 100 };

function trace(points, gap = 1e9) {
  const pen = new Pen();
  traceCurve(
    pen,
    Float64Array.from(points, ([time]) => time),
    Float64Array.from(points, ([, value]) => value),
    0,
    points.length - 1,
    AXES,
    gap,
  );
  return pen.strokes;
}

test("readings that are apart are joined where they are", () => {
  assert.deepEqual(
    trace([
      [0, 0],
      [1, 10],
      [2, 5],
    ]),
    [
      [
        [0, 100],
        [10, 90],
        [20, 95],
      ],
    ],
  );
});

test("of the readings of one pixel the extremes are kept", () => {
  const points = Array.from({ length: 1000 }, (_, i) => [i / 10000, i === 500 ? 77 : i === 600 ? -20 : 0]);
  const [stroke] = trace(points);
  assert.ok(stroke.length <= 8, `${stroke.length} points for one pixel`);
  assert.ok(
    stroke.some(([, y]) => y === 23),
    "the peak",
  );
  assert.ok(
    stroke.some(([, y]) => y === 120),
    "the trough",
  );
});

test("a million readings become few points", () => {
  const points = Array.from({ length: 100_000 }, (_, i) => [i / 1000, Math.sin(i)]);
  assert.ok(trace(points)[0].length <= 4 * 1001);
});

test("the curve breaks where readings were not valid", () => {
  assert.deepEqual(
    trace([
      [0, 1],
      [1, 1],
      [2, NaN],
      [3, 2],
      [4, 2],
    ]),
    [
      [
        [0, 99],
        [10, 99],
      ],
      [
        [30, 98],
        [40, 98],
      ],
    ],
  );
});

test("the curve breaks where time is missing", () => {
  assert.equal(
    trace(
      [
        [0, 1],
        [0.1, 1],
        [5, 1],
        [5.1, 1],
      ],
      1,
    ).length,
    2,
  );
  assert.equal(
    trace(
      [
        [0, 1],
        [0.1, 1],
        [5, 1],
        [5.1, 1],
      ],
      10,
    ).length,
    1,
  );
});

test("a reading that stands alone is a dot", () => {
  assert.deepEqual(
    trace([
      [0, NaN],
      [1, 4],
      [2, NaN],
    ]),
    [
      [
        [10, 96],
        [11, 96],
      ],
    ],
  );
});

test("nothing valid draws nothing", () => {
  assert.deepEqual(
    trace([
      [0, NaN],
      [1, NaN],
    ]),
    [],
  );
});

test("the extent leaves out what is not valid", () => {
  const range = { low: 0, high: 0 };
  extent([NaN, 3, -2, NaN, 8, 100], 0, 4, range);
  assert.deepEqual(range, { low: -2, high: 8 });
  extent([NaN, NaN], 0, 1, range);
  assert.ok(Number.isNaN(range.low));
});

test("an axis grows at once, stands still for small changes, and shrinks for large ones", () => {
  const axis = fitAxis({ low: 0, high: 1 }, { low: -10, high: 10 }, 0.1);
  assert.ok(axis.low < -10 && axis.high > 10);
  const { low } = axis;
  fitAxis(axis, { low: -8, high: 8 }, 0.1);
  assert.equal(axis.low, low);
  fitAxis(axis, { low: -1, high: 1 }, 0.1);
  assert.ok(axis.low > -2 && axis.high < 2);
});

test("the noise of a standing shaft does not fill the axis", () => {
  const axis = fitAxis({ low: 0, high: 1000 }, { low: 5, high: 5.0001 }, 0.01);
  assert.ok(axis.high - axis.low >= 0.01 && axis.low < 5 && axis.high > 5);
  const before = { ...axis };
  assert.deepEqual(fitAxis(axis, { low: NaN, high: NaN }, 1), before);
});

test("the band of intervals is an area, interrupted where the curve is", () => {
  const pen = traceBand(
    new Pen(),
    Float64Array.of(0, 1, 2, 3, 9, 10),
    Float64Array.of(1, 2, NaN, 4, 5, 6),
    Float64Array.of(11, 12, NaN, 14, 15, 16),
    0,
    5,
    AXES,
    3,
  );
  assert.deepEqual(pen.strokes, [
    [[0, 89], [10, 88], [10, 98], [0, 99], "closed"],
    [[30, 86], [30, 96], "closed"],
    [[90, 85], [100, 84], [100, 94], [90, 95], "closed"],
  ]);
});
