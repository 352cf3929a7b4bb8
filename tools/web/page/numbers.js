// Numbers and instants as the page writes them. Unknown is "–", never 0.

export const UNKNOWN = "–";
const MINUS = "−";

// Digits behind the point that are worth reading, by unit.
const DIGITS = {
  mm: 3,
  deg: 3,
  rad: 4,
  turn: 4,
  m: 4,
  um: 1,
  inch: 4,
  count: 0,
  rpm: 1,
  V: 1,
  A: 3,
  W: 1,
  "°C": 1,
  "m/s²": 2,
};
const SHOWN_UNITS = { deg: "°", count: "counts", turn: "turns", um: "µm", inch: "in", rpm: "rpm" };

const isNumber = (value) => typeof value === "number" && Number.isFinite(value);

export function fixed(value, digits) {
  if (!isNumber(value)) return UNKNOWN;
  const text = Math.abs(value).toFixed(digits);
  return value < 0 && Number(text) !== 0 ? MINUS + text : text;
}

export function quantity(value, unit) {
  return fixed(value, DIGITS[unit] ?? 2);
}

export function unitText(unit) {
  return SHOWN_UNITS[unit] ?? unit ?? "";
}

// 1234567 as "1 234 567", with narrow spaces.
export function count(value) {
  if (!isNumber(value)) return UNKNOWN;
  const digits = String(Math.round(Math.abs(value))).replace(/\B(?=(\d{3})+$)/g, "\u202f");
  return value < 0 ? MINUS + digits : digits;
}

export function rate(hz) {
  if (!isNumber(hz)) return UNKNOWN;
  return hz >= 100 ? count(hz) : fixed(hz, hz >= 10 ? 1 : 2);
}

export function percent(share) {
  if (!isNumber(share)) return UNKNOWN;
  return `${fixed(share * 100, share < 0.1 ? 1 : 0)} %`;
}

const SIZES = ["B", "kB", "MB", "GB", "TB"];

export function bytes(value) {
  if (!isNumber(value)) return UNKNOWN;
  let scale = 0;
  while (value >= 999.5 && scale < SIZES.length - 1) {
    value /= 1000;
    scale += 1;
  }
  return `${fixed(value, scale === 0 || value >= 99.95 ? 0 : 1)} ${SIZES[scale]}`;
}

export function microseconds(us) {
  if (!isNumber(us)) return UNKNOWN;
  if (us < 1000) return `${fixed(us, us < 10 ? 1 : 0)} µs`;
  if (us < 1e6) return `${fixed(us / 1e3, us < 1e4 ? 2 : 1)} ms`;
  return `${fixed(us / 1e6, 2)} s`;
}

// How long ago, or how long: "0.4 s", "12 s", "3 min 05 s", "2 h 10 min", "4 d 03 h".
export function duration(us) {
  if (!isNumber(us)) return UNKNOWN;
  const seconds = Math.max(0, us) / 1e6;
  if (seconds < 9.95) return `${seconds.toFixed(1)} s`;
  const whole = Math.round(seconds);
  const two = (value) => String(value).padStart(2, "0");
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${two(whole % 60)} s`;
  if (whole < 86400) return `${Math.floor(whole / 3600)} h ${two(Math.floor((whole % 3600) / 60))} min`;
  return `${Math.floor(whole / 86400)} d ${two(Math.floor((whole % 86400) / 3600))} h`;
}

// Time of day where the reader is, with as many digits of a second as asked for.
export function timeOfDay(utime, digits = 0) {
  if (!isNumber(utime) || utime <= 0) return UNKNOWN;
  const step = 10 ** (6 - digits);
  const date = new Date(Math.floor(utime / step) * (step / 1000));
  const two = (value) => String(value).padStart(2, "0");
  const clock = `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}`;
  if (digits === 0) return clock;
  const fraction = Math.floor((utime % 1e6) / step);
  return `${clock}.${String(fraction).padStart(digits, "0")}`;
}

export function dateText(utime) {
  if (!isNumber(utime) || utime <= 0) return UNKNOWN;
  const date = new Date(utime / 1000);
  const two = (value) => String(value).padStart(2, "0");
  return `${date.getFullYear()}-${two(date.getMonth() + 1)}-${two(date.getDate())}`;
}

// "UTC+1", "UTC−3:30": what timeOfDay counts from.
export function zoneText(utime) {
  const minutes = -new Date(utime / 1000).getTimezoneOffset();
  if (minutes === 0) return "UTC";
  const hours = Math.floor(Math.abs(minutes) / 60);
  const rest = Math.abs(minutes) % 60;
  return `UTC${minutes < 0 ? MINUS : "+"}${hours}${rest ? `:${String(rest).padStart(2, "0")}` : ""}`;
}
