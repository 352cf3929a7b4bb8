"""Three machines whose buses and devices have equal names, on one LCM group and port. The shafts of each rest at an angle of its own, so
that every value states from which machine it is: no consumer of one machine may see another one's.

AXLECAST_READINGS: readings to look at (tools/campaign machines: 10^6)."""

import json
import os
import re
import time
import unittest

import lcm_log
from machine import BIN, Machine, wait_for

READINGS = int(os.environ.get("AXLECAST_READINGS", 3_000))
ANGLES = {"press1": 20, "press2": 140, "press3": 260}  # deg
COUNTS = {name: angle * (1 << 17) // 360 for name, angle in ANGLES.items()}
NEAR = 50  # counts


def machine(name):
    buses = "".join(f"  bus-{axis}: {{family: tformat, poll_hz: 500, simulate: {{{axis}: {{start_deg: {ANGLES[name]}}}}},\n"
                    f"    devices: {{{axis}: {{model: ts5669n127, unit: deg, timeout_us: 500000}}}}}}\n" for axis in ("x", "y"))
    return (f"machine: {name}\nbridge: {{unsigned_commands: allow}}\nsets: {{gantry: {{axes: [x, y], limit_us: 100000}}}}\n"
            f"recorder: {{logs: {{positions: {{channels: '^POSITION/'}}}}}}\nbuses:\n{buses}")


class EqualMachines(Machine):
    def setUp(self):
        super().setUp()
        self.configs = {name: self.write(machine(name), f"{name}.yaml") for name in ANGLES}
        self.seen = {}  # consumer: readings that it showed

    def up(self, name):
        return self.start(f"up-{name}", BIN / "axlecast", "up", self.configs[name], "--no-table")

    def check(self, consumer, name, counts):
        self.seen[consumer] = self.seen.get(consumer, 0) + 1
        self.assertLessEqual(abs(counts - COUNTS[name]), NEAR, f"{consumer} of {name}")

    def check_stream(self, name, watch, mark):
        """Checks what the watcher received since `mark`; returns the mark of the rest."""
        messages = watch.since(mark)
        for message in messages:
            channel = message["channel"]
            if channel.startswith("POSITION_SET/"):
                for axis in message["axes"]:
                    if axis["state"] == 0:
                        self.check("sets", name, axis["counts"])
            elif message["flags"] & 1:
                self.check("watch", name, message["counts"])
        return mark + len(messages)

    def check_info(self, name):
        position = json.loads(self.axlecast("info", "x", "--config", self.configs[name], "--json")[1])["position"]
        if position and position["flags"] & 1:
            self.check("info", name, position["counts"])

    def check_recording(self, name):
        position = lcm_log.generated_types().position_t
        for log in (self.folder / "state/axlecast" / name / "log").glob("**/*.lcm"):
            for channel, data in lcm_log.events(log):
                if channel.startswith("POSITION/") and (message := position.decode(data)).flags & 1:
                    self.check("recorder", name, message.counts)

    def named(self, name):
        """The other machines that status of the machine names."""
        return json.loads(self.axlecast("status", self.configs[name], "--json")[1])["reception"]["other_machines"]

    def test_no_reading_of_another_machine_is_seen(self):
        running = {name: self.up(name) for name in ANGLES}
        started = time.monotonic()
        for name in ANGLES:
            wait_for(lambda: set(self.named(name)) == set(ANGLES) - {name}, lambda: f"{name} names the others, not {self.named(name)}")
        print(f"each of {len(ANGLES)} machines names the others {time.monotonic() - started:.1f} s after the start", flush=True)
        watches = {name: self.watch(self.configs[name], "--channel", "^POSITION(_SET)?/") for name in ANGLES}
        marks = dict.fromkeys(ANGLES, 0)
        while sum(marks.values()) < READINGS:
            before = sum(marks.values())
            for name, watch in watches.items():
                self.check_info(name)
                marks[name] = self.check_stream(name, watch, marks[name])
            wait_for(lambda: sum(watch.mark() for watch in watches.values()) > before, lambda: [self.log(f"up-{name}") for name in ANGLES])
        for process in running.values():
            process.terminate()
        for process in running.values():
            process.wait(60)
        for name in ANGLES:
            self.check_recording(name)
        print("readings seen, none of another machine: " + ", ".join(f"{consumer} {count}" for consumer, count in self.seen.items()))
        self.assertEqual(set(self.seen), {"watch", "sets", "info", "recorder"})

    def test_a_consumer_without_a_machine_file_mixes_nothing(self):
        """It shows no value while two machines publish its device."""
        self.up("press1")
        self.start("consumer", BIN / "print_position", "x")
        wait_for(lambda: " ms old" in self.log("consumer"), lambda: self.log("consumer"))
        self.up("press2")
        wait_for(lambda: "two drivers publish this device" in self.log("consumer"), lambda: self.log("consumer")[-1000:])
        for value in re.findall(r"^ *(-?[\d.]+)  [\d.]+ ms old", self.log("consumer"), re.MULTILINE):
            self.check("print_position", "press1", float(value) / 360 * (1 << 17))


if __name__ == "__main__":
    unittest.main()
