// The page: connects, keeps the machine, shows one view of it. docs/web_protocol.md says what comes and goes.

import { Announcer } from "./announcer.js";
import { BusView } from "./bus_view.js";
import { ChartView } from "./chart_view.js";
import { CommandView } from "./command_view.js";
import { DeviceView } from "./device_view.js";
import { FleetClient } from "./fleet_client.js";
import { FleetView } from "./fleet_view.js";
import { encode } from "./frames.js";
import { Link } from "./link.js";
import { Machine } from "./machine.js";
import { MachineView } from "./machine_view.js";
import { PageHead } from "./page_head.js";
import { PlaybackBar } from "./playback_bar.js";
import { RecorderView } from "./recorder_view.js";
import { ServerClock } from "./server_clock.js";
import { hasCurves } from "./strip.js";
import { themeButton } from "./theme.js";
import { TripView } from "./trip_view.js";

const HISTORY_S = 600;
const LOOK_MS = 250; // how often texts that depend on time alone are renewed

const machine = new Machine();
const clock = new ServerClock();
const time = { now: () => clock.at(performance.now()) / 1e6, speed: () => clock.speed };
const navigate = (address) => {
  location.hash = address;
};

const note = (address) => history.replaceState(null, "", address);
const fleet = new FleetClient((text) => link.send(text));

const views = {
  machine: new MachineView(machine),
  charts: new ChartView(machine, time, note),
  buses: new BusView(machine),
  trips: new TripView(machine, navigate),
  commands: new CommandView(machine),
  recorders: new RecorderView(machine),
  device: new DeviceView(machine, time),
  fleet: new FleetView(fleet, time, { navigate, note }),
};

const main = document.getElementById("main");
const announcer = new Announcer(document.getElementById("announcements"));
const head = new PageHead(
  machine,
  () => link,
  themeButton(() => {
    for (const view of [views.charts, views.device, views.fleet]) view.stack.recolour();
  }),
);
const playback = new PlaybackBar(machine, clock, (text) => link.send(text));
document.getElementById("head").append(head.root);
document.getElementById("foot").append(playback.root);

let current = null;
let isNew = true; // something came since the last frame was drawn

function show() {
  const isFleet = machine.hello?.mode === "fleet"; // then there is nothing else
  const [, asked = "machine", rest] = location.hash.match(/^#([a-z]+)(?:\/(.*))?$/) ?? [];
  const name = isFleet ? "fleet" : asked in views ? asked : "machine";
  const view = views[name];
  view.open?.(asked === name ? rest : undefined);
  if (view !== current) {
    current = view;
    main.replaceChildren(view.root);
    main.scrollTop = 0;
  }
  head.goTo(name);
  document.title = `${machine.hello?.machine ?? "axlecast"} · ${name === "device" ? decodeURIComponent(rest ?? "") : name}`;
  isNew = true;
}

// Asks for the samples that views want, when that has changed.
let asked = "";
function subscribe() {
  const wanted = new Set([...views.charts.devices, ...(current === views.device ? views.device.devices : [])]);
  const devices = hasCurves ? [...wanted].sort() : [];
  if (devices.join() === asked || link.state !== "open" || !machine.hello) return;
  asked = devices.join();
  machine.subscribe(devices);
  link.send(encode.subscribe(devices, Math.min(HISTORY_S, machine.hello.history_s ?? 0)));
}

const handlers = {
  hello: () => {
    asked = "";
    show();
  },
  state: (frame) => {
    if (machine.hello?.mode !== "log") clock.hear(frame.utime, performance.now());
  },
  alarms: (frame) => announcer.hear(frame),
  playback: (frame) => clock.hear(frame.utime, performance.now(), frame.playing ? frame.speed : 0),
  reset: () => {
    announcer.forget();
    clock.forget();
    for (const view of [views.charts, views.device]) view.stack.follow();
  },
};

const link = new Link(
  {
    open: () =>
      new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`, "axlecast-web-1"),
    after: (ms, act) => setTimeout(act, ms),
    now: () => performance.now(),
  },
  {
    open: () => {
      machine.connected();
      announcer.forget();
      clock.forget();
      fleet.connected();
      views.fleet.connected();
    },
    frame: (frame) => {
      if (!fleet.hear(frame)) machine.apply(frame);
      handlers[frame.type]?.(frame);
      isNew = true;
    },
    change: () => {
      isNew = true;
    },
  },
);

let lookedAt = 0;
let revisions = "";
function frame(now) {
  requestAnimationFrame(frame);
  if (now - lookedAt >= LOOK_MS) isNew = true;
  if (isNew) {
    isNew = false;
    lookedAt = now;
    const newest = Object.values(machine.revision).join();
    if (newest !== revisions || current.root.dataset.open !== location.hash) {
      revisions = newest;
      current.root.dataset.open = location.hash;
      current.update();
    }
    playback.update();
    head.update(clock.at(now));
    subscribe();
  }
  current.draw?.(now);
  playback.draw(now);
}

addEventListener("hashchange", show);
show();
requestAnimationFrame(frame);
