"""The runner: a guest that crashes or hangs fails the run. Each case boots a guest, which takes up to a minute: `tools/campaign vm`."""

import unittest

from broken_suite import run_suite


class RunEnds(unittest.TestCase):
    def test_a_crash_of_the_kernel_fails_the_run(self):
        code, output = run_suite(self, "pathlib.Path('/proc/sysrq-trigger').write_text('c')")
        self.assertEqual(code, 1, output)
        self.assertTrue(output.endswith("FAILED: the guest's kernel crashed\n"), output)
        self.assertIn("sysrq triggered crash", output.split("last lines of the guest's console")[1])

    def test_a_case_that_hangs_fails_the_run_and_shows_where(self):
        code, output = run_suite(self, "time.sleep(1000)", environment={"AXLECAST_VM_CASE_LIMIT": "1"})
        self.assertEqual(code, 1, output)
        self.assertIn("in test_then", output)
        self.assertTrue(output.endswith("FAILED: the guest ended before its suites did\n"), output)

    def test_a_guest_that_hangs_is_killed(self):
        code, output = run_suite(self, "time.sleep(1000)", "--limit", "4")
        self.assertEqual(code, 1, output)
        self.assertTrue(output.endswith("FAILED: the guest did not end within 4 s and was killed\n"), output)


if __name__ == "__main__":
    unittest.main(verbosity=2)
