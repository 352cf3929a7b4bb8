#!/usr/bin/env python3
"""fleet.py [--seconds N] [--devices N] [--browsers N]: many devices at 100 Hz, shown by several browsers of which one is
stalled (SIGSTOP) for a while. Prints what the drivers, the pages and the server did, before, during and after; exits 1 where
a target is missed: drivers at 99 % of their rate, every page that is not stalled at 20 frames/s with no reading left out.
Run in a network of its own with AXLECAST_BIN, AXLECAST_SOURCE and PYTHONPATH as tests/e2e are (tools/campaign does)."""

import argparse
import os
import pathlib
import signal
import time
import unittest

from machine import wait_for
from page import DESKTOP, PageTest

HZ = 100
A_BUS = 25  # devices on one CAN bus
RATE, FRAMES = 0.99, 20.0  # the targets
STRIPS = 6
COUNT_FRAMES = "window.frames = 0; (function next() { window.frames += 1; requestAnimationFrame(next); })();"


def machine_of(devices):
    """A machine's file: buses of SAA encoders that each send 100 positions a second by themselves."""
    lines = ["machine: fleet", "buses:"]
    for first in range(0, devices, A_BUS):
        names = [f"d{i:02}" for i in range(first, min(first + A_BUS, devices))]
        lines += [f"  can-{first // A_BUS}:", "    family: saa_can", "    link: {bitrate: 1000000}", "    simulate:"]
        lines += [f"      {name}: {{motion: 'sine:{20 + i},{3 + i % 7}', accel_rad_s2: 50, period_factor: 1}}" for i, name in enumerate(names)]
        lines += ["    devices:"]
        lines += [f"      {name}: {{model: saa58p24, bits: 16, node: {16 + i}, period_ms: {1000 // HZ}, unit: deg,"
                  " limits: {speed_rpm: 500}}" for i, name in enumerate(names)]
    return "\n".join(lines) + "\n"


def resident_mb(pid):
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) / 1024


class Fleet(PageTest):
    options = None

    def setUp(self):
        super().setUp()
        self.failures = []

    def test_fleet(self):
        names = [f"d{i:02}" for i in range(self.options.devices)]
        self.config = self.write(machine_of(self.options.devices))
        self.data = self.watch(self.config, "--channel", "^DEVICE/")
        self.up(self.config)
        for name in names:
            self.wait_online(self.data, name)
        url = self.serve(self.config)
        self.server = self.processes[-1]
        self.browsers = [self.look(url, names[i * STRIPS:(i + 1) * STRIPS]) for i in range(self.options.browsers)]
        print(f"{len(names)} devices at {HZ} Hz, {len(self.browsers)} browsers with {STRIPS} strips each, "
              f"{os.cpu_count()} cores, {self.options.seconds} s a phase")
        self.phase("all run", self.browsers)
        *others, stalled = self.browsers
        ids = stalled.processes()
        for pid in ids:
            os.kill(pid, signal.SIGSTOP)
        try:
            self.phase("one stalled", others)
        finally:
            for pid in ids:
                os.kill(pid, signal.SIGCONT)
        stalled.wait("return document.querySelector('.freshness').dataset.fresh === 'true'", "the stalled one is live again")
        self.phase("it runs again", self.browsers)
        print(f"the page that was stalled: {stalled.text('.tag.warn') or 'nothing left out, or connected anew'}")
        self.assertEqual(self.failures, [])

    def look(self, url, names):
        browser = self.browse(f"{url}#charts/{','.join(f'{name}.value' for name in names)}", DESKTOP)
        browser.wait("return [...document.querySelectorAll('.strip .number')].filter((each) => /\\d/.test(each.innerText)).length"
                     " === arguments[0]", "all strips have readings", STRIPS)
        browser.run(COUNT_FRAMES)
        return browser

    def good(self):
        """Good readings of each device, and the instant that they are of."""
        mark = self.data.mark()
        names = [f"DEVICE/d{i:02}" for i in range(self.options.devices)]
        wait_for(lambda: {message["channel"] for message in self.data.since(mark)} >= set(names), "news of each device")
        return {message["channel"]: (message["good"], message["mono_ns"]) for message in self.data.since(mark)}

    def phase(self, what, browsers):
        readings, frames, start = self.good(), [each.run("return window.frames") for each in browsers], time.monotonic()
        time.sleep(self.options.seconds)  # what is measured is a span of time
        passed = time.monotonic() - start
        shown = [(each.run("return window.frames") - before) / passed for each, before in zip(browsers, frames)]
        after = self.good()
        rates = [(after[name][0] - good) / (after[name][1] - mono) * 1e9 / HZ for name, (good, mono) in readings.items()]
        left_out = [each.text(".tag.warn") or "none" for each in browsers]
        print(f"{what:14} drivers {100 * min(rates):.1f} % (least), {100 * sum(rates) / len(rates):.1f} % (mean); "
              f"pages {', '.join(f'{each:.1f}' for each in shown)} frames/s; left out: {', '.join(left_out)}; "
              f"server {resident_mb(self.server.pid):.0f} MB", flush=True)
        if min(rates) < RATE:
            self.failures.append(f"{what}: a driver at {100 * min(rates):.1f} %")
        if min(shown) < FRAMES:
            self.failures.append(f"{what}: a page at {min(shown):.1f} frames/s")
        if what != "it runs again" and set(left_out) != {"none"}:
            self.failures.append(f"{what}: readings left out: {left_out}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--devices", type=int, default=50)
    parser.add_argument("--browsers", type=int, default=3)
    Fleet.options = parser.parse_args()
    unittest.main(argv=["fleet.py"])


if __name__ == "__main__":
    main()
