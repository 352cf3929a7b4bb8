// What the page says in words, of the words of the protocol.

const DEVICE_STATES = { ONLINE: "Online", DEGRADED: "Degraded", OFFLINE: "Offline", STARTING: "Starting" };
const BUS_STATES = { UP: "Up", DEGRADED: "Degraded", DOWN: "Down", STARTING: "Starting" };
const RECORDER_STATES = {
  RECORDING: "Recording",
  PRE_TRIGGER: "Waits for its trigger",
  DISK_FULL: "Disk full",
  ERROR: "Error",
  STOPPING: "Stopping",
  ENDED: "Ended",
};

export function stateWord(state) {
  if (state === null || state === undefined) return "Silent";
  return DEVICE_STATES[state] ?? BUS_STATES[state] ?? RECORDER_STATES[state] ?? readable(state);
}

// How a state is drawn: "good", "starting", "warning", "bad" or "silent".
export function stateLook(state) {
  if (state === null || state === undefined) return "silent";
  if (state === "ONLINE" || state === "UP" || state === "RECORDING" || state === "PRE_TRIGGER" || state === "ENDED") return "good";
  if (state === "STARTING" || state === "STOPPING") return "starting";
  return state === "DEGRADED" ? "warning" : "bad";
}

export const SEVERITIES = ["critical", "error", "warning", "info"];
const SEVERITY_WORDS = { critical: "Critical", error: "Error", warning: "Warning", info: "Note" };

export function severityWord(severity) {
  return SEVERITY_WORDS[severity] ?? readable(severity);
}

export function worse(a, b) {
  if (a === null || b === null) return a ?? b;
  return SEVERITIES.indexOf(a) <= SEVERITIES.indexOf(b) ? a : b;
}

const ALARM_STATES = {
  live: "Present now",
  device_latched: "Kept by the device until it is cleared",
  driver_latched: "Kept: its effect remains",
  unacknowledged: "Gone, not acknowledged",
  shelved: "Shelved by an operator",
  unknown: "Device offline: cannot tell",
};

export function alarmStateWord(state) {
  return ALARM_STATES[state] ?? readable(state);
}

// Flags of a reading worth telling, and how.
const FLAGS = {
  turns_wrapped: "Turn counter has overflowed",
  low_accuracy: "Reduced resolution",
  device_error: "Device reports an error",
  device_warning: "Device reports a warning",
  implausible: "Further away than the shaft can have come",
  turns_counted_by_driver: "Turns counted by the driver",
  datum_changing: "Datum is being changed",
  after_gap: "First reading after a gap",
  clock_stepped: "Clock was stepped",
  simulated: "Simulated",
  redecoded: "Decoded again from a recording",
  referenced: "Referenced",
};

export function flagWords(flags) {
  return flags.filter((flag) => flag in FLAGS).map((flag) => FLAGS[flag]);
}

const ERRORS = {
  timeout: "no reply",
  short: "reply ended early",
  framing: "character error",
  checksum: "wrong checksum",
  wrong_echo: "answers another request",
  communication_alarm: "device misread the request",
  abnormal_reply: "device refused the request",
  wrong_identity: "another device",
  range: "value out of range",
  implausible: "implausible",
  device: "device says not valid",
  stray: "bytes nobody asked for",
  busy: "busy",
  io: "refused by the system",
  exception: "protocol exception",
  silent: "fell silent",
};

export function errorWord(kind) {
  return ERRORS[kind] ?? readable(kind);
}

const COLUMNS = {
  value: "Position",
  turns: "Turns",
  speed_rpm: "Speed",
  voltage_v: "Voltage",
  current_a: "Current",
  power_w: "Power",
  temperature_c: "Temperature",
  accel_x_mps2: "Acceleration x",
  accel_y_mps2: "Acceleration y",
  accel_z_mps2: "Acceleration z",
};

export function columnWord(name) {
  return COLUMNS[name] ?? readable(name);
}

const LIMITS = {
  power_upper_a: "Power above A",
  power_upper_b: "Power above B",
  power_lower_a: "Power below A",
  power_lower_b: "Power below B",
  overheat: "Overheat",
  excessive_shock: "Shock",
};

export function limitWord(name) {
  return LIMITS[name] ?? readable(name);
}

const OUTCOMES = {
  accepted: "Accepted",
  routed: "On its way",
  running: "Running",
  succeeded: "Done",
  rejected: "Rejected",
  failed: "Failed",
  expired: "Expired",
  cancelled: "Cancelled",
  indeterminate: "Cannot tell",
};

// The state of a command: `verified` says that its effect was read back.
export function outcomeWord(state, verified) {
  if (state === "succeeded") return verified ? "Done, read back" : "Done, not verifiable";
  return OUTCOMES[state] ?? readable(state);
}

export function outcomeLook(state) {
  if (state === "succeeded") return "good";
  if (state === "failed" || state === "indeterminate") return "bad";
  if (state === "rejected" || state === "expired" || state === "cancelled") return "warning";
  return "starting";
}

// A name as a sentence's beginning: "counter_overflow" is "Counter overflow".
export function readable(name) {
  return sentence(String(name ?? "").replaceAll("_", " "));
}

// A text with a capital first, except where it begins with a name: those stay as they are.
export function sentence(text) {
  return /^\w*_/.test(text) ? text : text.charAt(0).toUpperCase() + text.slice(1);
}
