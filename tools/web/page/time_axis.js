// Where the marks of a time axis stand, and what they say.

const STEPS = [
  0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200,
  14400, 43200, 86400, 172800, 604800, 2592000, 7776000, 31536000,
];

// The shortest of the usual steps, in seconds, that leaves at most `marks` of them in `span`.
export function timeStep(span, marks) {
  return STEPS.find((step) => span / step <= marks) ?? STEPS.at(-1);
}

// Digits of a second that a step of that length needs.
export function stepDigits(step) {
  if (step >= 1) return 0;
  return step >= 0.1 ? 1 : step >= 0.01 ? 2 : 3;
}

// Instants of the marks from `left` to `right`, in seconds.
export function timeMarks(left, right, step) {
  const marks = [];
  for (let i = Math.ceil(left / step); i * step <= right; i += 1) marks.push(i * step);
  return marks;
}
