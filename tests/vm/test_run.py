"""The runner: what goes wrong inside the guest must fail the run, with a message."""

import os
import pathlib
import subprocess
import tempfile
import textwrap
import unittest

RUN = pathlib.Path(__file__).resolve().parent / "run"
BUILD = pathlib.Path(os.environ["AXLECAST_BIN"]).parent

SUITE = textwrap.dedent("""\
    import pathlib
    import time
    import unittest


    class Broken(unittest.TestCase):
        def test_good(self):
            pass

        def test_then(self):
            {then}
    """)


class Run(unittest.TestCase):
    def run_suite(self, then, *options, environment=None):
        """Runs a suite whose second case does `then`: (exit code, output)."""
        with tempfile.TemporaryDirectory(prefix="axlecast-vm-") as folder:
            suite = pathlib.Path(folder, "test_broken.py")
            suite.write_text(SUITE.format(then=then))
            done = subprocess.run([RUN, "--build", BUILD, "--results", f"{folder}/results", *options, suite],
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                  env={**os.environ, **(environment or {})}, check=False)
        self.assertNotIn("Traceback (most recent call last):\n  File \"" + str(RUN), done.stdout)
        return done.returncode, done.stdout

    def test_a_failed_case_fails_the_run_and_is_named(self):
        code, output = self.run_suite("self.assertEqual(1, 2)")
        self.assertEqual(code, 1, output)
        self.assertIn("AssertionError: 1 != 2", output)
        self.assertTrue(output.endswith("FAILED: broken.Broken.test_then\n"), output)

    def test_a_crash_of_the_kernel_fails_the_run(self):
        code, output = self.run_suite("pathlib.Path('/proc/sysrq-trigger').write_text('c')")
        self.assertEqual(code, 1, output)
        self.assertTrue(output.endswith("FAILED: the guest's kernel crashed\n"), output)
        self.assertIn("sysrq triggered crash", output.split("last lines of the guest's console")[1])

    def test_a_case_that_hangs_fails_the_run_and_shows_where(self):
        code, output = self.run_suite("time.sleep(1000)", environment={"AXLECAST_VM_CASE_LIMIT": "1"})
        self.assertEqual(code, 1, output)
        self.assertIn("in test_then", output)
        self.assertTrue(output.endswith("FAILED: the guest ended before its suites did\n"), output)

    def test_a_guest_that_hangs_is_killed(self):
        code, output = self.run_suite("time.sleep(1000)", "--limit", "4")
        self.assertEqual(code, 1, output)
        self.assertTrue(output.endswith("FAILED: the guest did not end within 4 s and was killed\n"), output)

    def test_an_unknown_suite_and_a_missing_program_are_refused(self):
        with tempfile.TemporaryDirectory(prefix="axlecast-vm-") as folder:
            command = [RUN, "--build", BUILD, "--results", f"{folder}/results"]
            done = subprocess.run([*command, "warp_drive"], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, "no suite test_warp_drive.py; there are: .*can_interface")
            done = subprocess.run([*command, "can_interface"], capture_output=True, text=True, check=False,
                                  env={"PATH": "/nowhere"})
            self.assertEqual(done.returncode, 1)
            self.assertIn("is missing: ", done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
