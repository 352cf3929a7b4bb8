// Where in the fleet the page is, and how that is written into its address: #fleet/MACHINE/TAB/RANGE/CHANNELS. A range is the
// last seconds ("3600"), or from and to ("1790000000-1790003600").

export const TABS = ["devices", "history", "alarms", "commands", "trips"];
export const LAST_S = 3600;
export const MOST_CHANNELS = 8;
const LONGEST_S = 20 * 365 * 86400;

function rangeOf(text) {
  const [, from, to] = text?.match(/^(\d{1,11})(?:-(\d{1,11}))?$/) ?? [];
  if (from === undefined) return { last: LAST_S };
  if (to === undefined) return { last: Math.min(LONGEST_S, Math.max(1, Number(from))) };
  const range = { from: Number(from), to: Number(to) };
  return range.from < range.to && range.to - range.from <= LONGEST_S ? range : { last: LAST_S };
}

function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text; // a % that is not one of ours
  }
}

// The part of the address behind #fleet/.
export function placeOf(rest) {
  const [machine, tab, range, channels] = (rest ?? "").split("/");
  return {
    machine: machine ? decoded(machine) : null,
    tab: TABS.includes(tab) ? tab : TABS[0],
    range: rangeOf(range),
    channels: channels ? channels.split(",").map(decoded).slice(0, MOST_CHANNELS) : [],
  };
}

export function addressOf({ machine, tab = TABS[0], range = { last: LAST_S }, channels = [] }) {
  if (!machine) return "#fleet";
  const parts = [encodeURIComponent(machine), tab, "last" in range ? range.last : `${range.from}-${range.to}`];
  if (channels.length > 0) parts.push(channels.map(encodeURIComponent).join(","));
  return `#fleet/${parts.join("/")}`;
}

// From and to in µs. `now`: the server's time in s.
export function utimesOf(range, now) {
  const [from, to] = "last" in range ? [now - range.last, now] : [range.from, range.to];
  return { from_utime: Math.max(0, Math.round(from * 1e6)), to_utime: Math.round(to * 1e6) };
}
