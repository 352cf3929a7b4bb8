"""The client library and its examples against a bridge, a driver and a simulated encoder that counts what it did."""

import json
import os
import pathlib
import re
import subprocess
import time
import unittest

from machine import BIN, LIMIT, Machine, clock_id, one_axis, unsigned, wait_for

DONE, USAGE, REJECTED, NO_ANSWER, UNVERIFIED = 0, 2, 3, 6, 7
EXAMPLES = pathlib.Path(os.environ["AXLECAST_SOURCE"]) / "client" / "example"


class Client(Machine):
    def run_machine(self, simulate, permit="not_required"):
        self.config = self.write(one_axis(simulate).replace("permit: not_required", f"permit: {permit}"))
        self.data = self.watch(self.config, "--commands")
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")
        self.serving = self.bridge(self.config)
        self.wait_online(self.data)

    def encoder(self):
        return self.simulated(self.config, "rs485-0")["devices"]["axis1"]

    def run_program(self, *command):
        """Exit code and everything it printed."""
        environment = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}", "XDG_STATE_HOME": str(self.folder)}
        done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              text=True, timeout=2 * LIMIT, env=environment, stdin=subprocess.DEVNULL)
        return done.returncode, done.stdout

    def command(self, *words):
        code, out, err = self.axlecast(*words, "--config", self.config, "--json")
        self.assertTrue(out, err)
        return code, json.loads(out)

    def test_the_example_zeroes_and_homes_with_its_own_permits(self):
        self.run_machine("{start_deg: 100}", permit="required")
        code, out = self.run_program(BIN / "send_command", self.config, "axis1", 12.5)
        self.assertIn(code, (DONE, UNVERIFIED), out)
        self.assertIn("zero_single_turn: done and verified", out)
        self.assertEqual(self.encoder()["zeroings"], 1)
        wait_for(lambda: abs(self.data.last("POSITION/axis1")["value"] - 12.5) < 0.1, "12.5 deg")

    def test_the_example_says_why_nothing_was_done(self):
        self.run_machine("{speed_rpm: 30}")
        code, out = self.run_program(BIN / "send_command", self.config, "axis1", 0)
        self.assertEqual(code, REJECTED, out)
        self.assertIn("it can be sent again later", out)
        self.assertEqual(self.encoder()["zeroings"], 0)

    def test_the_python_example_zeroes(self):
        self.run_machine("{start_deg: 100}")
        code, out = self.run_program(EXAMPLES / "zero_axis.py", self.config, "axis1")
        self.assertEqual(code, DONE, out)
        self.assertEqual(self.encoder()["zeroings"], 1)

    def test_the_python_example_tries_again_what_was_refused_for_the_moment(self):
        self.run_machine("{speed_rpm: 30}")
        code, out = self.run_program(EXAMPLES / "zero_axis.py", self.config, "axis1", "--attempts", 2)
        self.assertEqual(code, REJECTED, out)
        self.assertEqual(self.encoder()["zeroings"], 0)
        refusals = {m["id"] for m in self.data.of("COMMAND_STATUS") if m.get("reason_code") == 13}
        self.assertEqual(len(refusals), 2)

    def test_without_a_bridge_nothing_was_done(self):
        self.config = self.write(one_axis())
        code, out = self.run_program(BIN / "send_command", self.config, "axis1", 0)
        self.assertEqual(code, NO_ANSWER, out)
        self.assertIn("nothing was done", out)

    def test_permits_by_hand_let_a_zero_pass(self):
        self.run_machine("{start_deg: 100}", permit="required")
        code, outcome = self.command("zero", "axis1", "--yes")
        self.assertEqual((code, outcome["reason"], outcome["temporary"]), (REJECTED, "no_permit", True), outcome)
        permits = self.start("permit", BIN / "axlecast", "permit", "axis1", "zero_single_turn", "--for", "60s", "--config",
                             self.config)
        permit = wait_for(lambda: self.data.last("PERMIT/axis1"), "a permit")["permit_decoded"]
        self.assertEqual(unsigned(permit["clock_id"]), clock_id(), "the driver checks its age by CLOCK_MONOTONIC")
        self.assertLessEqual(permit["issued_mono_ns"], time.monotonic_ns())
        code, outcome = self.outcome("zero", "axis1", "--yes")
        self.assertEqual(code, DONE, outcome)
        permits.terminate()
        self.assertEqual(permits.wait(LIMIT), 0)
        wait_for(lambda: self.data.last("PERMIT/axis1")["permit_decoded"]["n_operations"] == 0, "the permit taken back")

    def test_prepare_shows_and_commit_does(self):
        self.run_machine("{start_deg: 100}")
        code, outcome = self.command("zero", "axis1", "--prepare")
        self.assertEqual((code, outcome["outcome"]), (DONE, "prepared"), outcome)
        self.assertRegex(outcome["token"], r"^(?!0{32})[0-9a-f]{32}$")
        self.assertEqual(self.encoder()["zeroings"], 0)
        code, outcome = self.command("zero", "axis1", "--commit", outcome["token"])
        self.assertEqual(code, DONE, outcome)
        self.assertEqual(self.encoder()["zeroings"], 1)
        self.set_simulated(self.config, "rs485-0", speed_rpm=30)
        wait_for(lambda: (self.data.last("POSITION/axis1")["speed_rad_s"] or 0) > 1, "turning")
        self.assertEqual(self.command("zero", "axis1", "--prepare")[0], REJECTED)

    def test_home_and_the_datum_for_the_file(self):
        self.run_machine("{start_deg: 100}")
        code, outcome = self.command("home", "axis1", "--value", 7.5, "--yes")
        self.assertIn(code, (DONE, UNVERIFIED), outcome)
        wait_for(lambda: abs(self.data.last("POSITION/axis1")["value"] - 7.5) < 0.1, "7.5 deg")
        code, out, err = self.axlecast("offset", "capture", "axis1", "--value", 7.5, "--config", self.config, "--json")
        self.assertEqual(code, DONE, err)
        self.assertAlmostEqual(json.loads(out)["datum"], self.data.last("DEVICE/axis1")["datum_counts"], delta=40)
        code, out, err = self.axlecast("offset", "capture", "axis1", "--config", self.config)
        self.assertTrue(re.search(r"^datum: \{counts: -?\d+\}$", out, re.MULTILINE), out)
        self.set_simulated(self.config, "rs485-0", speed_rpm=30)
        wait_for(lambda: (self.data.last("POSITION/axis1")["speed_rad_s"] or 0) > 1, "turning")
        code, out, err = self.axlecast("offset", "capture", "axis1", "--config", self.config)
        self.assertEqual(code, REJECTED)
        self.assertRegex(err, r"turns, at \d+\.\d+ rpm")

    def test_the_client_follows_its_command_to_a_restarted_bridge(self):
        self.run_machine("{start_deg: 100}")
        running = subprocess.Popen([BIN / "axlecast", "zero", "axis1", "--yes", "--json", "--config", self.config],
                                   stdout=subprocess.PIPE, text=True, stdin=subprocess.DEVNULL)
        wait_for(lambda: self.encoder()["resets_counted"] >= 2, "the sequence under way")
        self.kill(self.serving)
        self.bridge(self.config)
        out, _ = running.communicate(timeout=2 * LIMIT)
        outcome = json.loads(out)
        self.assertIn(outcome["outcome"], ("succeeded", "indeterminate"), outcome)
        self.assertEqual(self.encoder()["zeroings"], 1)

    def test_status_warns_of_unsigned_commands(self):
        self.run_machine("{}")
        code, out, err = self.axlecast("status", self.config, "--json")
        self.assertEqual(len(json.loads(out)["warnings"]), 1, err)


if __name__ == "__main__":
    unittest.main()
