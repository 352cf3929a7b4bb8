"""`axlecast status` of a machine with more devices than fit on a screen (docs/cli.md, "status")."""

import json
import re
import unittest

from machine import Machine, wait_for

UNITS = [f"unit{number:02}" for number in range(1, 21)]
TEXT = """machine: many
bridge: {unsigned_commands: allow}
buses:
  modbus-0:
    family: saa_modbus
    simulate: true
    link: {baud: 57600}
    defaults: {bits: 18, timeout_us: 200000}
    devices:
      "unit{01..20}": {address: "{n}"}
"""


def rows(text):
    """The first word of each row between the numbers and the end."""
    body = text.split("\nalarms ", 1)[1].split("\n", 1)[1]
    return [line.split()[0] for line in re.split(r"(?m)^(?:good|not good):", body)[0].splitlines()]


class Status(Machine):
    def setUp(self):
        super().setUp()
        self.config = self.write(TEXT)
        self.simulator(self.config, "modbus-0")
        self.driver(self.config, "modbus-0", "saa-modbus")

    def status(self, *options):
        return self.axlecast("status", self.config, *options)

    def test_numbers_first_then_only_what_needs_attention(self):
        # Without a row of a device: a busy computer may have raised late_replies for a while.
        quiet = lambda: (lambda done: done[0] == 0 and rows(done[1]) == ["bridge"] and done[1])(self.status())
        good = wait_for(quiet, "a good machine that shows the bridge only")
        self.assertIn("devices                  20: 20 ONLINE\nbuses                    1: 1 UP\n", good)
        self.assertEqual(good.splitlines()[-1], "good: every device ONLINE, every bus UP")
        code, every_row, err = self.status("--all")
        self.assertEqual((code, rows(every_row)), (0, [*UNITS, "modbus-0", "bridge"]), every_row + err)

        self.set_simulated(self.config, "modbus-0", "unit07", fault="off")
        reported = lambda: (lambda done: re.search(r"(?m)^unit07 +OFFLINE .*\(.+\)$", done[1]) and done)(self.status())
        code, text, _ = wait_for(reported, "unit07 offline, with its reason")
        self.assertEqual(code, 1, text)
        self.assertIn("devices                  20: 19 ONLINE, 1 OFFLINE\n", text)
        self.assertIn("unit07", rows(text))
        self.assertLess(len(rows(text)), len(UNITS), "good rows are hidden")
        self.assertIn("\nnot good: devices or buses as above\n", text)

        code, out, err = self.status("--json")
        report = json.loads(out)
        self.assertEqual([entry["device"] for entry in report["devices"]], UNITS, err)
        self.assertEqual(report["counts"]["devices"],
                         {"total": 20, "online": 19, "degraded": 0, "offline": 1, "starting": 0, "silent": 0})
        self.assertEqual(report["counts"]["buses"]["total"], 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
