"""The life of the package on a Debian that runs: units that fail, stop, start and are new, an upgrade, the removal.

`tools/campaign package` runs it: on an emulated machine, systemd takes many seconds for each start of a unit."""

import os
import pathlib
import shutil
import signal
import unittest

from machine import wait_for
from systemd_machine import (CONFIG, DRIVERS, LIMIT, SERVICES, active, commission, journal, pid, run, show, wait_for_another,
                             wait_until_online)

NEWER = "/packages/newer/axlecast.deb"


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        commission()

    def test_a_killed_bridge_comes_back_with_its_journal(self):
        before = pid(SERVICES[0])
        os.kill(before, signal.SIGKILL)
        wait_for_another(SERVICES[0], before)
        run("axlecast", "history")

    def test_a_file_with_mistakes_is_told_in_the_kernels_log(self):
        whole = CONFIG.read_text()
        CONFIG.write_text(whole.replace("buses:", "busses:"))
        run("systemctl", "daemon-reload")
        told = run("dmesg")
        CONFIG.write_text(whole)
        run("systemctl", "daemon-reload")
        self.assertIn("busses", told)

    def test_a_unit_that_keeps_failing_is_tried_for_ever_and_ever_more_slowly(self):
        unit = DRIVERS[1]
        folder = pathlib.Path(f"/run/systemd/system/{unit}.d")
        folder.mkdir()
        (folder / "broken.conf").write_text("[Service]\nExecStart=\nExecStart=/bin/false\n")
        run("systemctl", "daemon-reload")
        before = int(show(unit, "NRestarts"))
        os.kill(pid(unit), signal.SIGKILL)
        failures = pathlib.Path("/run/axlecast-restart/axlecast-driver@motors/failures")
        wait_for(lambda: failures.exists() and int(failures.read_text() or 0) >= 4, lambda: journal(unit), LIMIT)
        self.assertGreaterEqual(int(show(unit, "NRestarts")), before + 3)
        self.assertNotEqual(active(unit), "failed")
        shutil.rmtree(folder)
        run("systemctl", "daemon-reload")
        wait_for_another(unit, 0)

    def test_what_stands_still_is_restarted(self):
        before = {unit: pid(unit) for unit in (DRIVERS[1], "axlecast-record.service")}
        for process in before.values():
            os.kill(process, signal.SIGSTOP)
        for unit, process in before.items():
            wait_for(lambda: "Watchdog timeout" in journal(unit), lambda: journal(unit), LIMIT)
            wait_for_another(unit, process)

    def test_the_target_stops_and_starts_all(self):
        run("systemctl", "stop", "axlecast.target")
        wait_for(lambda: all(active(unit) in ("inactive", "failed") for unit in SERVICES), lambda: journal(*SERVICES), LIMIT)
        states = {unit: (active(unit), show(unit, "Result")) for unit in SERVICES}
        self.assertEqual(states, dict.fromkeys(SERVICES, ("inactive", "success")), journal(*SERVICES))
        run("systemctl", "start", "axlecast.target")
        wait_until_online()

    def test_a_bus_that_is_new_in_the_file_gets_a_driver(self):
        whole = CONFIG.read_text()
        unit = "axlecast-driver@second.service"
        CONFIG.write_text(whole.replace("  motors:\n", "  second:\n    family: ssi\n    simulate: true\n    poll_hz: 5\n"
                                        "    devices:\n      table: {model: twk, bits: 13, turn_bits: 12}\n  motors:\n"))
        run("systemctl", "daemon-reload")
        run("systemctl", "restart", "axlecast.target")
        wait_for(lambda: active(unit) == "active", lambda: journal(unit), LIMIT)
        wait_until_online()
        CONFIG.write_text(whole)
        run("systemctl", "stop", unit)
        run("systemctl", "daemon-reload")
        run("systemctl", "restart", "axlecast.target")
        wait_until_online()
        self.assertEqual(active(unit), "inactive")

    def test_upgraded_it_runs_on(self):
        before = pid(DRIVERS[0])
        run("dpkg", "--install", NEWER)
        wait_for_another(DRIVERS[0], before)
        self.assertEqual(active("axlecast-web.service"), "active")


class Removed(unittest.TestCase):
    """After Installed: suites run by name."""

    def test_nothing_runs_and_nothing_is_left(self):
        run("dpkg", "--remove", "axlecast")
        owners = {path.owner() for path in pathlib.Path("/proc").glob("[0-9]*")}
        self.assertEqual([owner for owner in owners if owner.startswith("axlecast")], [])
        self.assertEqual([unit for unit in SERVICES if active(unit) != "inactive"], [], journal(*SERVICES))
        self.assertTrue(list(pathlib.Path("/var/log/axlecast").rglob("*.lcm")), "what was recorded outlives a removal")
        run("dpkg", "--purge", "axlecast")
        left = [str(path) for folder in ("/etc", "/usr", "/var/log", "/var/lib/systemd", "/var/lib/axlecast", "/run/axlecast")
                for path in pathlib.Path(folder).glob("**/axlecast*")]
        self.assertEqual([path for path in left if not path.startswith("/etc/axlecast")], [], "but the operator's own")
        run("systemctl", "daemon-reload")
        self.assertEqual(run("systemctl", "--failed", "--no-legend", "--plain", "list-units", "axlecast*"), "")


if __name__ == "__main__":
    unittest.main()
