"""`axlecast scan` on simulated ports: what it finds, the file that it writes, and that nothing is ever written to a device."""

import json
import os
import pty
import signal
import subprocess
import unittest

from machine import BIN, LIMIT, Machine, wait_for

DONE, BAD, USAGE, NO_ANSWER = 0, 1, 2, 6

TFORMAT = "family: tformat\n    devices: {a: {model: ts5669n127}}"
MODBUS = "family: saa_modbus\n    link: {baud: 57600}\n    devices: {a: {bits: 16, address: 9}, b: {bits: 24, address: 31}}"
SC_UNITS = "family: tsubaki_sc\n    devices: {a: {address: 2}, b: {address: 3}}"
STREAM = "family: saa_serial\n    mode: timing\n    refresh_hz: 100\n    link: {baud: 38400}\n    devices: {a: {bits: 20}}"
POLLED = ("family: saa_serial\n    mode: bus\n    zero_clearing: true\n    link: {baud: 115200}\n"
          "    devices: {a: {bits: 14, address: 1}, b: {bits: 16, address: 4}}")


class Scan(Machine):
    def simulate(self, bus, keys="true", kind="pty"):
        """The bus's simulated port."""
        self.config = self.write(f"machine: sim\nbuses:\n  line:\n    simulate: {keys}\n    {bus}\n", "sim.yaml")
        self.simulator(self.config, "line")
        return next(self.run_dir.glob(f"**/line.{kind}"))

    def scan(self, port, *options, expect=DONE):
        run = subprocess.run([BIN / "axlecast", "scan", port, "--json", *options], capture_output=True, text=True,
                             stdin=subprocess.DEVNULL, timeout=5 * LIMIT)
        self.assertEqual(run.returncode, expect, run.stdout + run.stderr)
        self.errors = run.stderr
        return json.loads(run.stdout) if run.stdout else None

    def counted(self, quantity):
        devices = self.simulated(self.config, "line")["devices"]
        return sum(quantities.get(quantity, 0) for quantities in devices.values())

    def runs_unchanged(self, file, devices):
        """check-config takes it, and every device of it comes online."""
        checked = subprocess.run([BIN / "axlecast", "check-config", file], capture_output=True, text=True)
        self.assertEqual(checked.returncode, DONE, checked.stderr)
        data = self.watch(file)
        self.start("up", BIN / "axlecast", "up", file, "--no-table")
        for device in devices:
            self.wait_online(data, device)

    def found_and_run(self, bus, family, devices, *options):
        port = self.simulate(bus)
        file = self.folder / "found.yaml"
        report = self.scan(port, "--write", file, *options)
        self.assertTrue(report["complete"])
        self.assertEqual({d["family"] for d in report["found"]}, {family})
        self.assertEqual(len(report["found"]), len(devices))
        for counter in ("writes", "zeroings"):
            self.assertEqual(self.counted(counter), 0, counter)
        self.runs_unchanged(file, devices)
        return report

    def test_tformat(self):
        report = self.found_and_run(TFORMAT, "tformat", ["axis1"], "--sole-master")
        self.assertEqual(report["found"][0]["confidence"], "sure")

    def test_modbus_encoders_among_wrong_rates_and_addresses(self):
        self.found_and_run(MODBUS, "saa_modbus", ["axis1", "axis2"], "--sole-master", "--addresses", "1-40")

    def test_sc_units(self):
        self.found_and_run(SC_UNITS, "tsubaki_sc", ["motor1", "motor2"], "--sole-master")

    def test_a_stream_is_found_by_listening_alone(self):
        report = self.found_and_run(STREAM, "saa_serial", ["axis1"])
        self.assertFalse(report["asked"])
        self.assertEqual(self.counted("unknown") + self.counted("noise"), 0)

    def test_a_polled_bus_at_a_named_rate(self):
        self.found_and_run(POLLED, "saa_serial", ["axis1", "axis2"], "--sole-master", "--baud", "115200")

    def test_can_nodes_among_wrong_bit_rates_without_sending_a_frame(self):
        port = self.simulate("family: saa_can\n    link: {bitrate: 125000}\n"
                             "    devices: {a: {bits: 14, node: 0x21, period_ms: 50}, b: {bits: 24, node: 0x22}}", kind="can")
        driver = self.driver(self.config, "line", "saa-can")  # these encoders send once they were started
        wait_for(lambda: all(node["started"] == "yes" for node in self.simulated(self.config, "line")["devices"].values()),
                 "every node started")
        driver.terminate()
        driver.wait(LIMIT)
        sent = self.counted("host_frames") + self.counted("unacknowledged")
        report = self.scan(port, "--sole-master")
        self.assertEqual({(d["keys"]["node"], d["link"]["bitrate"]) for d in report["found"]},
                         {("0x21", 125000), ("0x22", 125000)})
        self.assertEqual(self.counted("host_frames") + self.counted("unacknowledged"), sent)

    def test_a_turning_biss_encoder_is_sure(self):
        port = self.simulate("family: biss\n    devices: {a: {model: saa, bits: 18}}", "{a: {speed_rpm: 60}}", "spi")
        found, = self.scan(port, "--sole-master")["found"]
        self.assertEqual((found["family"], found["confidence"], found["keys"]["bits"]), ("biss", "sure", 18))

    def test_of_ssi_little_is_known(self):
        port = self.simulate("family: ssi\n    devices: {a: {model: saa58p24, bits: 12}}",
                             '{a: {motion: "shuttle:10,350,60"}}', "spi")
        found, = self.scan(port, "--sole-master")["found"]
        self.assertEqual((found["family"], found["confidence"], found["keys"]["bits"]), ("ssi", "likely", 12))
        self.assertIn("code", found["check"])

    def test_without_a_terminal_and_without_the_option_it_only_listens(self):
        port = self.simulate(TFORMAT)
        report = self.scan(port, expect=NO_ANSWER)
        self.assertFalse(report["asked"])
        self.assertIn("--sole-master", self.errors)
        self.assertEqual(self.counted("requests") + self.counted("noise"), 0)

    def test_at_a_terminal_it_asks_before_it_sends(self):
        port = self.simulate(TFORMAT)
        for answer, code, sent in ((b"n\n", NO_ANSWER, False), (b"y\n", DONE, True)):
            ours, theirs = pty.openpty()
            process = subprocess.Popen([BIN / "axlecast", "scan", port], stdin=theirs, stdout=subprocess.DEVNULL,
                                       stderr=subprocess.PIPE)
            said = b""
            while b"[y/N]" not in said:
                said += process.stderr.read(1)
            self.assertEqual(self.counted("requests"), 0)
            os.write(ours, answer)
            process.stderr.close()
            self.assertEqual(process.wait(LIMIT), code)
            os.close(ours)
            os.close(theirs)
            self.assertEqual(self.counted("requests") > 0, sent)

    def test_a_port_that_a_driver_holds_is_left_alone(self):
        port = self.simulate(TFORMAT)
        self.driver(self.config, "line")
        wait_for(lambda: self.counted("requests") > 0, "the driver's first reading")
        self.scan(port, "--sole-master", expect=BAD)
        self.assertIn("axlecast-tforma", self.errors)  # the kernel keeps 15 characters of a name

    def test_a_file_is_not_replaced_without_force(self):
        port = self.simulate(TFORMAT)
        file = self.write("mine: true\n", "found.yaml")
        self.scan(port, "--sole-master", "--write", file, expect=BAD)
        self.assertEqual(file.read_text(), "mine: true\n")
        self.scan(port, "--sole-master", "--write", file, "--force")
        self.assertIn("tformat", file.read_text())

    def test_ctrl_c_ends_it_with_what_was_found(self):
        port = self.simulate(MODBUS.replace("57600", "2400"))  # the last rate of all
        process = subprocess.Popen([BIN / "axlecast", "scan", port, "--sole-master", "--json"], text=True,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        wait_for(lambda: self.counted("noise") > 10, "the scan's requests at wrong rates")
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=LIMIT)
        self.assertEqual(process.returncode, NO_ANSWER)
        self.assertFalse(json.loads(out)["complete"])

    def test_bad_words_are_refused(self):
        for words in (["--addresses", "9-3"], ["--addresses", "x"], ["--bus", "A b"], ["--baud", "3"], ["--force"]):
            self.scan("/dev/null", *words, expect=USAGE)
        self.scan("/nowhere", expect=BAD)


if __name__ == "__main__":
    unittest.main()
