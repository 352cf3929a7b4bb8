"""axlecast hwtest and report on simulators: what they report of a good and of a bad line, of a turn by hand, and that their
pages are whole, hold no script, load nothing and show no secret."""

import html.parser
import json
import os
import pty
import subprocess
import unittest

from machine import BIN, Machine, one_axis, wait_for

DONE, BAD, USAGE, FAILED, NO_ANSWER = 0, 1, 2, 4, 6
PASSWORD = "Gm3!right-one"
VOID = {"meta", "link", "br", "hr", "img", "input"}


class Page(html.parser.HTMLParser):
    """A page's elements and text; every element that is opened is closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.attributes, self.words = [], set(), [], []
        self.feed(text)
        self.close()
        assert not self.open, self.open

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, tag

    def handle_data(self, data):
        self.words.append(data)

    def text(self):
        return " ".join(self.words)


class Service(Machine):
    def run_machine(self, simulate="{speed_rpm: 0, start_deg: 100}", motor=False):
        text = one_axis(simulate, "eeprom_writable: [10]", bridge="bridge: {unsigned_commands: allow}")
        if motor:
            password = self.folder / "password"
            password.touch(mode=0o600)
            password.write_text(PASSWORD + "\n")
            text += f"""  rs485-1:
    family: tsubaki_sc
    pacing: per_unit
    simulate:
      timing: {{reading: W, pace: unpaced}}
      gm1: {{password: "{PASSWORD}", voltage_v: 230, load_w: 150}}
    devices:
      gm1: {{address: 1, passwords: {{main: {{file: {password}}}}}, password: main, motor_control: start_stop, permit: not_required}}
"""
        self.config = self.write(text)
        self.data = self.watch(self.config, "--channel", "^(DEVICE|ALARM|BUS)/")
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")
        if motor:
            self.simulator(self.config, "rs485-1")
            self.driver(self.config, "rs485-1", family="tsubaki-sc")
            self.wait_online(self.data, "gm1")
        self.bridge(self.config)
        self.wait_online(self.data)
        wait_for(lambda: self.data.last("ALARM/bridge"), "the bridge")

    def page(self, path):
        text = path.read_text()
        page = Page(text)
        self.assertFalse(page.tags & {"script", "link", "img", "iframe", "object"}, page.tags)
        self.assertFalse([a for a in page.attributes if a[0] in ("src", "href") or a[0].startswith("on")])
        self.assertNotIn("url(", text)
        self.assertNotIn(PASSWORD, text)
        return page.text()

    def hwtest(self, *options, device="axis1"):
        code, out, err = self.axlecast("hwtest", device, "--config", self.config, "--seconds", "3", "--json", *options)
        self.assertTrue(out, err)
        report = json.loads(out)
        return code, report, {finding["what"]: finding for finding in report["findings"]}


class Hwtest(Service):
    def test_a_good_encoder(self):
        self.run_machine()
        path = self.folder / "axis1.html"
        # A starved simulator answers late, which is rightly reported.
        report, of = wait_for(lambda: (lambda code, *rest: rest if code == DONE else None)(*self.hwtest("--html", path)),
                              "an acceptance without failed readings")
        self.assertTrue(report["simulated"])
        self.assertIn("simulated", of["adapter"]["value"])
        self.assertEqual((of["state"]["verdict"], of["alarms"]["verdict"]), ("good", "good"))
        self.assertRegex(of["turnaround"]["value"], r"min \d+ us, p50 \d+ us, p99 \d+ us")
        self.assertTrue([what for what in of if what.startswith("eeprom_backup")], "its memory was read")
        self.assertFalse([what for what, finding in of.items() if "nothing was done" in finding["value"]])
        self.assertIn("the results do not apply to hardware", self.page(path))

    def test_a_noisy_line_and_an_alarm(self):
        self.run_machine()
        self.set_simulated(self.config, "rs485-0", fault="bit_flip:0.02", battery_v=0)
        wait_for(lambda: self.alarms(self.data), "an alarm")
        code, report, of = self.hwtest("--no-reads")
        self.assertEqual((code, report["verdict"]), (BAD, "bad"))
        self.assertIn("failed: checksum", of)
        self.assertIn("120 ohm", of["failed: checksum"]["advice"])
        self.assertTrue([f for f in report["findings"] if f["group"] == "Alarms" and f["verdict"] != "good"])

    def test_a_monitor(self):
        self.run_machine(motor=True)
        report, of = wait_for(lambda: (lambda code, *rest: rest if code == DONE else None)(*self.hwtest(device="gm1")),
                              "an acceptance without failed readings")
        self.assertIn("log_interval", of)
        self.assertNotIn(PASSWORD, json.dumps(report))

    def test_a_turn_by_hand(self):
        self.run_machine()
        for degrees, verdict in ((460, "good"), (100, "bad")):
            with self.subTest(degrees=degrees):
                ours, its = pty.openpty()
                process = subprocess.Popen([BIN / "axlecast", "hwtest", "axis1", "--config", self.config, "--seconds", "1",
                                            "--no-reads", "--json"], stdin=its, stdout=subprocess.PIPE,
                                           stderr=subprocess.PIPE, text=True)
                self.addCleanup(process.kill)
                os.close(its)
                while "press Enter" not in process.stderr.readline():
                    self.assertIsNone(process.poll())
                if degrees != 100:
                    self.turn_once()
                os.write(ours, b"\n")
                out, _ = process.communicate(timeout=60)
                os.close(ours)
                finding = next(f for f in json.loads(out)["findings"] if f["what"] == "one turn by hand")
                self.assertEqual(finding["verdict"], verdict, finding)

    def turn_once(self):
        """One turn: until the position is where it was, 360 degrees on."""
        positions = self.watch(self.config, "--channel", "^POSITION/axis1$")
        begin = wait_for(lambda: positions.last("POSITION/axis1"), "a position")["counts"]
        self.set_simulated(self.config, "rs485-0", speed_rpm=60)
        wait_for(lambda: positions.last("POSITION/axis1")["counts"] - begin >= 0.9 * 131072, "most of a turn")
        self.set_simulated(self.config, "rs485-0", speed_rpm=0)
        here = positions.last("POSITION/axis1")["counts"]
        self.assertLess(here - begin, 1.1 * 131072)

    def test_without_a_driver(self):
        self.config = self.write(one_axis())
        self.assertEqual(self.axlecast("hwtest", "axis1", "--config", self.config)[0], NO_ANSWER)
        self.assertEqual(self.axlecast("hwtest", "axis9", "--config", self.config)[0], USAGE)


class Report(Service):
    def test_a_machine_as_a_page(self):
        self.run_machine(motor=True)
        path = self.folder / "report.html"
        code, out, err = self.axlecast("report", self.config, "--html", path)
        self.assertEqual((code, out), (DONE, ""), err)
        steps = err.splitlines()
        self.assertRegex(steps[0], "^listening to the machine, at most [0-9]+ s$")
        self.assertEqual(steps[1:], ["reading parameters and memory of axis1 (1 of 2)",
                                     "reading parameters and memory of gm1 (2 of 2)", f"written: {path}"])
        text = self.page(path)
        for word in ("axis1", "gm1", "ONLINE", "log_interval", "rs485-1", "(masked)", "bridge's journal"):
            self.assertIn(word, text)

    def test_a_page_on_standard_output_is_whole_and_progress_stays_beside_it(self):
        self.run_machine()
        code, out, err = self.axlecast("report", self.config)
        self.assertEqual(code, DONE, err)
        self.assertRegex(err, r"^listening to the machine, at most [0-9]+ s\n"
                         r"reading parameters and memory of axis1 \(1 of 1\)\n$")
        self.assertIn("axis1", Page(out).text())
        self.assertNotIn("listening to the machine", out)

    def test_without_a_bridge_the_reads_are_left_out_and_it_says_so(self):
        self.config = self.write(one_axis())
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")
        self.wait_online(self.watch(self.config, "--channel", "^DEVICE/"))
        path = self.folder / "report.html"
        code, out, err = self.axlecast("report", self.config, "--html", path)
        self.assertEqual((code, out), (DONE, ""), err)
        self.assertEqual(err.splitlines()[1:], ["reading parameters and memory of axis1 (1 of 1)",
                                                "no bridge answers: parameters and memory are omitted",
                                                f"written: {path}"])
        self.page(path)

    def test_a_page_that_cannot_be_written_is_named_with_the_cause(self):
        self.config = self.write(one_axis())
        path = self.folder / "nowhere/report.html"
        code, out, err = self.axlecast("report", self.config, "--html", path)
        self.assertEqual((code, out), (FAILED, ""), err)
        last = err.splitlines()[-1]
        self.assertIn(f"{path}", last)
        self.assertIn("No such file or directory", last)
        self.assertNotIn("written: ", err)

    def test_errors_by_hours_from_a_recording(self):
        self.run_machine()
        log = self.folder / "run.lcm"
        recorder = self.start("record", BIN / "axlecast", "record", log, "--config", self.config)
        self.set_simulated(self.config, "rs485-0", fault="bit_flip:0.05")
        first = wait_for(lambda: self.data.last("BUS/rs485-0"), "BUS")["errors"][3]
        wait_for(lambda: self.data.last("BUS/rs485-0")["errors"][3] > first, "failed exchanges")
        recorder.send_signal(2)
        recorder.wait(30)
        code, out, err = self.axlecast("report", self.config, "--log", log, "--no-reads")
        self.assertEqual(code, DONE, err)
        text = Page(out).text()
        self.assertIn("run.lcm", text)
        self.assertIn("checksum", text)

    def test_a_machine_that_does_not_run(self):
        self.config = self.write(one_axis())
        path = self.folder / "report.html"
        code, out, err = self.axlecast("report", self.config, "--html", path)
        self.assertEqual((code, out), (DONE, ""), err)
        self.assertRegex(err, rf"^listening to the machine, at most [0-9]+ s\nwritten: {path}\n$")
        self.assertIn("no message", self.page(path))
        self.assertEqual(self.axlecast("report", self.config, "--log", self.config)[0], BAD)


if __name__ == "__main__":
    unittest.main(verbosity=2)
