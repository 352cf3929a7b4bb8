"""What systemd receives from axlecast record: ready when it listens, and fed only while it reads."""

import ctypes
import os
import signal
import socket
import unittest

from machine import wait_for
from recording import Recorder

WATCHDOG_S = 0.9
PTRACE_SEIZE, PTRACE_INTERRUPT, PTRACE_DETACH = 0x4206, 0x4207, 17


def trace(request, thread):
    libc = ctypes.CDLL(None, use_errno=True)
    libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
    if libc.ptrace(request, thread, None, None) != 0:
        raise OSError(ctypes.get_errno(), f"ptrace {request:#x} of {thread}")


class RecordSupervised(Recorder):
    def setUp(self):
        super().setUp()
        self.systemd = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.addCleanup(self.systemd.close)
        self.systemd.bind(str(self.folder / "notify"))

    def heard(self, seconds):
        """The next message to systemd, None if nothing comes in this time."""
        self.systemd.settimeout(seconds)
        try:
            return self.systemd.recv(4096).decode()
        except TimeoutError:
            return None

    def supervised(self):
        return self.record(self.log_path, env={"NOTIFY_SOCKET": str(self.folder / "notify"),
                                               "WATCHDOG_USEC": str(int(WATCHDOG_S * 1e6))})

    def test_it_is_ready_fed_and_ends(self):
        process = self.supervised()
        self.assertEqual(self.heard(30), "READY=1")
        for _ in range(3):
            self.assertEqual(self.heard(30), "WATCHDOG=1")
        process.send_signal(signal.SIGINT)
        wait_for(lambda: self.heard(30) == "STOPPING=1", "the end to be told")
        self.assertEqual(process.wait(30), 0)

    def test_threads_that_hang_leave_it_hungry(self):
        process = self.supervised()
        wait_for(lambda: self.heard(30) == "WATCHDOG=1", "the first feeding")
        threads = [int(name) for name in os.listdir(f"/proc/{process.pid}/task") if int(name) != process.pid]
        for thread in threads:
            trace(PTRACE_SEIZE, thread)
            trace(PTRACE_INTERRUPT, thread)
            os.waitpid(thread, 0x40000000)  # __WALL: a thread is waited for as a child
        wait_for(lambda: self.heard(3 * WATCHDOG_S) is None, "the feeding to end")
        for thread in threads:
            trace(PTRACE_DETACH, thread)
        self.assertEqual(self.heard(30), "WATCHDOG=1")


if __name__ == "__main__":
    unittest.main()
