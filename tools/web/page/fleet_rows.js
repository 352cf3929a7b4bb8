// The machines of a fleet: how they are judged, filtered and sorted. Knows no browser.

import { SEVERITIES, stateLook } from "./words.js";

const LATE_US = 60e6;
const ABSENT_US = 15 * 60e6;

// {look, word} as a badge shows them.
export function machineState({ lag_us: lag }) {
  if (lag === null) return { look: "silent", word: "No data yet" };
  if (lag >= ABSENT_US) return { look: "silent", word: "Absent" };
  return lag >= LATE_US ? { look: "warning", word: "Late" } : { look: "good", word: "Up to date" };
}

export function needsAttention(machine) {
  return machine.alarms > 0 || machine.holes > 0 || machine.online < machine.devices || machineState(machine).look !== "good";
}

const severityRank = (machine) => (machine.worst ? SEVERITIES.length - SEVERITIES.indexOf(machine.worst) : 0);
const known = (value) => value ?? -1;

// What a column is sorted by; texts ascend at first, numbers descend.
export const SORTS = {
  machine: (machine) => machine.machine,
  lag: (machine) => machine.lag_us ?? Number.MAX_VALUE,
  backlog: (machine) => known(machine.lag_bytes),
  alarms: (machine) => severityRank(machine) * 1e6 + machine.alarms,
  devices: (machine) => machine.devices - machine.online,
  holes: (machine) => machine.holes,
};

export function sorted(machines, column, descending) {
  const of = SORTS[column] ?? SORTS.machine;
  const sign = descending ? -1 : 1;
  const names = new Intl.Collator("en", { numeric: true });
  return [...machines].sort((a, b) => {
    const [left, right] = [of(a), of(b)];
    const order = typeof left === "string" ? names.compare(left, right) : left - right;
    return sign * order || names.compare(a.machine, b.machine);
  });
}

export function filtered(machines, text, onlyTroubled) {
  const wanted = text.trim().toLowerCase();
  return machines.filter(
    (machine) => machine.machine.toLowerCase().includes(wanted) && (!onlyTroubled || needsAttention(machine)),
  );
}

export function fleetSummary(machines, more) {
  const good = machines.filter((machine) => machineState(machine).look === "good").length;
  return `${good} of ${machines.length}${more ? "+" : ""} machines up to date`;
}

// The state of a device in the database: "online" as the live page's ONLINE.
export function deviceState(device) {
  return device.state?.toUpperCase();
}

export function deviceSummary(devices) {
  const good = devices.filter((device) => stateLook(deviceState(device)) === "good").length;
  return `${good} of ${devices.length} online`;
}
