import assert from "node:assert/strict";
import test from "node:test";
import { channelOf, channelsOf, firstChannels } from "../../../tools/web/page/channels.js";
import { Machine } from "../../../tools/web/page/machine.js";

const HELLO = {
  type: "hello",
  machine: "m",
  mode: "live",
  buses: [{ bus: "b0", simulated: true, devices: ["a", "a.b", "gm"] }],
  devices: [
    {
      device: "a",
      kind: "position",
      columns: [
        { name: "value", unit: "mm" },
        { name: "speed_rpm", unit: "rpm" },
      ],
    },
    { device: "a.b", kind: "position", columns: [{ name: "value", unit: "mm" }] },
    { device: "gm", kind: "motor", columns: [{ name: "power_w", unit: "W" }] },
  ],
};
const entry = (name, severity, first_utime = 0) => ({
  name,
  severity,
  first_utime,
  code: 1,
  state: "live",
  count: 1,
  action: "",
});
const alarms = (device, entries, appeared = [], cleared = []) => ({
  type: "alarms",
  device,
  utime: 9,
  total: entries.length,
  entries,
  appeared,
  cleared,
});
const command = (id, state) => ({ type: "command", id, state });
const trip = (trip_count) => ({ type: "trip", device: "gm", trip_count });

function machine(...frames) {
  const made = new Machine();
  for (const frame of [HELLO, ...frames]) made.apply(frame);
  return made;
}

test("alarms of all devices are ordered: the worst first, then the newest", () => {
  const all = machine(
    alarms("a", [entry("old", "warning", 1), entry("i", "info")]),
    alarms("gm", [entry("trip", "error"), entry("new", "warning", 5)]),
  ).allAlarms();
  assert.deepEqual(
    all.map((alarm) => alarm.entry.name),
    ["trip", "new", "old", "i"],
  );
});

test("alarms of a device replace those before", () => {
  const made = machine(alarms("a", [entry("x", "error")]), alarms("a", []));
  assert.deepEqual(made.allAlarms(), []);
});

test("a command's or a trip's newest state replaces the one before", () => {
  const made = machine(
    command("1", "accepted"),
    command("2", "accepted"),
    command("1", "succeeded"),
    trip(1),
    trip(2),
    trip(1),
  );
  assert.deepEqual(
    [...made.commands.values()].map((each) => each.state),
    ["succeeded", "accepted"],
  );
  assert.equal(made.trips.size, 2);
});

test("samples are kept of subscribed devices only", () => {
  const made = machine();
  const samples = (device, dropped = 0) => ({
    type: "samples",
    device,
    t0_utime: 1,
    dt_us: [0],
    columns: { value: [1] },
    dropped,
  });
  made.apply(samples("a"));
  assert.equal(made.samples.size, 0);
  made.subscribe(["a"]);
  made.apply(samples("a", 3));
  made.apply(samples("stranger", 5));
  assert.equal(made.samples.get("a").length, 1);
  assert.equal(made.dropped, 3);
  made.subscribe(["gm"]);
  assert.equal(made.samples.size, 0);
});

test("after a reset or a new connection what was told before is void; the subscription stands", () => {
  for (const forget of [(made) => made.apply({ type: "reset" }), (made) => made.connected()]) {
    const made = machine(alarms("a", [entry("x", "error")]), command("1", "accepted"), trip(1));
    made.subscribe(["a"]);
    forget(made);
    assert.deepEqual(
      [made.alarms.size, made.commands.size, made.trips.size, made.samples.size, made.subscribed.size],
      [0, 0, 0, 0, 1],
    );
  }
});

test("memory of commands and trips has an end", () => {
  const made = machine();
  for (let i = 0; i < 2000; i += 1) {
    made.apply(command(String(i), "accepted"));
    made.apply(trip(i));
  }
  assert.ok(made.commands.size <= 500 && made.commands.has("1999"));
  assert.ok(made.trips.size <= 200 && made.trips.has("gm/1999"));
});

test("channels are found by what stands in the address, also of devices with a dot", () => {
  const made = machine();
  assert.deepEqual(channelOf(made, "a.b.value"), {
    key: "a.b.value",
    device: "a.b",
    column: "value",
    unit: "mm",
    colour: 1,
  });
  for (const stranger of ["", "a", "a.weight", "b.value", ".value"])
    assert.equal(channelOf(made, stranger), null, stranger);
  assert.deepEqual(
    channelsOf(made, "a").map((channel) => channel.key),
    ["a.value", "a.speed_rpm"],
  );
  assert.deepEqual(firstChannels(made), ["a.value", "a.speed_rpm", "gm.power_w"]);
});

test("what came and went since the page was opened is noted, newest first", () => {
  const made = machine(alarms("a", [entry("x", "error")], ["x"]), alarms("a", [entry("y", "error")], ["y"], ["x"]));
  assert.deepEqual(
    made.notes.map((note) => [note.name, note.change]),
    [
      ["y", "appeared"],
      ["x", "cleared"],
    ],
  );
});
