"""Errors as an operator meets them: each names its cause and what to type or change."""

import json
import pathlib
import socket
import subprocess
import unittest

from machine import BIN, Machine, one_axis, wait_for

USAGE, FAILED, NO_ANSWER = 2, 4, 6


class Errors(Machine):
    def told(self, code, *words):
        got, out, err = self.axlecast(*words)
        self.assertEqual(got, code, out + err)
        return err

    def test_wrong_words(self):
        config = self.write(one_axis() + "  biss-0:\n    family: biss\n    simulate: true\n"
                            "    devices: {arm: {model: saa58p24, bits: 16}}\n"
                            "  motors:\n    family: tsubaki_sc\n    simulate: true\n    devices: {gm3: {address: 1, permit: not_required}}\n")
        at = ("--config", config)
        for words, texts in (
                (("statsu",), ("no command 'statsu'", "did you mean 'status'?", "axlecast --help")),
                (("param", "lst", "gm3"), ("axlecast param: there is no command 'lst'", "did you mean 'list'?")),
                (("param", "set", "gm3", "log_interval", "0.5", *at), ("'log_interval' is no NAME=VALUE",
                                                                      "write log_interval=VALUE")),
                (("home", "axis1", "--value", "100mm", *at), ("'100mm' is no number: leave the unit out", "write 100")),
                (("trips", "axis1", *at), ("axis1 has no operation 'fetch_trip_logs': it is an encoder (tformat)",
                                           "devices of this machine that have it: gm3")),
                (("zero", "arm", *at), ("encoders of biss keep no zero", "axlecast home arm --value 0")),
                (("zero", "gm3", *at), ("it is a monitor of motors (tsubaki_sc)",))):
            with self.subTest(words=words):
                err = self.told(USAGE, *words)
                for text in texts:
                    self.assertIn(text, err)

    def test_spy_names_what_is_missing(self):
        """default-jdk-headless, which the build needs, brings a Java that opens no window: it ended in a stack trace."""
        config = self.write(one_axis())
        home = self.folder / "jvm"
        (home / "bin").mkdir(parents=True)
        (home / "lib").mkdir()
        (home / "lib/libawt_headless.so").touch()
        java = home / "bin/java"
        java.write_text("#!/bin/sh\nexit 0\n")
        java.chmod(0o755)
        (self.folder / "java").symlink_to(java)  # as /usr/bin/java leads through /etc/alternatives

        def spy(path, display):
            done = subprocess.run([BIN / "axlecast", "spy", config], capture_output=True, text=True, timeout=60, check=False,
                                  env={"PATH": str(path), "DISPLAY": display})
            return done.returncode, done.stderr

        self.assertEqual(spy("/nonexistent", ":1"), (1, "java is missing: sudo apt-get install default-jre\n"))
        self.assertEqual(spy(self.folder, ":1"), (1, f"the Java of this host ({self.folder / 'java'}) cannot open windows, "
                                                  "which lcm-spy needs: sudo apt-get install default-jre\n"))
        (home / "lib/libawt_xawt.so").touch()
        code, err = spy(self.folder, "")
        self.assertEqual(code, 1)
        for text in ("DISPLAY is not set", "ssh -X", f"xvfb-run axlecast spy {config}"):
            self.assertIn(text, err)
        self.assertEqual(spy(self.folder, ":1"), (0, ""), "all is there: it becomes java")

    def test_a_short_frame(self):
        for family, frame, detail in (
                ("tformat", "1A 00 A5", "3 bytes received, at least 11 are needed for a read_all_reply"),
                ("saa-serial", "BC AA", "2 bytes received, at least 3 are needed"),
                ("tsubaki-sc", "01 04 04 00", "4 bytes received, at least 8 are needed"),
                ("saa-can", "181#00", "1 bytes received, at least ")):
            with self.subTest(family=family):
                code, out, err = self.axlecast("decode", family, *(("--set", "model=cia406") if "#" in frame else ()), frame)
                told = json.loads(out)
                self.assertEqual((code, told["error"]), (1, "short"), out + err)
                self.assertIn(detail, told["detail"])

    def test_a_channel_expression_that_finds_nothing(self):
        config = self.write(one_axis())
        self.simulator(config, "rs485-0")
        self.driver(config, "rs485-0")
        self.wait_online(self.watch(config))
        err = self.told(NO_ANSWER, "watch", config, "--json", "--channel", "^POSITON/", "--seconds", "1.5")
        self.assertIn("--channel '^POSITON/' is found in the name of no channel; messages came on ", err)
        self.assertIn("POSITION/axis1", err)

    def test_a_port_in_use(self):
        if b"web" not in subprocess.run([BIN / "axlecast", "--help"], capture_output=True, check=True).stdout:
            self.skipTest("built without the web page")
        with socket.create_server(("127.0.0.1", 0)) as holder:
            port = str(holder.getsockname()[1])
            err = self.told(FAILED, "web", self.write(one_axis()), "--port", port)
        self.assertIn(f"port {port}: another program listens there", err)
        self.assertIn(f"ss -ltnp 'sport = :{port}'", err)

    def test_a_recorder_that_cannot_write_is_in_the_summary_with_its_cause(self):
        (self.folder / "file").write_text("no folder")
        config = self.write(one_axis() + f"recorder: {{directory: {self.folder}/file/logs, logs: {{all: {{}}}}}}\n")
        code, out, err = self.axlecast("up", config, "--seconds", "2", "--json")
        self.assertNotEqual(code, 0, err)
        self.assertTrue(out, err)
        fault = next(fault for fault in json.loads(out)["faults"] if fault.startswith("recorder"))
        self.assertIn(f"{self.folder}/file", fault)
        self.assertIn("Not a directory", fault)


if __name__ == "__main__":
    unittest.main(verbosity=2)
