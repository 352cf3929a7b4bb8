import assert from "node:assert/strict";
import test from "node:test";
import { ServerClock } from "../../../tools/web/page/server_clock.js";
import { stepDigits, timeMarks, timeStep } from "../../../tools/web/page/time_axis.js";
import { SHORTEST, TimeWindow } from "../../../tools/web/page/time_window.js";

test("marks of time stand at round instants, no closer than asked for", () => {
  assert.equal(timeStep(10, 8), 2);
  assert.equal(timeStep(60, 8), 10);
  assert.equal(timeStep(0.1, 8), 0.02);
  assert.equal(timeStep(7 * 86400, 8), 86400);
  assert.equal(timeStep(1e9, 8), 31536000);
  assert.deepEqual(timeMarks(11.5, 17, 2), [12, 14, 16]);
  assert.deepEqual([2, 0.5, 0.02, 0.005].map(stepDigits), [0, 1, 2, 3]);
});

test("a window follows until it is held", () => {
  const window = new TimeWindow(10, 600);
  assert.deepEqual([window.left(100), window.right(100)], [90, 100]);
  window.hold(100);
  assert.deepEqual([window.following, window.right(150)], [false, 100]);
  window.follow();
  assert.equal(window.right(150), 150);
});

test("zooming while following keeps the newest; held, it keeps what is under the cursor", () => {
  const window = new TimeWindow(10, 600);
  window.zoom(0.5, 97, 100);
  assert.deepEqual([window.following, window.span], [true, 5]);
  window.hold(100);
  window.zoom(0.5, 96, 100);
  assert.equal((96 - window.left(100)) / window.span, (96 - 95) / 5);
});

test("nothing is shown that is to come, and spans have limits", () => {
  const window = new TimeWindow(10, 600);
  window.pan(50, 100);
  assert.equal(window.right(100), 100);
  window.pan(-30, 100);
  assert.equal(window.right(100), 70);
  window.zoom(1e9, 70, 100);
  assert.equal(window.span, 600);
  window.zoom(1e-12, 70, 100);
  assert.equal(window.span, SHORTEST);
});

test("the server's clock goes on between messages, evenly, and not for ever", () => {
  const clock = new ServerClock();
  assert.equal(clock.at(5), 0);
  clock.hear(1_000_000, 1000);
  assert.equal(clock.at(1250), 1_250_000);
  clock.hear(1_240_000, 1250); // 10 ms late on the way
  assert.ok(clock.at(1250) > 1_245_000, "no step back for a late message");
  assert.equal(clock.at(60_000) - clock.at(1250), 600_000);
});

test("a log's time goes at its speed, stands when paused, and jumps with a seek", () => {
  const clock = new ServerClock();
  clock.hear(0, 0, 10);
  assert.equal(clock.at(100), 1_000_000);
  clock.hear(5_000_000, 500, 0);
  assert.equal(clock.at(900), 5_000_000);
  clock.hear(90_000_000, 1000, 1);
  assert.equal(clock.at(1000), 90_000_000);
});
