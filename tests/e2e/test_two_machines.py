"""Two machines whose buses and devices have equal names, on one LCM group and port: none mixes up their messages."""

import json
import subprocess
import unittest

import lcm_log
from machine import BIN, Machine, one_axis, wait_for

NAMES = ("press1", "press2")
UNITS = {"press1": ("deg", 3), "press2": ("turn", 1)}  # of each axis, in the file and in position_t


class TwoMachines(Machine):
    def setUp(self):
        super().setUp()
        self.configs = {}
        for name in NAMES:
            text = one_axis().replace("machine: test", f"machine: {name}").replace("unit: deg", f"unit: {UNITS[name][0]}")
            self.configs[name] = self.write(text, f"{name}.yaml")

    def run_machine(self, name):
        config = self.configs[name]
        self.start(f"simulator-{name}", BIN / "axlecast", "simulate", config, "--bus", "rs485-0")
        wait_for(lambda: list(self.run_dir.glob(f"{name}/rs485-0.pty")), f"the simulated port of {name}")
        self.driver(config, "rs485-0", name=f"driver-{name}")
        self.bridge(config, name=f"bridge-{name}")

    def run_both(self):
        for name in NAMES:
            self.run_machine(name)
        watches = {name: self.watch(self.configs[name]) for name in NAMES}
        for watch in watches.values():
            self.wait_online(watch)
        return watches

    def test_each_reader_takes_the_messages_of_its_machine(self):
        watches = self.run_both()
        for name, watch in watches.items():
            valid = lambda: [m for m in watch.of("POSITION/axis1") if m["flags"] & 1]
            wait_for(lambda: len(valid()) >= 500, f"500 positions of {name}")
            self.assertEqual({m["unit"] for m in valid()}, {UNITS[name][1]})
            self.assertEqual(len({m["machine_id"] for m in watch.since(0) if "machine_id" in m}), 1)
            self.assertEqual(watch.last("DEVICE/axis1")["machine"], name)

    def status_when_good(self, name):
        code, out, _ = self.axlecast("status", self.configs[name], "--json")
        return json.loads(out) if code == 0 else None

    def test_each_machine_names_the_other(self):
        watches = self.run_both()
        for name, other in (NAMES, NAMES[::-1]):
            alarm = wait_for(lambda: self.alarms(watches[name], "bridge").get("other_machine"), f"an alarm of {name}")
            wait_for(lambda: f"machine '{other}'" in self.alarms(watches[name], "bridge")["other_machine"]["action"],
                     lambda: f"the name of {other}, not {alarm}")
            self.assertIn(name, alarm["action"])
            # A busy computer may starve the simulator for a moment: its device is then offline until replies come in time again.
            out = wait_for(lambda: self.status_when_good(name), lambda: f"{name} is good: {self.axlecast('status', self.configs[name])}")
            self.assertEqual(out["reception"]["other_machines"], [other])
            _, text, err = self.axlecast("status", self.configs[name])
            self.assertIn(f"machine '{other}' uses the same LCM group and port", text + err)

    def test_a_command_acts_on_its_own_machine(self):
        self.run_both()
        self.config = self.configs["press2"]
        _, outcome = self.outcome("zero", "axis1", "--yes", "--reason", "test")
        self.assertEqual(outcome["outcome"], "succeeded", outcome)
        wear = {name: int(self.simulated(self.configs[name], "rs485-0")["devices"]["axis1"]["eeprom_wear"]) for name in NAMES}
        self.assertEqual(wear["press1"], 0)
        self.assertGreater(wear["press2"], 0)

    def test_a_recorder_records_its_own_machine(self):
        self.run_both()
        log = self.folder / "press1.lcm"
        recorder = self.start("record", BIN / "axlecast", "record", log, "--config", self.configs["press1"])
        wait_for(lambda: log.exists() and log.stat().st_size > 200_000, "a part of the log")
        recorder.terminate()
        self.assertEqual(recorder.wait(30), 0, self.log("record"))
        self.assertIn("of machine 'press2' not recorded", self.log("record"))
        position = lcm_log.generated_types().position_t
        machines = {position.decode(data).machine_id for channel, data in lcm_log.events(log)
                    if channel == "POSITION/axis1"}
        self.assertEqual(len(machines), 1)

    def test_a_consumer_that_names_no_machine_is_told(self):
        example = BIN / "print_position"
        self.run_both()
        consumer = subprocess.Popen([example, "axis1"], stdout=subprocess.PIPE, text=True)
        self.processes.append(consumer)
        lines = [consumer.stdout.readline() for _ in range(30)]
        self.assertTrue(any("two machines have a device of this name" in line for line in lines[5:]), lines)
        self.assertFalse(any("ms old" in line for line in lines[5:]), lines)


if __name__ == "__main__":
    unittest.main(verbosity=2)
