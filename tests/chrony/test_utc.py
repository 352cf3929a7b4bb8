"""What chronyd claims about UTC, in TIME/<host>: a real chronyd that sets no clock (-x), with a server on another host. Both have the clock of
this computer, so that the truth is known: the claimed interval must contain UNIX time of this test."""

import json
import subprocess
import time
import unittest

from machine import BIN, Machine, one_axis, wait_for
from two_hosts import LinkedHosts, ip

PROGRAMS = BIN.parent / "vm/chrony/usr"  # chrony_package.py
CHRONY, PTP = 3, 4
CLAIMED, ASSUMED = 2, 1
SERVER = "10.1.0.2"


class Utc(LinkedHosts, Machine):
    def setUp(self):
        super().setUp()
        self.config = self.write(f"{one_axis()}time: {{root: plc1, address: 127.0.0.1}}\n")

    def chronyd(self, name, text, *before):
        config = self.folder / f"{name}.conf"
        config.write_text(f"{text}\npidfile {self.folder / name}.pid\nbindcmdaddress {'/' if before else '127.0.0.1'}\n")
        return self.start(name, *before, PROGRAMS / "sbin/chronyd", "-x", "-u", "root", "-d", "-f", config)

    def run_chrony(self):
        """Starts a server on the other host, and a client on this one."""
        self.link(1)
        self.chronyd("server", "local stratum 1\nallow 10.1.0.0/24", *self.other.words())
        return self.chronyd("client", f"server {SERVER} iburst minpoll -2 maxpoll -2")

    def run_time(self, host="plc1", env=None):
        process = self.start(f"time-{host}", BIN / "axlecast", "time", self.config, "--host", host, env=env)
        return process

    def wait_quality(self, condition, what):
        mark = self.messages.mark()
        return wait_for(lambda: [m for m in self.messages.of("TIME/plc1", mark) if condition(m)],
                        lambda: f"{what}: {self.messages.last('TIME/plc1')} {self.log('client')} {self.log('server')}")[0]

    def test_the_claim_is_that_of_chronyd_and_holds_the_truth(self):
        client = self.run_chrony()
        self.run_time()
        self.messages = self.watch(self.config)
        message = self.wait_quality(lambda m: m["utc_half_width_ns"] >= 0, "a claim")
        self.assertEqual((message["utc_source"], message["utc_grade"], message["utc_reference"]), (CHRONY, CLAIMED, SERVER))
        for _ in range(5):
            message = self.wait_quality(lambda m: m["utc_half_width_ns"] >= 0, "a claim")
            utc = time.clock_gettime_ns(time.CLOCK_REALTIME) - time.clock_gettime_ns(time.CLOCK_MONOTONIC) + message["mono_ns"]
            self.assertLessEqual(abs(message["utc_ns"] - utc), message["utc_half_width_ns"] + 50_000, message)

        def synchronised():
            # While chronyd is not, it reports a delay of 1 s.
            tracking = subprocess.run((PROGRAMS / "bin/chronyc", "-n", "-c", "tracking"), capture_output=True, text=True, check=True).stdout.strip().split(",")
            return tracking if tracking[-1] == "Normal" else None
        tracking = wait_for(synchronised, "chronyd to be synchronised")
        delay, dispersion = float(tracking[10]) * 1e9, float(tracking[11]) * 1e9
        message = self.wait_quality(lambda m: m["utc_half_width_ns"] >= 0, "a claim")
        self.assertGreaterEqual(message["utc_half_width_ns"], delay / 2)
        self.assertLess(message["utc_half_width_ns"], delay * 10 + dispersion * 10 + 100_000_000, tracking)
        status = wait_for(lambda: "UTC +-" in self.axlecast("status", self.config)[1] and self.axlecast("status", self.config)[1], "the claim in status")
        self.assertIn(f" ms from {SERVER} (chrony)", status)
        doctor = json.loads(self.axlecast("doctor", self.config, "--only", "clock_sync", "--json")[1])
        self.assertEqual(doctor["findings"], [], "the kernel does not know of a chronyd without rtcsync")
        self.assertIn(f"kept by chronyd from {SERVER}, which claims +-", doctor["clock"])
        # The link ends: the claim grows.
        ip("link", "del", "eth1")
        narrow = self.wait_quality(lambda m: m["utc_half_width_ns"] >= 0, "a claim")["utc_half_width_ns"]
        self.wait_quality(lambda m: m["utc_half_width_ns"] > narrow + 10_000, "a wider claim")
        # chronyd ends: no claim.
        client.terminate()
        message = self.wait_quality(lambda m: m["utc_half_width_ns"] < 0, "no claim")
        self.assertEqual((message["utc_source"], message["utc_grade"]), (0, 0))
        self.assertGreaterEqual(message["half_width_ns"], 0, "the time base needs no chronyd")

    def test_a_chronyd_without_a_server_claims_nothing(self):
        self.chronyd("client", "# no server")
        self.run_time()
        self.messages = self.watch(self.config)
        message = self.wait_quality(lambda m: m["utc_source"] == CHRONY, "an answer of chronyd")
        self.assertEqual((message["utc_half_width_ns"], message["utc_grade"]), (-1, 0))
        doctor = json.loads(self.axlecast("doctor", self.config, "--only", "clock_sync", "--json")[1])
        self.assertIn("chronyd runs, but follows no server", doctor["findings"][0]["found"])

    def test_unix_clocks_that_differ_are_a_fault_with_the_figure(self):
        self.run_time()
        self.run_time("cell2", env={"LD_PRELOAD": faketime(), "FAKETIME": "+3.0s", "FAKETIME_DONT_FAKE_MONOTONIC": "1",
                                    "DONT_FAKE_MONOTONIC": "1"})

        def faults():
            return [fault for fault in json.loads(self.axlecast("status", self.config, "--json")[1])["faults"] if fault.startswith("UNIX time: ")]
        found = wait_for(faults, lambda: self.log("time-cell2"))
        self.assertRegex(found[0], r"^UNIX time: the clock of cell2 is (2\.9|3\.0)\d+ s \+-0\.\d+ s ahead of that of plc1: permits of earlier")


def faketime():
    listing = subprocess.run(("dpkg", "-L", "libfaketime"), capture_output=True, text=True, check=True).stdout
    return next(line for line in listing.splitlines() if line.endswith("/libfaketime.so.1"))


if __name__ == "__main__":
    unittest.main()
