// Devices in groups, for machines with many of them. Knows no browser.

export const GROUPINGS = ["none", "bus", "host", "name"];

const NO_HOST = "No host";

// The name without the number at its end: "axis" of "axis017", "press-axis" of "press-axis-2".
export function stemOf(name) {
  return name.replace(/[-_]?\d+$/, "") || name;
}

// The groupings that tell devices of this machine apart: hosts only where the machine's file names them.
export function groupingsOf(machine) {
  const hasHosts = [...machine.buses.values()].some((bus) => bus.host);
  return GROUPINGS.filter((by) => by !== "host" || hasHosts);
}

// [{name, items}] in the order of the first item of each group. `items` have a `device` of hello; `buses`: those of hello, by name.
export function groupsOf(items, by, buses) {
  if (by === "none") return [{ name: "", items }];
  const nameOf = {
    bus: ({ device }) => device.bus,
    host: ({ device }) => buses.get(device.bus)?.host || NO_HOST,
    name: ({ device }) => stemOf(device.device),
  }[by];
  const groups = new Map();
  for (const item of items) {
    const name = nameOf(item);
    if (!groups.has(name)) groups.set(name, { name, items: [] });
    groups.get(name).items.push(item);
  }
  return [...groups.values()];
}
