// What the server says (docs/web_protocol.md): text in, a checked frame out. A frame of an unknown type is null; one that is
// not as the protocol says throws BadFrame.

export class BadFrame extends Error {}

const REQUIRED = {
  hello: { version: "string", machine: "string", mode: "string", buses: "array", devices: "array" },
  state: { utime: "number", devices: "array", buses: "array", recorders: "array" },
  alarms: { device: "string", utime: "number", total: "number", entries: "array", appeared: "array", cleared: "array" },
  samples: { device: "string", dropped: "number", t0_utime: "number", dt_us: "array", columns: "object" },
  trend: { device: "string", column: "string", utimes: "array", values: "array" },
  trip: {
    device: "string",
    utime: "number",
    trip_count: "number",
    factors: "array",
    quantities: "array",
    samples: "array",
  },
  command: { id: "string", utime: "number", device: "string", operation: "string", state: "string", changes: "array" },
  playback: { utime: "number", playing: "boolean", speed: "number" },
  fleet_machines: { id: "number", utime: "number", more: "boolean", machines: "array" },
  fleet_devices: { id: "number", utime: "number", more: "boolean", devices: "array" },
  fleet_alarms: { id: "number", utime: "number", more: "boolean", alarms: "array" },
  fleet_commands: { id: "number", utime: "number", more: "boolean", commands: "array" },
  fleet_trips: { id: "number", utime: "number", more: "boolean", trips: "array" },
  fleet_curve: {
    id: "number",
    column: "string",
    unit: "string",
    step_us: "number",
    t0_utime: "number",
    dt_us: "array",
    value: "array",
  },
  fleet_error: { id: "number", away: "boolean", text: "string" },
  reset: {},
  error: { text: "string" },
};

function kindOf(value) {
  if (value === null) return "null";
  return Array.isArray(value) ? "array" : typeof value;
}

export function decode(text) {
  let frame;
  try {
    frame = JSON.parse(text);
  } catch {
    throw new BadFrame("a frame is no JSON");
  }
  if (kindOf(frame) !== "object" || typeof frame.type !== "string") throw new BadFrame("a frame has no type");
  if (!Object.hasOwn(REQUIRED, frame.type)) return null;
  for (const [field, kind] of Object.entries(REQUIRED[frame.type])) {
    if (kindOf(frame[field]) !== kind)
      throw new BadFrame(`${frame.type}.${field} is ${kindOf(frame[field])}, not ${kind}`);
  }
  return frame;
}

export const encode = {
  subscribe: (devices, history_s) => JSON.stringify({ type: "subscribe", devices, history_s }),
  seek: (utime) => JSON.stringify({ type: "seek", utime: Math.round(utime) }),
  play: () => JSON.stringify({ type: "play" }),
  pause: () => JSON.stringify({ type: "pause" }),
  fleet: (question) => JSON.stringify(question),
  speed: (factor) => JSON.stringify({ type: "speed", factor }),
};
