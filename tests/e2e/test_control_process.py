"""The example of a control process in C against a bridge, a driver and a simulated encoder that counts what it did."""

import re
import subprocess
import time
import unittest

from machine import BIN, LIMIT, clock_id, unsigned, wait_for, wrong_unix_time
from signed_machine import SignedMachine

DONE, UNUSABLE, NOT_DONE = 0, 1, 3


class ControlProcess(SignedMachine):
    def run_example(self, command_key="local", permit_key="plc"):
        """Exit code and everything it printed."""
        public = re.search(r"key: \{public: ([0-9a-f]{64})", self.config.read_text()).group(1)
        done = subprocess.run([BIN / "control_process", "test", "axis1", public, self.keys / f"{command_key}.key",
                               self.keys / f"{permit_key}.key"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              timeout=2 * LIMIT, stdin=subprocess.DEVNULL)
        return done.returncode, done.stdout

    def test_it_follows_the_axis_and_zeroes_it_with_its_own_permits(self):
        self.run_signed_axis()
        def once():  # on a busy host, a permit ends too early, or the driver has too few readings to see that the shaft rests
            code, out = self.run_example()
            return None if code == NOT_DONE and ("PERMIT" in out or "too few fresh" in out) else (code, out)
        code, out = wait_for(once, "permits and readings in time")
        self.assertEqual(code, DONE, out)
        self.assertRegex(out, r"[0-9a-f]{32}: done and verified")
        self.assertEqual(self.encoder()["zeroings"], 1)
        counts = [int(known) for known in re.findall(r"positions in (\d+) of \d+ cycles", out)]
        self.assertEqual(len(counts), 2, out)
        self.assertGreater(min(counts), 0, out)
        permits = self.data.of("PERMIT/axis1")
        self.assertEqual(permits[-1]["permit_decoded"]["n_operations"], 0, "withdrawn")
        for permit in permits:
            body = permit["permit_decoded"]
            self.assertEqual(unsigned(body["clock_id"]), clock_id())
            self.assertLessEqual(body["issued_mono_ns"], permit["mono_ns"], "the instant of the call")
        issues = [permit["permit_decoded"]["issue"] for permit in permits]
        self.assertEqual(issues, sorted(issues))

    def test_a_permit_of_a_key_without_the_right_does_not_count(self):
        self.run_signed_axis()
        code, out = self.run_example(permit_key="local")
        self.assertEqual(code, NOT_DONE, out)
        self.assertRegex(out, r"[0-9a-f]{32}: rejected: .*whose role is not control")
        self.assertEqual(self.encoder()["zeroings"], 0)

    def test_it_names_what_does_not_work(self):
        self.run_signed_axis()
        code, out = self.run_example(permit_key="nobody")
        self.assertEqual(code, UNUSABLE, out)
        self.assertIn("nobody.key", out)

    def test_it_links_neither_drivers_nor_the_machine_file(self):
        needed = subprocess.run(["ldd", BIN / "control_process"], capture_output=True, text=True, check=True).stdout
        for foreign in ("yaml-cpp", "libmodbus", "libgpiod"):
            self.assertNotIn(foreign, needed)


class AgeOfAPermit(SignedMachine):
    def test_on_one_host_a_wrong_unix_time_refuses_no_permit(self):
        self.run_signed_axis()
        self.start_permits("zero_single_turn", env=wrong_unix_time(-3600))
        permit = self.data.last("PERMIT/axis1")
        self.assertLess(permit["permit_decoded"]["issued_utime"], time.time() * 1e6 - 3_500_000_000, "an hour behind")
        code, outcome = self.permitted("zero", "axis1", "--yes")
        self.assertEqual(code, DONE, outcome)

    def test_of_another_clock_unix_time_counts(self):
        self.run_signed_axis()
        self.start_permits("zero_single_turn", before=("unshare", "--time", "--fork", "--kill-child", "--monotonic", "90000"),
                           env=wrong_unix_time(-3600))
        code, outcome = self.command("zero", "axis1", "--yes")
        self.assertEqual((code, outcome["reason"]), (NOT_DONE, "no_permit"), outcome)
        self.assertRegex(outcome["text"], r"was issued 360\d s ago by UNIX time")
        self.processes.pop().kill()  # unshare hands no SIGTERM on
        self.start_permits("zero_single_turn", before=("unshare", "--time", "--fork", "--kill-child", "--monotonic", "90000"))
        code, outcome = self.permitted("zero", "axis1", "--yes")
        self.assertEqual(code, DONE, outcome)


if __name__ == "__main__":
    unittest.main()
