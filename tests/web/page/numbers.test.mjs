import assert from "node:assert/strict";
import test from "node:test";

process.env.TZ = "Asia/Kolkata"; // UTC+5:30 all year
const {
  bytes,
  count,
  dateText,
  duration,
  fixed,
  microseconds,
  percent,
  quantity,
  rate,
  timeOfDay,
  unitText,
  zoneText,
} = await import("../../../tools/web/page/numbers.js");

test("what is not known is a dash, never 0", () => {
  for (const write of [
    (x) => fixed(x, 2),
    count,
    rate,
    percent,
    bytes,
    microseconds,
    duration,
    timeOfDay,
    (x) => quantity(x, "mm"),
  ]) {
    for (const unknown of [null, undefined, NaN, Infinity]) assert.equal(write(unknown), "–");
  }
  assert.equal(timeOfDay(0), "–");
});

test("numbers have a true minus, no minus before 0, and digits by their unit", () => {
  assert.equal(fixed(-1.25, 1), "−1.3");
  assert.equal(fixed(-0.001, 2), "0.00");
  assert.equal(quantity(12.34567, "mm"), "12.346");
  assert.equal(quantity(-300.06, "rpm"), "−300.1");
  assert.equal(quantity(7.6, "count"), "8");
  assert.equal(unitText("deg"), "°");
  assert.equal(unitText("mm"), "mm");
});

test("large numbers are grouped", () => {
  assert.equal(count(1234567), "1\u202f234\u202f567");
  assert.equal(count(-1000), "−1\u202f000");
  assert.equal(count(999), "999");
  assert.equal(rate(19608.4), "19\u202f608");
  assert.equal(rate(12.34), "12.3");
  assert.equal(rate(0.257), "0.26");
  assert.equal(percent(0.0512), "5.1 %");
  assert.equal(percent(0.98), "98 %");
});

test("sizes and times have the unit that fits", () => {
  assert.deepEqual([0, 999, 1000, 1500000, 12e9, 5e15].map(bytes), [
    "0 B",
    "999 B",
    "1.0 kB",
    "1.5 MB",
    "12.0 GB",
    "5000 TB",
  ]);
  assert.deepEqual([5.25, 51, 999, 1500, 25000, 2.5e6].map(microseconds), [
    "5.3 µs",
    "51 µs",
    "999 µs",
    "1.50 ms",
    "25.0 ms",
    "2.50 s",
  ]);
  assert.deepEqual([-5, 400000, 12e6, 185e6, 7.8e9, 356400e6].map(duration), [
    "0.0 s",
    "0.4 s",
    "12 s",
    "3 min 05 s",
    "2 h 10 min",
    "4 d 03 h",
  ]);
});

test("instants are those of the reader's clock", () => {
  const utime = Date.UTC(2026, 10, 21, 20, 3, 9) * 1000 + 123456; // 2026-11-22 01:33:09 in Kolkata
  assert.equal(timeOfDay(utime), "01:33:09");
  assert.equal(timeOfDay(utime, 1), "01:33:09.1");
  assert.equal(timeOfDay(utime, 3), "01:33:09.123");
  assert.equal(dateText(utime), "2026-11-22");
  assert.equal(zoneText(utime), "UTC+5:30");
});
