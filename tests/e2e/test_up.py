"""`axlecast up`: a whole machine in the foreground, and a truthful end."""

import json
import os
import pathlib
import signal
import subprocess
import unittest

from machine import BIN, Machine, one_axis, wait_for

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])


def processes():
    """Command lines of all axlecast programs in this process namespace."""
    listing = subprocess.run(["ps", "-eo", "pid=,args="], capture_output=True, text=True, check=True).stdout
    return [line for line in listing.splitlines() if str(BIN) in line and "e2e" not in line.split()[1]]


class Up(Machine):
    def test_the_demo_runs_and_ends_truthfully(self):
        code, out, err = self.axlecast("up", SOURCE / "config/demo.yaml", "--seconds", "10", "--json", limit=120)
        self.assertEqual(code, 0, out + err)
        summary = json.loads(out)
        self.assertEqual(len(summary["devices"]), 13)
        wait_for(lambda: not processes(), lambda: f"no process left: {processes()}")

    def test_ctrl_c_ends_everything(self):
        up = self.start("up", BIN / "axlecast", "up", SOURCE / "config/demo.yaml", "--no-table")
        wait_for(lambda: len(processes()) >= 10, lambda: f"simulator, 7 drivers, bridge: {processes()}")
        up.send_signal(signal.SIGINT)
        self.assertEqual(up.wait(20), 0, self.log("up"))
        wait_for(lambda: not processes(), lambda: f"no process left: {processes()}")

    def test_nothing_is_left_when_up_is_killed(self):
        up = self.start("up", BIN / "axlecast", "up", SOURCE / "config/demo.yaml", "--no-table")
        wait_for(lambda: len(processes()) >= 10, lambda: f"simulator, 7 drivers, bridge: {processes()}")
        self.kill(up)
        wait_for(lambda: not processes(), lambda: f"no process left: {processes()}")

    def test_a_device_that_never_answers_makes_the_end_a_failure(self):
        config = self.write(one_axis('{fault: "off"}'))
        code, out, err = self.axlecast("up", config, "--seconds", "5", limit=60)
        self.assertEqual(code, 1, out + err)
        self.assertIn("axis1", out + err)

    def test_a_device_that_is_degraded_at_the_end_is_no_good_run(self):
        config = self.write(one_axis('{fault: "bit_flip:0.001"}'))
        code, out, err = self.axlecast("up", config, "--seconds", "8", limit=120)
        self.assertEqual(code, 1, out + err)
        self.assertNotIn("good: every device", out)
        self.assertRegex(out.partition("\nnot good:\n")[2], r"(?m)^  axis1: DEGRADED \(")
        self.assertRegex(out, r"(?m)^axis1 +DEGRADED +[1-9]", "it did deliver readings")

    def test_a_device_that_becomes_degraded_ends_what_was_good(self):
        """`up`, `status` and `doctor` judge it alike (docs/cli.md, "Good"). A signal ends `up --seconds` early."""
        config = self.write(one_axis("{speed_rpm: 60}"))
        watch = self.watch(config, "--channel", "^DEVICE/")
        up = self.start("up", BIN / "axlecast", "up", config, "--seconds", "3600", "--no-table")
        doctor = ("doctor", config, "--only", "machine_faults", "--json")

        def all_good():
            code, out, _ = self.axlecast("status", config)
            found, told, _ = self.axlecast(*doctor)
            return code == found == 0 and json.loads(told)["findings"] == [] and out
        # A low battery leaves the bus UP: the state of the device alone counts.
        for fault, end in (({"fault": "bit_flip:0.001"}, {"fault": "none"}), ({"battery_v": 0}, {})):
            self.wait_online(watch)
            good = wait_for(all_good, lambda: "a good machine: " + self.log("up"))
            self.assertEqual(good.splitlines()[-1], "good: every device ONLINE, every bus UP")
            self.set_simulated(config, "rs485-0", **fault)
            self.wait_state(watch, 2)
            code, out, err = self.axlecast("status", config)
            self.assertEqual(code, 1, out + err)
            self.assertNotIn("good: every device", out)
            self.assertRegex(out.partition("\nnot good:\n")[2], r"(?m)^  axis1: DEGRADED \(")
            code, out, err = self.axlecast(*doctor)
            findings = json.loads(out)["findings"]
            self.assertEqual((code, {finding["name"] for finding in findings}), (1, {"machine_faults"}), out + err)
            self.assertTrue(any("axis1: DEGRADED (" in finding["found"] for finding in findings), findings)
            self.set_simulated(config, "rs485-0", **end)
        up.send_signal(signal.SIGINT)
        self.assertEqual(up.wait(60), 1, self.log("up"))
        self.assertNotIn("good: every device", self.log("up"))
        self.assertRegex(self.log("up").partition("\nnot good:\n")[2], r"(?m)^  axis1: DEGRADED \(")

    def test_without_multicast_it_says_what_to_do(self):
        config = self.write(one_axis("{}"))
        done = subprocess.run(["unshare", "--net", BIN / "axlecast", "up", config, "--seconds", "1"], capture_output=True,
                              text=True, timeout=60)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("ip route add 224.0.0.0/4 dev lo", done.stdout + done.stderr)

    def test_isolated_makes_its_own_network(self):
        config = self.write(one_axis("{speed_rpm: 60}"))
        done = subprocess.run(["unshare", "--net", BIN / "axlecast", "up", config, "--seconds", "4", "--isolated"],
                              capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("nsenter", done.stdout + done.stderr)

    def test_a_shell_finds_an_isolated_machine(self):
        config = self.write(one_axis("{speed_rpm: 60}"))
        code, _, err = self.axlecast("shell", config, "--print")
        self.assertEqual(code, 6, err)
        up = self.start("up", BIN / "axlecast", "up", config, "--no-table", "--isolated")
        wait_for(lambda: "shell inside" in self.log("up"), lambda: self.log("up"))
        line = self.log("up").split("shell inside", 1)[1].splitlines()[1].strip()
        self.assertRegex(line, rf"^nsenter --target {up.pid} --net.* /\S+$")
        # The line as it is printed, for a shell that then has something to do.
        network = f"/proc/{up.pid}/ns/net"
        inside = subprocess.run(["sh", "-c", f"{line} -c 'readlink /proc/self/ns/net'"], capture_output=True, text=True,
                                timeout=60)
        self.assertEqual(inside.stdout.strip(), os.readlink(network), inside.stderr)
        self.assertNotEqual(os.readlink(network), os.readlink("/proc/self/ns/net"))
        status = (BIN / "axlecast", "status", config)
        wait_for(lambda: self.axlecast("shell", config, "--run", *status)[0] == 0, lambda: self.log("up"))
        self.assertEqual(self.axlecast("shell", config, "--print")[:2], (0, f"{line}\n"))
        code, found, err = self.axlecast("shell", config, "--run", "readlink", "/proc/self/ns/net")
        self.assertEqual((code, found.strip()), (0, os.readlink(network)), err)
        self.assertEqual(self.axlecast("status", config)[0], 6, "from outside nothing is heard")

    def test_the_programs_bring_the_types_of_spy(self):
        build = BIN.parent
        inputs = subprocess.run(["ninja", "-C", build, "-t", "query", "axlecast_programs"], capture_output=True, text=True)
        self.assertIn("lcmtypes/java/lcmtypes_jar", inputs.stdout, inputs.stderr)

    def test_status_and_info(self):
        config = self.write(one_axis("{speed_rpm: 60}"))
        code, out, _ = self.axlecast("status", config)
        self.assertEqual(code, 6, "nothing answers: " + out)
        watch = self.watch(config)
        self.start("up", BIN / "axlecast", "up", config, "--no-table")
        self.wait_online(watch)
        code, out, err = self.axlecast("status", config, "--json")
        self.assertEqual((code, json.loads(out)["all_online"]), (0, True), err)
        code, out, err = self.axlecast("info", config, "axis1", "--json")
        self.assertEqual(code, 0, err)
        self.assertEqual(json.loads(out)["device"]["model"], "ts5669n127")


class Check(Machine):
    """Every class of mistake in the machine's file is refused at the start, with its place and what would be right."""

    GOOD = one_axis("{speed_rpm: 60}")

    def refused(self, text, place, *words):
        config = self.write(text)
        for command in (("axlecast", "check-config", config), ("axlecast-tformat", "--config", config, "--bus", "rs485-0"),
                        ("axlecast-bridge", "--config", config)):
            done = subprocess.run([BIN / command[0], *map(str, command[1:])], capture_output=True, text=True, timeout=60)
            message = done.stdout + done.stderr
            self.assertEqual(done.returncode, 1, f"{command[0]}: {message}")
            self.assertIn(f"{config}:{place}:", message)
            for word in words:
                self.assertIn(word, message)

    def test_a_good_file_is_accepted(self):
        code, out, err = self.axlecast("check-config", self.write(self.GOOD))
        self.assertEqual(code, 0, out + err)

    def test_unknown_key(self):
        self.refused(self.GOOD.replace("poll_hz", "pol_hz"), 6, "pol_hz", "poll_hz")

    def test_wrong_unit(self):
        self.refused(self.GOOD.replace("unit: deg", "unit: furlong"), 11, "furlong", "deg")

    def test_wrong_type(self):
        self.refused(self.GOOD.replace("poll_hz: 1000", "poll_hz: fast"), 6, "fast")

    def test_out_of_range(self):
        self.refused(self.GOOD.replace("publish_hz: 200", "publish_hz: -5"), 11, "-5")

    def test_unknown_family(self):
        self.refused(self.GOOD.replace("family: tformat", "family: tfromat"), 5, "tfromat", "tformat")

    def test_impossible_combination(self):
        self.refused(self.GOOD.replace("model: ts5669n127", "model: ts5669n127, bits: 23"), 11, "bits")

    def test_a_second_encoder_on_a_point_to_point_bus(self):
        self.refused(self.GOOD + "      axis2: {model: ts5669n127}\n", 11, "point to point", "axis2")

    def test_missing_port(self):
        self.refused(self.GOOD.replace("    simulate:\n      axis1: {speed_rpm: 60}\n", ""), 4, "port")

    def test_no_yaml_at_all(self):
        self.refused(self.GOOD.replace("buses:", "buses: ["), 5)

    def test_a_file_that_does_not_exist(self):
        code, out, err = self.axlecast("check-config", self.folder / "nowhere.yaml")
        self.assertEqual(code, 1, out)
        self.assertIn("nowhere.yaml", err + out)


if __name__ == "__main__":
    unittest.main(verbosity=2)
