"""The package on a Debian that runs: what is installed, and what its units do while they run."""

import json
import os
import pathlib
import re
import signal
import unittest
import urllib.request

from machine import clock_id, unsigned, wait_for
from systemd_machine import (CONFIG, DRIVERS, LIMIT, SERVICES, active, commission, journal, pid, run, show, wait_for_another)

ACCOUNTS = {"axlecast-bridge": "axlecast-bridge", "axlecast-driver": "axlecast-drivers", "axlecast-record": "axlecast-record",
            "axlecast-ship": "axlecast-ship", "axlecast-simulate": "axlecast-drivers", "axlecast-web": "axlecast-web"}


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        # The guest's disk (9p) has no access lists, by which the shipper reads the folder of the logs.
        logs = pathlib.Path("/var/log/axlecast")
        logs.mkdir()
        run("mount", "-t", "tmpfs", "tmpfs", str(logs))
        cls.began_with = commission()
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
            self.check_privileges(unit)

    def check_privileges(self, unit):
        status = pathlib.Path(f"/proc/{pid(unit)}/status").read_text()
        self.assertRegex(status, r"CapEff:\s*0+\n", unit)
        self.assertRegex(status, r"NoNewPrivs:\s*1\n", unit)
        self.assertRegex(status, r"Seccomp:\s*2\n", unit)
        self.assertEqual(pathlib.Path(f"/proc/{pid(unit)}").owner(), ACCOUNTS[re.sub(r"@.*|\.service", "", unit)])

    def test_the_multicast_route_is_there(self):
        self.assertIn("dev lo", run("ip", "route", "get", "239.255.76.67"))
        self.assertEqual(run("axlecast", "doctor", "--only", "multicast_route,multicast_interface,loopback_multicast"), "")

    def test_readings_have_the_clock_of_this_host(self):
        devices = json.loads(run("axlecast", "status", "--json"))["devices"]
        self.assertEqual({unsigned(device["clock_id"]) for device in devices}, {clock_id()})

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

    def test_the_shipper_reads_the_logs_and_waits_for_its_database(self):
        unit, whole = "axlecast-ship.service", CONFIG.read_text()
        CONFIG.write_text(whole + "ship: {database: host=127.0.0.1 dbname=fleet user=ship}\n")
        run("systemctl", "daemon-reload")
        self.assertIn(unit, run("systemctl", "show", "--property", "Wants", "--value", "axlecast.target"))
        run("systemctl", "start", unit)
        wait_for(lambda: re.search(r"no connection to the database.* in \d+ logs? not shipped", show(unit, "StatusText")),
                 lambda: show(unit, "StatusText") + journal(unit), LIMIT)
        self.assertNotIn("skipped", show(unit, "StatusText"))
        self.check_privileges(unit)
        # shipped.json: the shipper writes it, and the recorder reads it.
        shipped = "/var/log/axlecast/tried.json"
        for account, command in (("axlecast-ship", f"umask 022; echo {{}} > {shipped}"), ("axlecast-record", f"cat {shipped}"),
                                 ("axlecast-ship", f"rm {shipped}")):
            run("setpriv", "--reuid", account, "--regid", account, "--clear-groups", "sh", "-c", command)
        self.assertEqual(show(unit, "NRestarts"), "0", journal(unit))
        run("systemctl", "stop", unit)
        self.assertEqual(show(unit, "Result"), "success", journal(unit))
        CONFIG.write_text(whole)
        run("systemctl", "daemon-reload")

    def test_page_and_metrics_are_served(self):
        for path, text in (("/", "<html"), ("/healthz", '"ok"'), ("/metrics", 'device="axis"')):
            with urllib.request.urlopen(f"http://127.0.0.1:8380{path}", timeout=LIMIT) as answer:
                self.assertIn(text, answer.read().decode(), path)

    def test_a_killed_driver_comes_back(self):
        before = pid(DRIVERS[0])
        os.kill(before, signal.SIGKILL)
        wait_for_another(DRIVERS[0], before)

    def test_memory_is_bounded(self):
        for unit in [*SERVICES, "axlecast-web.service"]:
            self.assertLessEqual(int(show(unit, "MemoryMax")), 512 << 20, unit)

    def test_keys_are_readable_for_their_process_only(self):
        owners = {path.name: path.group() for path in pathlib.Path("/etc/axlecast/press3").glob("*.key")}
        self.assertEqual(owners, {"bridge.key": "axlecast-bridge", "drivers.key": "axlecast-drivers", "local.key": "root"})
        self.assertEqual(run("axlecast", "doctor", "--only", "key_access,group_members,key_mode,key_owner"), "")

    def test_adapters_are_named_and_quick(self):
        name = pathlib.Path("/dev/axlecast/FT7ABC-if00")
        wait_for(name.exists, lambda: run("udevadm", "info", "--export-db"))
        self.assertEqual(name.resolve().parent, pathlib.Path("/dev"))
        timer = pathlib.Path(f"/sys/bus/usb-serial/devices/{name.resolve().name}/latency_timer")
        self.assertEqual(timer.read_text().strip(), "1")
        self.assertEqual(name.resolve().group(), "dialout")


if __name__ == "__main__":
    unittest.main()
