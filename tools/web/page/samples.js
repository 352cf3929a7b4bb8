// The newest readings of one device, in columns: time in seconds (UNIX) and one Float64Array per quantity. NaN is a reading
// that was not valid. Times ascend, so that an instant is found by halving; what comes out of order is left out.

const FIRST_CAPACITY = 2048;
const KEPT = 1 << 17;

export class Samples {
  constructor(names, kept = KEPT) {
    this.names = names;
    this.kept = kept;
    this.clear();
  }

  clear() {
    this.length = 0;
    this.dropped = 0;
    this.version = 0; // changes with every append
    const capacity = Math.min(FIRST_CAPACITY, 2 * this.kept);
    this.time = new Float64Array(capacity);
    this.columns = this.names.map(() => new Float64Array(capacity));
  }

  // One `samples` frame.
  append(frame) {
    const start = frame.t0_utime;
    for (let i = 0; i < frame.dt_us.length; i += 1) {
      const time = (start + frame.dt_us[i]) / 1e6;
      if (this.length > 0 && !(time > this.time[this.length - 1])) continue;
      if (this.length === this.time.length) this.#makeRoom();
      this.time[this.length] = time;
      for (let c = 0; c < this.names.length; c += 1) {
        const value = frame.columns[this.names[c]]?.[i];
        this.columns[c][this.length] = typeof value === "number" ? value : NaN;
      }
      this.length += 1;
    }
    this.dropped = frame.dropped;
    this.version += 1;
  }

  column(name) {
    return this.columns[this.names.indexOf(name)];
  }

  // Index of the first reading at or after `time`; `length` when there is none.
  lowerBound(time) {
    let low = 0;
    let high = this.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time[middle] < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // Index of the reading nearest to `time`, -1 when there is none.
  nearest(time) {
    const after = this.lowerBound(time);
    if (after === this.length) return this.length - 1;
    if (after === 0) return 0;
    return time - this.time[after - 1] <= this.time[after] - time ? after - 1 : after;
  }

  // Doubles up to twice what is kept; then the older half makes room.
  #makeRoom() {
    const capacity = this.time.length;
    if (capacity < 2 * this.kept) {
      const larger = Math.min(2 * capacity, 2 * this.kept);
      this.time = grown(this.time, larger);
      this.columns = this.columns.map((column) => grown(column, larger));
      return;
    }
    const from = this.length - this.kept;
    this.time.copyWithin(0, from);
    for (const column of this.columns) column.copyWithin(0, from);
    this.length = this.kept;
  }
}

function grown(array, capacity) {
  const larger = new Float64Array(capacity);
  larger.set(array);
  return larger;
}
