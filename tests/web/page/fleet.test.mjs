import assert from "node:assert/strict";
import test from "node:test";
import { FleetClient } from "../../../tools/web/page/fleet_client.js";
import { LoadedCurve, fleetChannel, samplesOf } from "../../../tools/web/page/fleet_curves.js";
import { LAST_S, addressOf, placeOf, utimesOf } from "../../../tools/web/page/fleet_place.js";
import { fleetSummary, filtered, machineState, needsAttention, sorted } from "../../../tools/web/page/fleet_rows.js";

function client() {
  const sent = [];
  const made = new FleetClient((text) => sent.push(JSON.parse(text)));
  return { made, sent };
}

test("an answer goes to the question it belongs to", () => {
  const { made, sent } = client();
  const got = [];
  made.ask("a", { type: "fleet_devices", machine: "m" }, { answer: (frame) => got.push(["a", frame.id]) });
  made.ask("b", { type: "fleet_machines" }, { answer: (frame) => got.push(["b", frame.id]) });
  assert.deepEqual(sent, [
    { type: "fleet_devices", machine: "m", id: 1 },
    { type: "fleet_machines", id: 2 },
  ]);
  assert.equal(made.hear({ type: "fleet_machines", id: 2 }), true);
  assert.equal(made.hear({ type: "fleet_devices", id: 1 }), true);
  assert.equal(made.hear({ type: "fleet_devices", id: 1 }), true, "a second time: to nobody");
  assert.equal(made.hear({ type: "state" }), false);
  assert.deepEqual(got, [
    ["b", 2],
    ["a", 1],
  ]);
});

test("a newer question of a key makes the older answer void", () => {
  const { made } = client();
  const got = [];
  for (const name of ["first", "second"]) made.ask("k", { type: "fleet_machines" }, { answer: () => got.push(name) });
  made.hear({ type: "fleet_machines", id: 1 });
  assert.deepEqual(got, []);
  made.hear({ type: "fleet_machines", id: 2 });
  assert.deepEqual(got, ["second"]);
  made.ask("k", { type: "fleet_machines" }, { answer: () => got.push("third") });
  made.forget("k");
  made.hear({ type: "fleet_machines", id: 3 });
  assert.deepEqual(got, ["second"]);
});

test("no more questions are open than the server takes; the others wait, the newest of a key only", () => {
  const { made, sent } = client();
  for (let i = 0; i < 20; i += 1) made.ask(`k${i}`, { type: "fleet_machines", i }, {});
  for (const i of [100, 101]) made.ask("k19", { type: "fleet_machines", i }, {});
  assert.equal(sent.length, 8);
  assert.equal(made.isOpen("k19"), true);
  for (let id = 1; id <= 20; id += 1) made.hear({ type: "fleet_machines", id });
  assert.deepEqual(
    sent.slice(8).map((question) => question.i),
    [8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 101],
  );
  assert.equal(made.isOpen("k19"), false);
});

test("a database that is away is said until it answers; a refusal goes to its question", () => {
  const { made } = client();
  const refused = [];
  const on = { refused: (text) => refused.push(text) };
  made.ask("a", { type: "fleet_machines" }, on);
  made.hear({ type: "fleet_error", id: 1, away: true, text: "no connection" });
  assert.equal(made.away, "no connection");
  assert.equal(made.isOpen("a"), false);
  made.ask("a", { type: "fleet_machines" }, on);
  made.hear({ type: "fleet_error", id: 2, away: false, text: "no table" });
  assert.deepEqual([made.away, refused], ["no connection", ["no table"]]);
  made.ask("a", { type: "fleet_machines" }, on);
  made.hear({ type: "fleet_machines", id: 3 });
  assert.equal(made.away, "");
});

test("after a new connection nothing is open, and answers of the old one are to nobody", () => {
  const { made } = client();
  made.ask("a", { type: "fleet_machines" }, { answer: () => assert.fail("an old answer") });
  made.connected();
  assert.equal(made.isOpen("a"), false);
  made.hear({ type: "fleet_machines", id: 1 });
});

test("a place is what its address says, whatever stands there", () => {
  const place = {
    machine: "press/3 ä",
    tab: "history",
    range: { from: 1790000000, to: 1790003600 },
    channels: ["axis1.value", "a,b.turns"],
  };
  assert.deepEqual(placeOf(addressOf(place).slice("#fleet/".length)), place);
  assert.equal(addressOf({ machine: null }), "#fleet");
  assert.deepEqual(placeOf(undefined), { machine: null, tab: "devices", range: { last: LAST_S }, channels: [] });
  for (const rest of ["m", "m/x", "m/x/y", "m/devices/0-0", "m/devices/9-3", "m/devices/-5/"])
    assert.deepEqual(placeOf(rest), { machine: "m", tab: "devices", range: { last: LAST_S }, channels: [] }, rest);
  assert.equal(placeOf("100%").machine, "100%");
  assert.equal(placeOf(`m/history/60/${"a.value,".repeat(50)}`).channels.length, 8);
  assert.deepEqual(utimesOf({ last: 60 }, 100), { from_utime: 40e6, to_utime: 100e6 });
  assert.deepEqual(utimesOf({ from: 1, to: 2 }, 100), { from_utime: 1e6, to_utime: 2e6 });
});

const machine = (name, values = {}) => ({
  machine: name,
  lag_us: 1e6,
  lag_bytes: 0,
  worst: null,
  alarms: 0,
  holes: 0,
  devices: 2,
  online: 2,
  ...values,
});

test("machines are judged by the age of their newest data", () => {
  const looks = [null, 1e6, 59e6, 60e6, 16 * 60e6].map((lag_us) => machineState(machine("m", { lag_us })).look);
  assert.deepEqual(looks, ["silent", "good", "good", "warning", "silent"]);
  assert.equal(needsAttention(machine("m")), false);
  for (const trouble of [{ alarms: 1 }, { holes: 1 }, { online: 1 }, { lag_us: null }])
    assert.equal(needsAttention(machine("m", trouble)), true, JSON.stringify(trouble));
  assert.equal(fleetSummary([machine("a"), machine("b", { lag_us: null })], true), "1 of 2+ machines up to date");
});

test("machines are filtered and sorted", () => {
  const all = [
    machine("press10", { worst: "warning", alarms: 5, lag_us: null }),
    machine("press2", { worst: "critical", alarms: 1, lag_us: 5 }),
    machine("Mill", { holes: 3 }),
  ];
  const names = (machines) => machines.map((each) => each.machine);
  assert.deepEqual(names(sorted(all, "machine", false)), ["Mill", "press2", "press10"]);
  assert.deepEqual(names(sorted(all, "machine", true)), ["press10", "press2", "Mill"]);
  assert.deepEqual(names(sorted(all, "alarms", true)), ["press2", "press10", "Mill"]);
  assert.deepEqual(names(sorted(all, "lag", true)), ["press10", "Mill", "press2"]);
  assert.deepEqual(names(sorted(all, "holes", true)), ["Mill", "press2", "press10"]);
  assert.deepEqual(names(sorted(all, "unheard of", false)), ["Mill", "press2", "press10"]);
  assert.deepEqual(names(filtered(all, " PRESS1", false)), ["press10"]);
  assert.deepEqual(names(filtered([machine("well"), ...all], "", true)), ["press10", "press2", "Mill"]);
});

const DEVICES = [
  { device: "axis1", kind: "position", unit: "mm" },
  { device: "gm1", kind: "motor", unit: "W" },
  { device: "bare", kind: null, unit: null },
];

test("channels of a machine of the fleet", () => {
  assert.deepEqual(fleetChannel(DEVICES, "axis1.value"), {
    key: "axis1.value",
    source: "axis1.value",
    device: "axis1",
    column: "value",
    unit: "mm",
    colour: 0,
  });
  assert.equal(fleetChannel(DEVICES, "axis1.turns").unit, "turn");
  assert.equal(fleetChannel(DEVICES, "gm1.temperature_c").unit, "°C");
  for (const stranger of ["axis1.power_w", "gm1.value", "bare.value", "axis9.value", "", "axis1"])
    assert.equal(fleetChannel(DEVICES, stranger), null, stranger);
});

const frame = (step_us, dt_us, more = {}) => ({
  column: "value",
  unit: "mm",
  step_us,
  t0_utime: 10e6,
  dt_us,
  value: dt_us.map((dt) => dt / 1e6),
  ...more,
});

test("a curve of intervals has a band, and a gap of several intervals", () => {
  const low = [0, null];
  const samples = samplesOf(frame(2e6, [0, 2e6], { low, high: [1, 3] }));
  assert.deepEqual([samples.length, samples.time[1], samples.column("high")[1], samples.gap], [2, 12, 3, 7]);
  assert.ok(Number.isNaN(samples.column("low")[1]));
});

test("a curve of samples has no band; its gap follows from how dense they are", () => {
  const dense = samplesOf(frame(0, [0, 4000, 8000]));
  assert.deepEqual([dense.column("low"), dense.gap], [undefined, 0.25]);
  const sparse = samplesOf(frame(0, [0, 1e6, 2e6, 12e6]));
  assert.equal(sparse.gap, 3.5);
  assert.ok(sparse.version > dense.version);
  assert.equal(samplesOf(frame(0, [])).length, 0);
});

test("what is loaded is asked for again when it is too short, too coarse or old", () => {
  const loaded = new LoadedCurve();
  const first = loaded.wanted(100, 200, 1000, false);
  assert.deepEqual(first, { from: 85, to: 215 });
  loaded.set(first, 1000);
  assert.equal(loaded.wanted(100, 200, 1000, false), null);
  assert.equal(loaded.wanted(90, 190, 5000, false), null, "the past does not change");
  assert.notEqual(loaded.wanted(80, 180, 1000, false), null, "panned out of it");
  assert.notEqual(loaded.wanted(140, 160, 1000, false), null, "zoomed in: finer points");
  assert.notEqual(loaded.wanted(50, 250, 1000, false), null, "zoomed out");
  loaded.set({ from: 885, to: 1015 }, 1000);
  assert.equal(loaded.wanted(901, 1001, 1001, true), null);
  assert.notEqual(loaded.wanted(903, 1003, 1003, true), null, "followed: newer data are there");
  assert.equal(loaded.wanted(900, 2000, 1010, false), null, "there is nothing yet beyond now");
  assert.equal(loaded.wanted(800, 2000, 1010, false).from, 620);
  assert.equal(new LoadedCurve().wanted(1, 100, 100, false).from, 0);
});
