// Curves of the fleet database as the strips draw them: which part of the past is loaded, and what must be asked next.

import { Samples } from "./samples.js";

export const POSITION_COLUMNS = [
  { name: "value", unit: null },
  { name: "turns", unit: "turn" },
];
export const MOTOR_COLUMNS = [
  { name: "power_w", unit: "W" },
  { name: "current_a", unit: "A" },
  { name: "voltage_v", unit: "V" },
  { name: "temperature_c", unit: "°C" },
  { name: "accel_x_mps2", unit: "m/s²" },
  { name: "accel_y_mps2", unit: "m/s²" },
  { name: "accel_z_mps2", unit: "m/s²" },
];

const HUES = 8;
const MOST_SAMPLES = 8192;
const SPARE = 0.15; // of the time shown, loaded beyond each of its ends
const SHORTEST_GAP_S = 0.25;
const GAPS = 3.5; // intervals without a point that interrupt a curve
const REFRESH_S = 2; // shortest time between two questions while the newest data are followed

let versions = 0;

export function columnsOf(device) {
  return device.kind === "motor" ? MOTOR_COLUMNS : device.kind === "position" ? POSITION_COLUMNS : [];
}

// Returns the channel of "axis1.value", or null if it does not exist. `devices`: rows of fleet_devices.
export function fleetChannel(devices, key) {
  const dot = key.lastIndexOf(".");
  const place = devices.findIndex((device) => device.device === key.slice(0, dot));
  if (place < 0) return null;
  const columns = columnsOf(devices[place]);
  const index = columns.findIndex((column) => column.name === key.slice(dot + 1));
  if (index < 0) return null;
  const { device, unit } = devices[place];
  const column = columns[index];
  return { key, source: key, device, column: column.name, unit: column.unit ?? unit, colour: (place + 3 * index) % HUES };
}

// How long two points of a frame may be apart and still be connected, in seconds.
function gapOf(frame) {
  if (frame.step_us > 0) return (GAPS * frame.step_us) / 1e6;
  const steps = frame.dt_us.slice(1).map((dt, i) => dt - frame.dt_us[i]);
  steps.sort((a, b) => a - b);
  return Math.max(SHORTEST_GAP_S, (GAPS * (steps[steps.length >> 1] ?? 0)) / 1e6);
}

// One frame fleet_curve as Samples with the columns COLUMN and, of intervals, `low` and `high`.
export function samplesOf(frame) {
  const columns = { [frame.column]: frame.value };
  if (frame.step_us > 0) Object.assign(columns, { low: frame.low, high: frame.high });
  const samples = new Samples(Object.keys(columns), MOST_SAMPLES);
  samples.append({ t0_utime: frame.t0_utime, dt_us: frame.dt_us, columns, dropped: 0 });
  samples.gap = gapOf(frame);
  samples.unit = frame.unit;
  versions += 1;
  samples.version = versions;
  return samples;
}

// What is loaded of one channel.
export class LoadedCurve {
  constructor() {
    this.from = NaN; // s
    this.to = NaN;
    this.at = -Infinity; // when it was asked
  }

  // The time to ask for so that `from` to `to` can be drawn, or null if what is loaded is enough. `following`: the right edge
  // is now.
  wanted(from, to, now, following) {
    const span = to - from;
    const loaded = this.to - this.from;
    const covers = this.from <= from && (following || this.to >= Math.min(to, now));
    const fits = loaded <= 2.5 * span; // of a much longer time the points are too far apart
    const fresh = !following || now - this.at < Math.max(REFRESH_S, span / 300);
    if (covers && fits && fresh) return null;
    return { from: Math.max(0, from - SPARE * span), to: to + SPARE * span };
  }

  set(range, now) {
    this.from = range.from;
    this.to = range.to;
    this.at = now;
  }
}
