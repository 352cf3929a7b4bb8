// The server's time between two of its messages, so that charts move on evenly. `now` is this browser's monotonic clock in
// ms. It never goes on for longer than LOOK_AHEAD after the last message: silence is no news.

const LOOK_AHEAD_MS = 600;
const FORGET_MS = 2000; // a delay that has gone is forgotten as slowly as this

export class ServerClock {
  constructor() {
    this.forget();
  }

  forget() {
    this.known = false;
    this.speed = 1;
  }

  // A message of the server's instant `utime` came now; it goes on at `speed` times real time (0: a log that is paused).
  hear(utime, now, speed = 1) {
    const predicted = this.at(now);
    const jumped = !this.known || speed !== this.speed || Math.abs(utime - predicted) > 1e6 * Math.max(1, speed);
    if (jumped || speed === 0) this.utime = utime;
    else if (utime >= predicted)
      this.utime = utime; // the least delayed message is the truest
    else this.utime = predicted + (utime - predicted) * Math.min(1, (now - this.heard) / FORGET_MS);
    this.heard = now;
    this.speed = speed;
    this.known = true;
  }

  at(now) {
    if (!this.known) return 0;
    return this.utime + Math.min(now - this.heard, LOOK_AHEAD_MS) * 1000 * this.speed;
  }
}
