"""A storm of commands to many axes over relays that lose, double, delay and reorder what passes between client, bridge
and drivers: tests/campaign/command_storm.cpp sends and judges. AXLECAST_STORM and AXLECAST_STORM_AXES set how many
(tools/campaign), AXLECAST_SEED which."""

import os
import subprocess
import unittest

from machine import BIN, wait_for
from storm_machine import SEED, StormMachine, many_axes

COMMANDS = int(os.environ.get("AXLECAST_STORM", "80"))
AXES = int(os.environ.get("AXLECAST_STORM_AXES", "4"))
LOSS = float(os.environ.get("AXLECAST_STORM_LOSS", "0.3"))
PROGRAM = BIN.parent / "campaign" / "command_storm"
PER_COMMAND = 60  # s, on one axis; generous


class Storm(StormMachine):
    def test_each_acts_at_most_once_and_ends_as_the_encoder_says(self):
        self.write_files(many_axes(AXES))
        self.start("simulators", BIN / "axlecast", "simulate", self.drivers_file)
        wait_for(lambda: len(list(self.run_dir.glob("**/*.pty"))) == AXES, "the ptys")
        self.start_relays(LOSS)
        for axis in range(1, AXES + 1):
            self.driver(self.drivers_file, f"b{axis}")
        self.bridge(self.bridge_file)
        wait_for(lambda: "serving commands" in self.log("bridge"), lambda: self.log("bridge"))
        data = self.watch(self.drivers_file)
        for axis in range(1, AXES + 1):
            self.wait_online(data, f"axis{axis}")
        data.close()
        storm = subprocess.run([PROGRAM, str(COMMANDS), "--config", self.client_file, "--bridge-config",
                                self.bridge_file, "--journal", self.folder / "state/axlecast/storm/journal.db",
                                "--seed", str(SEED)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               timeout=60 + PER_COMMAND * COMMANDS / AXES)
        for process in self.processes[::-1]:
            process.terminate()
            process.wait(20)
        print(storm.stdout + self.log("relay-0") + self.log("relay-1"))
        self.assertEqual(storm.returncode, 0, storm.stdout[-4000:])


if __name__ == "__main__":
    unittest.main(verbosity=2)
