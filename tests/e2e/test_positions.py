"""What a consumer of positions gets from every encoder of the demo machine: the example print_position, ten times a second."""

import collections
import json
import os
import pathlib
import re
import unittest

from machine import BIN, Machine, wait_for

DEMO = pathlib.Path(os.environ["AXLECAST_SOURCE"]) / "config/demo.yaml"
MONITORS = "tsubaki_sc"  # they publish no position
LINES, SHARE, AT_A_TIME = 40, 0.95, 3
POSITION = re.compile(r"^ *-?\d+\.\d+  -?\d+\.\d ms old  \d+ lost")
# The device published nothing that may be used: the reason.
SILENT = re.compile(r"^no position: (the newest valid reading is too old|the driver marks|no DEVICE|no valid reading|no reading"
                    r"|a reading at this instant is not valid)")
NEWS = re.compile(r"^(the driver was restarted|the datum changed)")


class Positions(Machine):
    def start_demo(self):
        """DEVICE of every device, by name."""
        self.start("up", BIN / "axlecast", "up", DEMO, "--no-table")
        data = self.watch(DEMO, "--channel", "^DEVICE/")
        names = [device["device"] for bus in json.loads(self.axlecast("check-config", DEMO, "--json")[1])["buses"]
                 for device in bus["devices"]]
        return wait_for(lambda: (lambda found: found if all(found.values()) else None)(
            {name: data.last(f"DEVICE/{name}") for name in names}), lambda: f"DEVICE of {names}: {self.log('up')}")

    def printed(self, device):
        """Its whole lines about positions."""
        lines = self.log(f"print-{device}").split("\n")[:-1]
        return [line for line in lines if not NEWS.match(line)]

    def newest_have_positions(self, device):
        """Whether positions were printed for what the device published. A busy host may refuse some of them for a while."""
        published = [line for line in self.printed(device) if not SILENT.search(line)][-LINES:]
        return len(published) == LINES and sum(1 for line in published if POSITION.match(line)) >= SHARE * LINES

    def count(self, devices):
        printing = [self.start(f"print-{name}", BIN / "print_position", name) for name in devices]
        wait_for(lambda: all(self.newest_have_positions(name) for name in devices),
                 lambda: {name: collections.Counter(line for line in self.printed(name) if not POSITION.match(line))
                          for name in devices})
        for process in printing:
            self.kill(process)

    def test_every_encoder_of_the_demo_is_printed_or_the_reason(self):
        infos = self.start_demo()
        encoders = [name for name, info in infos.items() if info["family"] != MONITORS]
        self.assertGreater(len(encoders), 8)
        for first in range(0, len(encoders), AT_A_TIME):  # all at once would be a load of their own
            self.count(encoders[first:first + AT_A_TIME])
        for name in encoders:
            for line in self.printed(name):
                self.assertRegex(line, POSITION.pattern + r"|^no position: \w.{10}", name)


if __name__ == "__main__":
    unittest.main()
