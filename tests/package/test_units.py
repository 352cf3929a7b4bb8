"""The units as they are in the tree: which account each has, what a failure leads to, and who may open which device."""

import os
import pathlib
import re
import subprocess
import tempfile
import unittest

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "packaging/systemd"
UNITS = {path.name: path.read_text() for path in FOLDER.glob("*.service")}
ACCOUNTS = {"axlecast-bridge.service": "axlecast-bridge", "axlecast-driver@.service": "axlecast-drivers",
            "axlecast-mqtt.service": "axlecast-mqtt", "axlecast-multicast.service": "axlecast-multicast",
            "axlecast-record.service": "axlecast-record", "axlecast-simulate.service": "axlecast-drivers",
            "axlecast-sets.service": "axlecast-sets", "axlecast-ship.service": "axlecast-ship", "axlecast-time.service": "axlecast-time",
            "axlecast-web.service": "axlecast-web"}
OPERATORS = "axlecast"


def setting(unit, name):
    return re.findall(rf"^{name}=(.*)$", unit, re.MULTILINE)


class Units(unittest.TestCase):
    def test_each_process_has_its_own_account(self):
        self.assertEqual({name: setting(unit, "User")[0] for name, unit in UNITS.items()}, ACCOUNTS)
        self.assertEqual({name: setting(unit, "Group")[0] for name, unit in UNITS.items()}, ACCOUNTS)
        made = set(re.findall(r"^u (\S+)", (FOLDER / "axlecast.sysusers").read_text(), re.MULTILINE))
        self.assertEqual(made, set(ACCOUNTS.values()))

    def test_no_process_is_an_operator(self):
        for name, unit in UNITS.items():
            groups = " ".join(setting(unit, "SupplementaryGroups")).split()
            self.assertEqual(groups, ["dialout"] if name == "axlecast-driver@.service" else [], name)
        self.assertNotRegex((FOLDER / "axlecast.sysusers").read_text(), r"(?m)^m ")

    def test_devices_are_for_drivers_only(self):
        rules = (FOLDER / "70-axlecast.rules").read_text()
        self.assertEqual(set(re.findall(r'GROUP="(.*?)"', rules)), {"axlecast-drivers"})
        for name, unit in UNITS.items():
            if name != "axlecast-driver@.service":
                self.assertEqual((setting(unit, "PrivateDevices"), setting(unit, "DeviceAllow")), (["yes"], []), name)

    def test_operators_own_nothing_that_is_written(self):
        for line in (FOLDER / "axlecast.tmpfiles").read_text().splitlines():
            if line.startswith("d "):
                _, path, mode, owner, group = line.split()
                self.assertNotEqual(owner, OPERATORS, line)
                if group == OPERATORS:
                    self.assertEqual(int(mode, 8) & 0o027, 0, f"{line}: operators read")

    def test_a_failure_is_never_the_last_try(self):
        for name, unit in UNITS.items():
            self.assertEqual(setting(unit, "StartLimitIntervalSec"), ["0"], name)
            self.assertIn(setting(unit, "Restart"), (["always"], ["on-failure"]), name)
            # Two shippers of one machine would replace each other for ever.
            expected = ["8"] if name == "axlecast-ship.service" else []
            self.assertEqual(setting(unit, "RestartPreventExitStatus"), expected, name)
            for moment in ("ExecStartPre", "ExecStopPost"):
                self.assertIn("lib/axlecast/restart-delay", setting(unit, moment)[0], name)

    def test_memory_is_bounded(self):
        for name, unit in UNITS.items():
            self.assertRegex(setting(unit, "MemoryMax")[0], r"^\d+M$", name)


class RestartDelay(unittest.TestCase):
    """The script, with a clock and a sleep of the test's own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "state").mkdir()
        self.now = 1_000_000
        for name, text in (("sleep", 'echo "$1" >>"$SLEPT"'), ("date", 'cat "$CLOCK"')):
            (self.folder / name).write_text(f"#!/bin/sh\n{text}\n")
            (self.folder / name).chmod(0o755)

    def run_script(self, moment, result="success"):
        (self.folder / "clock").write_text(str(self.now))
        environment = {"PATH": f"{self.folder}:{os.environ['PATH']}", "RUNTIME_DIRECTORY": str(self.folder / "state"),
                       "SERVICE_RESULT": result, "SLEPT": str(self.folder / "slept"), "CLOCK": str(self.folder / "clock")}
        done = subprocess.run([FOLDER / "restart-delay", moment], env=environment, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def delay(self):
        """Of one start."""
        (self.folder / "slept").write_text("")
        self.run_script("before")
        return int((self.folder / "slept").read_text() or 0)

    def crash(self, after=0, result="exit-code"):
        self.now += after
        self.run_script("after", result)

    def test_failures_in_a_row_wait_longer_and_longer(self):
        delays = []
        for _ in range(9):
            delays.append(self.delay())
            self.crash(after=1)
        self.assertEqual(delays, [0, 0, 1, 3, 7, 15, 29, 29, 29])

    def test_a_unit_that_lasted_begins_again(self):
        for _ in range(7):
            self.delay()
            self.crash(after=59, result="watchdog")
        self.assertEqual(self.delay(), 29)
        self.crash(after=60)
        self.assertEqual(self.delay(), 0)
        self.crash(after=1)
        self.assertEqual(self.delay(), 1)

    def test_a_stop_is_no_failure(self):
        for _ in range(5):
            self.delay()
            self.crash()
        self.crash(result="success")
        self.assertEqual(self.delay(), 0)

    def test_a_state_that_is_damaged_is_no_delay(self):
        (self.folder / "state/failures").write_text("x y\n")
        (self.folder / "state/started").write_text("")
        self.assertEqual(self.delay(), 0)
        self.crash()
        self.assertEqual(self.delay(), 0)


if __name__ == "__main__":
    unittest.main()
