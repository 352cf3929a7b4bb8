import assert from "node:assert/strict";
import test from "node:test";
import { Samples } from "../../../tools/web/page/samples.js";

const frame = (t0_utime, dt_us, value, dropped = 0) => ({ t0_utime, dt_us, columns: { value }, dropped });

test("readings are found by their instant", () => {
  const samples = new Samples(["value"]);
  samples.append(frame(1_000_000, [0, 10_000, 20_000], [1, 2, 3]));
  assert.equal(samples.length, 3);
  assert.deepEqual([...samples.time.subarray(0, 3)], [1, 1.01, 1.02]);
  assert.equal(samples.lowerBound(0), 0);
  assert.equal(samples.lowerBound(1.01), 1);
  assert.equal(samples.lowerBound(1.011), 2);
  assert.equal(samples.lowerBound(2), 3);
  assert.equal(samples.nearest(1.004), 0);
  assert.equal(samples.nearest(1.006), 1);
  assert.equal(samples.nearest(9), 2);
  assert.equal(new Samples(["value"]).nearest(1), -1);
});

test("a reading that is not valid, or a column that is missing, is NaN and never 0", () => {
  const samples = new Samples(["value", "speed_rpm"]);
  samples.append(frame(0, [1, 2], [null, 5]));
  assert.deepEqual([...samples.column("value").subarray(0, 2)], [NaN, 5]);
  assert.deepEqual([...samples.column("speed_rpm").subarray(0, 2)], [NaN, NaN]);
});

test("what comes out of order is left out, so that times ascend", () => {
  const samples = new Samples(["value"]);
  samples.append(frame(5_000_000, [0, 10, 10, 5], [1, 2, 3, 4]));
  samples.append(frame(4_000_000, [0], [5]));
  assert.deepEqual([...samples.column("value").subarray(0, samples.length)], [1, 2]);
});

test("beyond what is kept the oldest go, and the newest are all there", () => {
  const samples = new Samples(["value"], 3000);
  for (let i = 0; i < 20_000; i += 1) samples.append(frame(i * 1000, [0], [i]));
  assert.ok(samples.length >= 3000 && samples.length <= 6000, `${samples.length}`);
  assert.equal(samples.time.length, 6000);
  const newest = samples.column("value").subarray(samples.length - 3000, samples.length);
  newest.forEach((value, i) => assert.equal(value, 17_000 + i));
});

test("the server's count of what was left out is taken over, and cleared with the readings", () => {
  const samples = new Samples(["value"]);
  samples.append(frame(0, [1], [1], 7));
  assert.equal(samples.dropped, 7);
  const before = samples.version;
  samples.append(frame(0, [2], [1], 9));
  assert.notEqual(samples.version, before);
  samples.clear();
  assert.deepEqual([samples.length, samples.dropped], [0, 0]);
});
