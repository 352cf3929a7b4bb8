#!/usr/bin/env python3
"""many_devices.py [--seconds N] [--devices N]: many devices at 100 Hz, shown by Foxglove's own client, while its twin reads nothing. Prints what
the drivers published and what the viewer received, and what the server needs; exits 1 if the viewer has lost a message, or a driver has
not reached 99 % of its rate. Run in a network of its own, with FOXGLOVE_READER as the tests have it (tools/campaign does)."""

import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import unittest

from machine import BIN, Machine, wait_for

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
sys.path.insert(0, str(SOURCE / "tests/web"))
from fleet import HZ, machine_of, resident_mb  # noqa: E402 pylint: disable=wrong-import-position

READER = pathlib.Path(os.environ["FOXGLOVE_READER"]) / "read.mjs"
RATE = 0.99


class Viewed(Machine):
    options = None

    def test_viewed(self):
        config = self.write(machine_of(self.options.devices))
        names = [f"d{i:02}" for i in range(self.options.devices)]
        data = self.watch(config, "--channel", "^DEVICE/")
        self.start("up", BIN / "axlecast", "up", config, "--no-table")
        for name in names:
            self.wait_online(data, name)
        data.close()
        server = self.start("foxglove", BIN / "axlecast", "foxglove", config, "--port", "0")
        wait_for(lambda: re.search(r"ws://\S+", self.log("foxglove")), lambda: self.log("foxglove"))
        url = re.search(r"ws://\S+", self.log("foxglove"))[0]
        stalled = subprocess.Popen(["node", READER, url, "--stalled"], stdout=subprocess.DEVNULL)
        self.addCleanup(stalled.wait)
        self.addCleanup(stalled.kill)
        before = self.cpu_seconds(server.pid)
        viewer = subprocess.run(["node", READER, url, "--seconds", str(self.options.seconds)], stdout=subprocess.PIPE, check=True)
        cpu = self.cpu_seconds(server.pid) - before
        seen = json.loads(viewer.stdout)
        positions = [seen["topics"][f"/POSITION/{name}"] for name in names]
        rates = [self.rate(position) for position in positions]
        lost = sum(position["gaps"] for position in positions)
        print(f"{len(names)} channels at {HZ} Hz for {self.options.seconds} s, {os.cpu_count()} processors: the viewer has decoded "
              f"{sum(position['messages'] for position in positions)} positions, {lost} lost; rates of the drivers {min(rates):.1f} to "
              f"{max(rates):.1f}/s; the server: {100 * cpu / self.options.seconds:.1f} % of a core, {resident_mb(server.pid):.0f} MB")
        self.assertEqual((lost, seen["status"]), (0, []))
        self.assertGreaterEqual(min(rates), RATE * HZ)

    @staticmethod
    def rate(topic):
        """Messages a second that the driver has published, by its numbers."""
        first, last = topic["first"]["message"], topic["last"]["message"]
        return 1e6 * (int(last["seq"]) - int(first["seq"])) / (int(last["utime"]) - int(first["utime"]))

    @staticmethod
    def cpu_seconds(pid):
        fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--devices", type=int, default=100)
    Viewed.options = parser.parse_args()
    result = unittest.TextTestRunner(verbosity=0).run(Viewed("test_viewed"))
    return 0 if result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
