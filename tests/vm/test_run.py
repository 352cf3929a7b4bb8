"""The runner: what goes wrong inside the guest must fail the run, with a message. test_run_ends.py: how a guest can end."""

import subprocess
import tempfile
import unittest

from broken_suite import BUILD, RUN, run_suite


class Run(unittest.TestCase):
    def test_a_failed_case_fails_the_run_and_is_named(self):
        code, output = run_suite(self, "self.assertEqual(1, 2)")
        self.assertEqual(code, 1, output)
        self.assertIn("AssertionError: 1 != 2", output)
        self.assertTrue(output.endswith("FAILED: broken.Broken.test_then\n"), output)

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
