"""The package on a Debian that runs: installed, a machine commissioned as docs/install.md describes, upgraded, removed. Nothing
but systemd starts a process of ours here, within the sandboxes of the units."""

import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import unittest
import urllib.request

from machine import wait_for

PACKAGE = next(pathlib.Path("/packages").glob("axlecast_*.deb"))
NEWER = "/packages/newer/axlecast.deb"
LIMIT = 120  # s: an emulated machine on a busy host
CONFIG = pathlib.Path("/etc/axlecast/machine.yaml")
DRIVERS = ["axlecast-driver@line.service", "axlecast-driver@motors.service"]
ACCOUNTS = {"axlecast-bridge": "axlecast-bridge", "axlecast-driver": "axlecast-drivers", "axlecast-record": "axlecast-record",
            "axlecast-simulate": "axlecast-drivers", "axlecast-web": "axlecast-web"}
SERVICES = ["axlecast-bridge.service", *DRIVERS, "axlecast-record.service", "axlecast-simulate.service"]
MACHINE = """\
machine: press3
lcm:
  url: "udpm://239.255.76.67:7667?ttl=0"
  command_url: "udpm://239.255.76.67:7668?ttl=0"
{bridge}
  journal: /var/lib/axlecast/press3/journal.db
recorder:
  directory: /var/log/axlecast
  logs: {{all: {{quota: 100MB}}}}
buses:
  line:
    family: tformat
    simulate: true
    poll_hz: 20
    realtime: {{priority: 50, lock_memory: true}}
    devices:
      axis: {{model: ts5669n127, timeout_us: 500000, permit: not_required, eeprom_writable: [5]}}
  motors:
    family: tsubaki_sc
    simulate: true
    poll_hz: 1
    devices:
      motor: {{address: 1, timeout_us: 2000000}}
"""
# Emulated, a loop may well stand still for as long as the units allow.
PATIENCE = "[Service]\nWatchdogSec=20\nTimeoutStartSec=200\nTimeoutStopSec=60\n"


def run(*command, code=0):
    result = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT)
    if code is not None and result.returncode != code:
        raise AssertionError(f"{command}: exit code {result.returncode}\n{result.stdout}\n{result.stderr}")
    return result.stdout


def show(unit, name):
    return run("systemctl", "show", "--property", name, "--value", unit).strip()


def active(unit):
    return show(unit, "ActiveState")


def pid(unit):
    return int(show(unit, "MainPID"))


def journal(*units):
    return run("journalctl", "--no-pager", "--lines", "60", *(f"--unit={unit}" for unit in units))


def online():
    return subprocess.run(["axlecast", "status"], capture_output=True).returncode == 0


def wait_until_online():
    wait_for(online, lambda: run("axlecast", "status", code=None) + journal("axlecast*"), LIMIT)


def wait_for_another(unit, before):
    """The unit's process, once it is not `before` and the machine is whole."""
    wait_for(lambda: active(unit) == "active" and pid(unit) not in (0, before), lambda: journal(unit), LIMIT)
    wait_until_online()
    return pid(unit)


def setUpModule():
    for unit in ("axlecast-bridge", "axlecast-driver@", "axlecast-web"):
        folder = pathlib.Path(f"/run/systemd/system/{unit}.service.d")
        folder.mkdir(parents=True)
        (folder / "patience.conf").write_text(PATIENCE)


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        run("dpkg", "--install", str(PACKAGE))
        cls.began_with = active("axlecast.target"), [active(unit) for unit in SERVICES]
        keys = json.loads(run("axlecast", "keygen", "--machine", "press3", "--json"))
        CONFIG.write_text(MACHINE.format(bridge=keys["yaml"].rstrip()))
        run("axlecast", "check-config")
        run("systemctl", "daemon-reload")
        run("systemctl", "enable", "--now", "axlecast-multicast", "axlecast-web")
        run("systemctl", "restart", "axlecast.target")
        wait_until_online()
        cls.restarts = {unit: show(unit, "NRestarts") for unit in SERVICES}

    def test_a_package_alone_starts_nothing(self):
        self.assertEqual(self.began_with, ("active", ["inactive"] * len(SERVICES)))

    def test_every_unit_of_the_file_runs(self):
        self.assertEqual(self.restarts, dict.fromkeys(SERVICES, "0"))
        for unit in [*SERVICES, "axlecast-web.service", "axlecast-multicast.service"]:
            self.assertEqual(active(unit), "active", journal(unit))
        self.assertEqual(run("systemctl", "--failed", "--no-legend", "--plain", "list-units", "axlecast*"), "")

    def test_processes_have_no_privileges(self):
        for unit in [*SERVICES, "axlecast-web.service"]:
            status = pathlib.Path(f"/proc/{pid(unit)}/status").read_text()
            self.assertRegex(status, r"CapEff:\s*0+\n", unit)
            self.assertRegex(status, r"NoNewPrivs:\s*1\n", unit)
            self.assertRegex(status, r"Seccomp:\s*2\n", unit)
            self.assertEqual(pathlib.Path(f"/proc/{pid(unit)}").owner(), ACCOUNTS[re.sub(r"@.*|\.service", "", unit)])

    def test_the_multicast_route_is_there(self):
        self.assertIn("dev lo", run("ip", "route", "get", "239.255.76.67"))
        self.assertEqual(run("axlecast", "doctor", "--only", "multicast_route,multicast_interface,loopback_multicast"), "")

    def test_real_time_is_granted(self):
        threads = os.listdir(f"/proc/{pid(DRIVERS[0])}/task")
        policies = [os.sched_getscheduler(int(thread)) & ~os.SCHED_RESET_ON_FORK for thread in threads]
        self.assertIn(os.SCHED_FIFO, policies)
        self.assertRegex(pathlib.Path(f"/proc/{pid(DRIVERS[0])}/status").read_text(), r"VmLck:\s*[1-9]\d* kB")

    def test_a_signed_command_is_carried_out(self):
        answer = json.loads(run("axlecast", "eeprom", "write", "axis", "5", "A1", "--yes", "--json"))
        self.assertEqual(answer["outcome"], "succeeded")
        self.assertEqual([path.name for path in pathlib.Path("/var/lib/axlecast").rglob("journal.db")], ["journal.db"])
        self.assertIn("eeprom", run("axlecast", "history"))

    def test_the_recorder_writes(self):
        def recorded():
            return sum(path.stat().st_size for path in pathlib.Path("/var/log/axlecast").rglob("*.lcm"))
        size = recorded()
        wait_for(lambda: recorded() > size, lambda: journal("axlecast-record"), LIMIT)

    def test_page_and_metrics_are_served(self):
        for path, text in (("/", "<html"), ("/healthz", '"ok"'), ("/metrics", 'device="axis"')):
            with urllib.request.urlopen(f"http://127.0.0.1:8380{path}", timeout=LIMIT) as answer:
                self.assertIn(text, answer.read().decode(), path)

    def test_a_killed_driver_comes_back(self):
        before = pid(DRIVERS[0])
        os.kill(before, signal.SIGKILL)
        wait_for_another(DRIVERS[0], before)

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

    def test_memory_is_bounded(self):
        for unit in [*SERVICES, "axlecast-web.service"]:
            self.assertLessEqual(int(show(unit, "MemoryMax")), 512 << 20, unit)

    def test_keys_are_readable_for_their_process_only(self):
        owners = {path.name: path.group() for path in pathlib.Path("/etc/axlecast/press3").glob("*.key")}
        self.assertEqual(owners, {"bridge.key": "axlecast-bridge", "drivers.key": "axlecast-drivers", "local.key": "root"})
        self.assertEqual(run("axlecast", "doctor", "--only", "key_access,group_members,key_mode,key_owner"), "")

    def test_what_stands_still_is_restarted(self):
        before = {unit: pid(unit) for unit in (DRIVERS[1], "axlecast-record.service")}
        for process in before.values():
            os.kill(process, signal.SIGSTOP)
        for unit, process in before.items():
            wait_for_another(unit, process)
            self.assertIn("Watchdog timeout", journal(unit))

    def test_a_killed_bridge_comes_back_with_its_journal(self):
        before = pid(SERVICES[0])
        os.kill(before, signal.SIGKILL)
        wait_for_another(SERVICES[0], before)
        run("axlecast", "history")

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

    def test_a_file_with_mistakes_is_told_in_the_kernels_log(self):
        whole = CONFIG.read_text()
        CONFIG.write_text(whole.replace("buses:", "busses:"))
        run("systemctl", "daemon-reload")
        told = run("dmesg")
        CONFIG.write_text(whole)
        run("systemctl", "daemon-reload")
        self.assertIn("busses", told)

    def test_adapters_are_named_and_quick(self):
        name = pathlib.Path("/dev/axlecast/FT7ABC-if00")
        wait_for(name.exists, lambda: run("udevadm", "info", "--export-db"))
        self.assertEqual(name.resolve().parent, pathlib.Path("/dev"))
        timer = pathlib.Path(f"/sys/bus/usb-serial/devices/{name.resolve().name}/latency_timer")
        self.assertEqual(timer.read_text().strip(), "1")
        self.assertEqual(name.resolve().group(), "dialout")

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
