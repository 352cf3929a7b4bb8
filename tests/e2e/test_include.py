"""A machine in several files (docs/configuration.md, "Several files"): it runs, and logs and other commands have all of it."""

import json
import os
import pathlib
import signal
import unittest

from machine import BIN, Machine, wait_for

PAGE = pathlib.Path(os.environ["AXLECAST_SOURCE"], "docs/configuration.md")


class Include(Machine):
    def setUp(self):
        super().setUp()
        (self.folder / "cells").mkdir()
        self.axes = self.write("""buses:
  line{0..1}:
    family: tformat
    simulate: {"axis{}": {speed_rpm: 60}}
    devices: {"axis{}": {}}
""", "cells/axes.yaml")
        self.config = self.write("""machine: parts
include: [cells/axes.yaml]
bridge: {unsigned_commands: allow}
defaults:
  tformat: {poll_hz: 100, devices: {model: ts5669n127, unit: deg, timeout_us: 500000}}
""")

    def check(self, config, *options):
        return self.axlecast("check-config", config, *options)

    def test_the_machine_runs_and_a_log_contains_all_of_it(self):
        data = self.watch(self.config)
        # From another folder: names count from the file, not from the process.
        self.start("up", BIN / "axlecast", "up", self.config, "--no-table", cwd="/")
        self.wait_online(data, "axis0")
        self.wait_online(data, "axis1")
        log = self.folder / "run.lcm"
        recorder = self.start("record", BIN / "axlecast", "record", log, "--config", self.config)
        wait_for(lambda: log.exists() and log.stat().st_size > 20_000, lambda: "a log: " + self.log("record"))
        recorder.send_signal(signal.SIGINT)
        recorder.wait(60)
        code, text, err = self.axlecast("log", "info", log, "--show", "machine")
        self.assertEqual(code, 0, err)
        copy = self.write(text, "copy.yaml")
        reports = [json.loads(self.check(config, "--json")[1]) for config in (self.config, copy)]
        self.assertEqual(reports[0]["included"], [str(self.axes)])
        self.assertEqual(reports[1]["included"], [])
        for report in reports:
            del report["file"], report["included"]
        self.assertEqual(*reports)

    def test_expand_prints_one_file(self):
        code, text, err = self.check(self.config, "--expand")
        self.assertEqual(code, 0, err)
        self.assertNotIn("include", text)
        expanded = self.write(text, "expanded.yaml")
        code, names, err = self.check(expanded, "--list", "devices")
        self.assertEqual((code, names.split()), (0, ["axis0", "axis1"]), err)
        code, text, err = self.check(self.config)
        self.assertIn(f"includes {self.axes}\n", text)

    def test_errors_name_the_file_and_the_line(self):
        self.axes.write_text(self.axes.read_text().replace("devices:", "devics:"))
        code, _, err = self.check(self.config)
        self.assertEqual(code, 1)
        self.assertIn(f"{self.axes}:5:5: buses.line0: unknown key 'devics'; did you mean 'devices'?", err)
        code, out, _ = self.check(self.config, "--json")
        self.assertIn(str(self.axes), [error["file"] for error in json.loads(out)["errors"]])

    def test_a_file_that_others_may_write_is_refused_by_every_process(self):
        self.axes.chmod(0o666)
        expected = f"{self.config}:2:11: include: '{self.axes}' can be written by every user"
        for name, words in (("bridge", ("axlecast-bridge", "--config", self.config)),
                            ("driver", ("axlecast-tformat", "--config", self.config, "--bus", "line0"))):
            process = self.start(name, BIN / words[0], *words[1:])
            self.assertEqual(process.wait(60), 1, self.log(name))
            self.assertIn(expected, self.log(name))
        code, out, err = self.axlecast("doctor", self.config, "--only", "config_mode", "--json")
        self.assertEqual(code, 1, out + err)
        self.assertIn(f"the included file {self.axes} has mode 0666", out)

    def test_a_missing_file_is_named_with_what_to_do(self):
        self.axes.unlink()
        code, _, err = self.check(self.config)
        self.assertEqual(code, 1)
        self.assertIn("No such file or directory: create it, or correct its name", err)

    def test_the_example_of_the_page(self):
        chapter = PAGE.read_text().split("## Several files")[1].split("## Families")[0]
        machine, press = (part.split("```")[0] for part in chapter.split("```yaml\n")[1:3])
        self.write(press, "cells/press.yaml")
        self.write("buses:\n  motors: {family: tsubaki_sc, simulate: true, devices: {gm: {address: 1}}}\n", "motors.yaml")
        code, names, err = self.check(self.write(machine, "page.yaml"), "--list", "devices")
        self.assertEqual((code, names.split()), (0, ["ram", "gm"]), err)


if __name__ == "__main__":
    unittest.main(verbosity=2)
