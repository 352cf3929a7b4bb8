// The machine as the server's frames tell it. Knows no browser: frames in, state to look at; `revision` counts what the
// views compare to draw only what is new.

import { Samples } from "./samples.js";
import { SEVERITIES, worse } from "./words.js";

const KEPT_COMMANDS = 500;
const KEPT_TRIPS = 200;
const KEPT_NOTES = 50;

export class Machine {
  constructor() {
    this.hello = null;
    this.devices = new Map(); // name -> entry of hello
    this.buses = new Map();
    this.revision = { hello: 0, state: 0, alarms: 0, trips: 0, commands: 0, playback: 0 };
    this.subscribed = new Set();
    this.#forget();
  }

  #forget() {
    this.state = null;
    this.stateOf = { device: new Map(), bus: new Map() };
    this.playback = null;
    this.#voidPast();
  }

  // After a reset or a new connection: the server tells again what there is.
  #voidPast() {
    this.alarms = new Map(); // device -> frame
    this.trips = new Map(); // "device/count" -> frame
    this.commands = new Map(); // id -> frame, oldest first
    this.samples = new Map(); // device -> Samples
    this.trends = new Map(); // device -> frame
    this.notes = []; // alarms that appeared or went, newest first
    for (const kind of ["alarms", "trips", "commands"]) this.revision[kind] += 1;
  }

  apply(frame) {
    this.#HANDLERS[frame.type]?.(frame);
  }

  #HANDLERS = {
    hello: (frame) => this.#onHello(frame),
    state: (frame) => this.#onState(frame),
    alarms: (frame) => this.#onAlarms(frame),
    samples: (frame) => this.#onSamples(frame),
    trend: (frame) => this.trends.set(frame.device, frame),
    trip: (frame) => this.#onTrip(frame),
    command: (frame) => this.#onCommand(frame),
    playback: (frame) => {
      this.playback = frame;
      this.revision.playback += 1;
    },
    reset: () => this.#voidPast(),
  };

  // A new connection. What was known is void; the page goes on to show it as old until the server tells anew.
  connected() {
    this.#forget();
  }

  #onHello(frame) {
    this.hello = frame;
    this.devices = new Map(frame.devices.map((device) => [device.device, device]));
    this.buses = new Map(frame.buses.map((bus) => [bus.bus, bus]));
    this.revision.hello += 1;
  }

  #onState(frame) {
    this.state = frame;
    this.stateOf.device = new Map(frame.devices.map((device) => [device.device, device]));
    this.stateOf.bus = new Map(frame.buses.map((bus) => [bus.bus, bus]));
    this.revision.state += 1;
  }

  #onAlarms(frame) {
    const isFirst = !this.alarms.has(frame.device);
    this.alarms.set(frame.device, frame);
    if (!isFirst) {
      const note = (change) => (name) => this.notes.unshift({ utime: frame.utime, device: frame.device, name, change });
      frame.cleared.forEach(note("cleared"));
      frame.appeared.forEach(note("appeared"));
      this.notes.length = Math.min(this.notes.length, KEPT_NOTES);
    }
    this.revision.alarms += 1;
  }

  #onSamples(frame) {
    if (!this.subscribed.has(frame.device)) return; // was on its way when the page asked for no more
    this.samplesOf(frame.device)?.append(frame);
  }

  #onTrip(frame) {
    const key = `${frame.device}/${frame.trip_count}`;
    this.trips.delete(key);
    this.trips.set(key, frame);
    if (this.trips.size > KEPT_TRIPS) this.trips.delete(this.trips.keys().next().value);
    this.revision.trips += 1;
  }

  #onCommand(frame) {
    this.commands.set(frame.id, frame);
    if (this.commands.size > KEPT_COMMANDS) this.commands.delete(this.commands.keys().next().value);
    this.revision.commands += 1;
  }

  // The samples of exactly these devices are kept from now on.
  subscribe(devices) {
    this.subscribed = new Set(devices);
    for (const device of this.samples.keys()) {
      if (!this.subscribed.has(device)) this.samples.delete(device);
    }
  }

  samplesOf(device) {
    const known = this.devices.get(device);
    if (!known) return undefined;
    if (!this.samples.has(device)) this.samples.set(device, new Samples(known.columns.map((column) => column.name)));
    return this.samples.get(device);
  }

  // All alarms of the machine, the worst and newest first: {device, entry}.
  allAlarms() {
    const all = [];
    for (const frame of this.alarms.values()) {
      for (const entry of frame.entries) all.push({ device: frame.device, entry });
    }
    const rank = (alarm) => SEVERITIES.indexOf(alarm.entry.severity);
    return all.sort((a, b) => rank(a) - rank(b) || b.entry.first_utime - a.entry.first_utime);
  }

  worstOf(device) {
    return (this.alarms.get(device)?.entries ?? []).reduce((worst, entry) => worse(worst, entry.severity), null);
  }

  // Readings that this page did not get because it was too slow.
  get dropped() {
    let sum = 0;
    for (const samples of this.samples.values()) sum += samples.dropped;
    return sum;
  }

  get isSimulated() {
    return this.hello?.buses.some((bus) => bus.simulated) ?? false;
  }
}
