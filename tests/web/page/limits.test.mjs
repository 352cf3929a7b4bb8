import assert from "node:assert/strict";
import test from "node:test";

// dom.js needs a browser only when something is shown.
const { limitTexts } = await import("../../../tools/web/page/trip_limits.js");
const margin = (fields) => ({ name: "power_upper_a", unit: "W", measured: 250, limit: 300, margin: 50, ...fields });

test("a limit is shown with the reading and what is left", () => {
  assert.deepEqual(limitTexts(margin()), {
    label: "Power above A, W",
    now: "250.0",
    limit: "300.0",
    left: "50.0",
    isBeyond: false,
  });
});

test("a limit of 0 is off, and one that is not known a dash", () => {
  assert.deepEqual(
    [limitTexts(margin({ limit: 0, margin: null })), limitTexts(margin({ limit: null, margin: null }))].map((texts) => [
      texts.limit,
      texts.left,
      texts.isBeyond,
    ]),
    [
      ["Off", "–", false],
      ["–", "–", false],
    ],
  );
});

test("beyond the limit what is left is below 0", () => {
  const texts = limitTexts(margin({ limit: 240, margin: -10 }));
  assert.deepEqual([texts.left, texts.isBeyond], ["−10.0", true]);
});

test("a limit that the page has no word for keeps its name and unit", () => {
  const texts = limitTexts({ name: "torque_upper", unit: "N m", measured: 1.234, limit: 2, margin: 0.766 });
  assert.deepEqual([texts.label, texts.now, texts.left], ["Torque upper, N m", "1.23", "0.77"]);
});
