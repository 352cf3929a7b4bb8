"""What goes wrong in the field, end to end: each fault shows the promised behaviour, and goes away by itself where it
can."""

import os
import signal
import subprocess
import unittest

from machine import BIN, Machine, one_axis, wait_for

ONLINE, DEGRADED, OFFLINE = 1, 2, 3
BUS_UP, BUS_DOWN = 1, 3
VALID = 0x1


class Faults(Machine):
    def run_machine(self, simulate="{speed_rpm: 60}", device="", bus=""):
        self.config = self.write(one_axis(simulate, device, bus))
        self.data = self.watch(self.config)
        self.running_simulator = self.simulator(self.config, "rs485-0")
        self.running_driver = self.driver(self.config, "rs485-0")
        self.wait_online(self.data)

    def set(self, **quantities):
        self.set_simulated(self.config, "rs485-0", **quantities)

    def valid_since(self, mark):
        return [m for m in self.data.of("POSITION/axis1", mark) if m["flags"] & VALID]

    def bus(self):
        """The newest BUS message; before the first, one without content."""
        return self.data.last("BUS/rs485-0") or {"state": None, "errors": [0] * 16, "reopens": 0}

    # -- processes

    def test_a_killed_driver_comes_back_and_disturbs_no_other_bus(self):
        one = one_axis("{speed_rpm: 60}")
        two = one.split("buses:\n")[1].replace("rs485-0", "rs485-1").replace("axis1", "axis2")
        self.config = self.write(one + two)
        data = self.watch(self.config)
        up = self.start("up", BIN / "axlecast", "up", self.config, "--no-table")
        self.wait_online(data)
        self.wait_online(data, "axis2")
        first_boot = data.last("POSITION/axis1")["boot_id"]
        other = data.last("POSITION/axis2")
        victim = subprocess.run(["pgrep", "-f", "axlecast-tformat.*rs485-0"], capture_output=True, text=True).stdout
        os.kill(int(victim.split()[0]), signal.SIGKILL)
        wait_for(lambda: data.last("POSITION/axis1")["boot_id"] != first_boot, "a new boot id")
        self.wait_online(data)
        wait_for(lambda: data.last("POSITION/axis2")["seq"] > other["seq"] + 200, "axis2 going on")
        self.assertEqual(data.last("POSITION/axis2")["boot_id"], other["boot_id"])
        sequence = [m["seq"] for m in data.of("POSITION/axis2")]
        self.assertEqual(sequence, list(range(sequence[0], sequence[0] + len(sequence))))
        up.send_signal(signal.SIGINT)
        up.wait(30)

    def test_sigterm_stops_a_driver_cleanly(self):
        self.run_machine()
        self.running_driver.terminate()
        self.assertEqual(self.running_driver.wait(5), 0, self.log("driver-rs485-0"))

    def test_a_driver_that_starts_before_its_port_exists_waits_for_it(self):
        self.config = self.write(one_axis("{speed_rpm: 60}"))
        self.data = self.watch(self.config)
        self.driver(self.config, "rs485-0")
        wait_for(lambda: self.bus()["state"] in (0, BUS_DOWN), "a bus that is not up")
        self.simulator(self.config, "rs485-0")
        self.wait_online(self.data)

    # -- the line

    def test_a_simulator_that_stops_and_starts_again(self):
        self.run_machine()
        self.running_simulator.terminate()
        self.running_simulator.wait()
        offline = self.wait_state(self.data, OFFLINE)
        self.assertTrue(offline["reason"])
        wait_for(lambda: self.bus()["state"] == BUS_DOWN, "the bus down")
        self.simulator(self.config, "rs485-0")
        self.wait_state(self.data, ONLINE)
        wait_for(lambda: self.bus()["state"] == BUS_UP and self.bus()["reopens"] >= 1, "the bus up again")

    def test_a_port_that_is_removed_and_recreated(self):
        self.run_machine()
        code, out, err = self.axlecast("simulate", self.config, "--bus", "rs485-0", "--unplug")
        self.assertEqual(code, 0, out + err)
        self.wait_state(self.data, OFFLINE)
        mark = self.data.mark()
        code, out, err = self.axlecast("simulate", self.config, "--bus", "rs485-0", "--plug")
        self.assertEqual(code, 0, out + err)
        self.wait_state(self.data, ONLINE)
        first = wait_for(lambda: self.valid_since(mark), "a valid position")[0]
        self.assertTrue(first["flags"] & 0x800, "AFTER_GAP")

    def test_an_encoder_that_falls_silent(self):
        self.run_machine()
        self.set(fault="off")
        self.wait_state(self.data, OFFLINE)
        wait_for(lambda: self.bus()["errors"][0] > 0, "time-outs counted")
        self.set(fault="none")
        self.wait_state(self.data, ONLINE)

    def test_bit_errors_are_counted_by_kind_and_nothing_false_is_valid(self):
        self.run_machine("{speed_rpm: 60}")
        self.set(fault="bit_flip:0.001")
        wait_for(lambda: self.bus()["errors"][3] > 20, "checksum errors counted")
        self.set(fault="none")
        values = [m["value"] for m in self.data.of("POSITION/axis1") if m["flags"] & VALID]
        times = [m["mono_ns"] for m in self.data.of("POSITION/axis1") if m["flags"] & VALID]
        for i in range(1, len(values)):
            moved = abs(values[i] - values[i - 1])
            self.assertLessEqual(moved, 36_000 * (times[i] - times[i - 1]) * 1e-9 + 2.0, "beyond 6,000 rpm")

    def test_line_faults_by_name_end_when_they_end(self):
        self.run_machine()
        for fault in ("garbage", "delayed:700", "intermittent:0.5", "stuck", "slow:5"):
            with self.subTest(fault):
                before = sum(self.bus()["errors"])
                self.set(fault=fault)
                if not fault.startswith(("slow", "stuck")):
                    wait_for(lambda: sum(self.bus()["errors"]) > before, "errors counted")
                self.set(fault="none")
                mark = self.data.mark()
                wait_for(lambda: len(self.valid_since(mark)) > 20, "valid positions again")

    # -- identity

    def test_an_encoder_of_another_model_is_named_and_not_believed(self):
        self.run_machine()
        self.set(enid="0x17")
        wait_for(lambda: "wrong_identity" in self.alarms(self.data), "the alarm")
        mark = self.data.mark()
        wait_for(lambda: len(self.data.of("DEVICE/axis1", mark)) >= 2, "two more seconds")
        self.assertEqual(self.valid_since(mark), [])
        self.assertNotEqual(self.data.last("DEVICE/axis1")["state"], ONLINE)
        self.set(enid="0x11")
        self.wait_state(self.data, ONLINE)

    def test_another_unit_of_the_same_model_is_told_apart_by_its_tag(self):
        tag = '"72=A1 05"'
        self.run_machine(f"{{speed_rpm: 0, eeprom: {tag}}}", 'identity: {eeprom_address: 72, bytes: "A1 05"}')
        self.axlecast("simulate", self.config, "--bus", "rs485-0", "--unplug")
        self.wait_state(self.data, OFFLINE)
        self.set(eeprom="72=B2 06")
        mark = self.data.mark()
        self.axlecast("simulate", self.config, "--bus", "rs485-0", "--plug")
        wait_for(lambda: "wrong_identity" in self.alarms(self.data), "the alarm")
        self.assertEqual(self.valid_since(mark), [])

    # -- two drivers

    def test_a_second_driver_on_the_same_port_is_refused_and_disturbs_nothing(self):
        self.run_machine()
        boot = self.data.last("POSITION/axis1")["boot_id"]
        mark = self.data.mark()
        second = self.driver(self.config, "rs485-0", name="second")
        self.assertEqual(second.wait(timeout=60), 1)
        self.assertIn("second driver", self.log("second"))
        wait_for(lambda: len(self.valid_since(mark)) > 200, "the first driver going on")
        wait_for(lambda: self.data.of("DEVICE/axis1", mark), "its state")
        self.assertEqual({m["boot_id"] for m in self.valid_since(mark) + self.data.of("DEVICE/axis1", mark)}, {boot})
        self.assertEqual({m["state"] for m in self.data.of("DEVICE/axis1", mark)} - {ONLINE, DEGRADED}, set())

    def test_two_drivers_that_use_the_same_names_raise_an_alarm(self):
        self.run_machine()
        os.environ["AXLECAST_RUN_DIR"] = str(self.folder / "elsewhere")
        self.run_dir = self.folder / "elsewhere"
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0", name="second")
        wait_for(lambda: "duplicate_driver" in self.alarms(self.data), "the alarm")

    # -- clocks

    def test_a_step_of_the_clock_is_flagged_and_monotonic_time_goes_on(self):
        library = "/usr/lib/x86_64-linux-gnu/faketime/libfaketime.so.1"
        if not os.path.exists(library):
            library = subprocess.run(["sh", "-c", "ls /usr/lib/*/faketime/libfaketime.so.1"], capture_output=True,
                                     text=True, check=True).stdout.strip()
        offset = self.folder / "offset"
        offset.write_text("+0\n")
        self.config = self.write(one_axis("{speed_rpm: 60}"))
        self.data = self.watch(self.config)
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0", env={
            "LD_PRELOAD": library, "FAKETIME_TIMESTAMP_FILE": str(offset), "FAKETIME_NO_CACHE": "1",
            "FAKETIME_DONT_FAKE_MONOTONIC": "1"})
        self.wait_online(self.data)
        mark = self.data.mark()
        offset.write_text("+3600\n")
        stepped = wait_for(lambda: [m for m in self.data.of("POSITION/axis1", mark) if m["flags"] & 0x1000],
                           "CLOCK_STEPPED")[0]
        before = [m for m in self.data.of("POSITION/axis1") if m["seq"] == stepped["seq"] - 1][0]
        self.assertGreater(stepped["utime"] - before["utime"], 3_500_000_000)
        self.assertLess(stepped["mono_ns"] - before["mono_ns"], 10_000_000_000)

    # -- alarms

    def test_an_offline_device_keeps_its_alarms_as_unknown(self):
        self.run_machine()
        self.set(battery_v=3.0)
        wait_for(lambda: self.alarms(self.data).get("battery_alarm", {}).get("state") == 0, "the live alarm")
        self.set(fault="off")
        self.wait_state(self.data, OFFLINE)
        wait_for(lambda: self.alarms(self.data)["battery_alarm"]["state"] == 5, "the alarm unknown")
        self.set(fault="none", battery_v=3.6)
        wait_for(lambda: "battery_alarm" not in self.alarms(self.data), "the alarm gone")


if __name__ == "__main__":
    unittest.main(verbosity=2)
