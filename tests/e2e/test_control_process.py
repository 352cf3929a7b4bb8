"""The example of a control process in C against a bridge, a driver and a simulated encoder that counts what it did."""

import re
import subprocess
import unittest

from machine import BIN, LIMIT, clock_id, unsigned, wait_for
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
        self.assertRegex(out, r"[0-9a-f]{32}: rejected: .*nothing was done")
        self.assertIn("whose role is not control", out)
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


if __name__ == "__main__":
    unittest.main()
