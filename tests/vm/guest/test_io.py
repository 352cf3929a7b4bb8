"""The C++ tests that need a kernel interface (tests/vm/*_test.cpp). They find can0 and can1 up on one bus."""

import subprocess
import unittest

import can_bus
from spi_bus import PROGRAMS


class Io(unittest.TestCase):
    def test_what_needs_a_kernel_interface(self):
        for interface in ("can0", "can1"):
            can_bus.up(interface)
            self.addCleanup(can_bus.down, interface)
        done = subprocess.run([PROGRAMS / "vm_io_test", "--gtest_brief=1"], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, check=False)
        print(done.stdout)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertNotIn("SKIPPED", done.stdout)
