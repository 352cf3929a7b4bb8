import assert from "node:assert/strict";
import test from "node:test";
import { groupingsOf, groupsOf, stemOf } from "../../../tools/web/page/device_groups.js";

const item = (device, bus) => ({ device: { device, bus } });
const ITEMS = [item("axis1", "b0"), item("hoist", "b1"), item("axis2", "b1"), item("axis10", "b2")];
const BUSES = new Map([
  ["b0", { bus: "b0", host: "plc1" }],
  ["b1", { bus: "b1", host: "cell2" }],
  ["b2", { bus: "b2", host: null }],
]);
const names = (by) =>
  groupsOf(ITEMS, by, BUSES).map((group) => [group.name, group.items.map((each) => each.device.device).join()]);

test("without groups, one has all devices in their order", () => {
  assert.deepEqual(names("none"), [["", "axis1,hoist,axis2,axis10"]]);
});

test("by bus and by host, in the order of the first device of each", () => {
  assert.deepEqual(names("bus"), [
    ["b0", "axis1"],
    ["b1", "hoist,axis2"],
    ["b2", "axis10"],
  ]);
  assert.deepEqual(names("host"), [
    ["plc1", "axis1"],
    ["cell2", "hoist,axis2"],
    ["No host", "axis10"],
  ]);
});

test("by name, what differs only in the number at the end belongs together", () => {
  assert.deepEqual(names("name"), [
    ["axis", "axis1,axis2,axis10"],
    ["hoist", "hoist"],
  ]);
  assert.deepEqual(["axis017", "press-axis-2", "a_3", "x2y", "42", ""].map(stemOf), [
    "axis",
    "press-axis",
    "a",
    "x2y",
    "42",
    "",
  ]);
});

test("hosts can be chosen only where the machine has them", () => {
  assert.deepEqual(groupingsOf({ buses: BUSES }), ["none", "bus", "host", "name"]);
  assert.deepEqual(groupingsOf({ buses: new Map([["b", { bus: "b" }]]) }), ["none", "bus", "name"]);
});
