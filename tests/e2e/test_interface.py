"""`lcm: {interface}`: one machine on two hosts that two links connect. All messages use the chosen link, and every process continues after
the interface was missing, deleted or down. The other link is the one of the route."""

import json
import subprocess
import time
import unittest

from machine import BIN, Machine, wait_for
from two_hosts import LinkedHosts, ip

CONFIG = """machine: test
bridge: {unsigned_commands: allow}
lcm: {interface: INTERFACE, url: "udpm://GROUP:7667?ttl=1", command_url: "udpm://GROUP:7668?ttl=1"}
recorder: {logs: {all: {quota: 20MB}}}
hosts:
  plc1: {bridge: true, recorder: true, buses: [line]}
  cell2: {buses: [lift]}
buses:
  line: {family: tformat, simulate: true, poll_hz: 100,
         devices: {axis1: {model: ts5669n127, permit: not_required, timeout_us: 500000}}}
  lift: {family: tformat, simulate: true, poll_hz: 100,
         devices: {axis2: {model: ts5669n127, permit: not_required, timeout_us: 500000}}}
"""
HOSTS = ("plc1", "cell2")
MISSING = "this host has no interface eth1"


class Interface(LinkedHosts, Machine):
    def configure(self, group="239.255.76.67", interface="eth1"):
        self.config = self.write(CONFIG.replace("GROUP", group).replace("INTERFACE", interface))

    def link(self, number):
        super().link(number)
        if number == 2:  # the route of the group leads to the wrong link
            ip("route", "replace", "224.0.0.0/4", "dev", "eth2")
            self.other.ip("route", "add", "224.0.0.0/4", "dev", "eth2")

    def words(self, host, *words):
        return words if host == "plc1" else self.other.words(*words)

    def up(self, host):
        return self.start(f"up-{host}", *self.words(host, BIN / "axlecast", "up", self.config, "--host", host, "--no-table"),
                          env={"AXLECAST_RUN_DIR": str(self.folder / host), "XDG_STATE_HOME": str(self.folder / host / "state")})

    def status(self, host):
        words = self.words(host, BIN / "axlecast", "status", self.config, "--json")
        return json.loads(subprocess.run([str(word) for word in words], capture_output=True, text=True).stdout)

    def wait_good(self):
        for host in HOSTS:
            wait_for(lambda: self.status(host)["good"], lambda: [host, self.status(host)["faults"], *(self.log(f"up-{each}") for each in HOSTS)])

    def logs(self, host):
        """The logs of the processes that a host runs."""
        return {path.stem: path.read_text(errors="replace") for path in (self.folder / host / "test/log").glob("*.log")}

    def processes_of(self):
        """The process ids of everything that `up` has started."""
        listing = subprocess.run(("ps", "-eo", "pid=,args="), capture_output=True, text=True, check=True).stdout
        return {line.split()[0] for line in listing.splitlines()
                if str(self.config) in line and any(word in line for word in ("axlecast-tformat", "axlecast-bridge", " record ", " up "))}

    def wait_reported(self, text):
        """Waits until each kind of process has a line with the text in its own log."""
        def silent():
            logs = self.logs("plc1")
            return [name for name in ("bridge", "recorder", "driver") if not any(name in stem and text in log for stem, log in logs.items())]
        wait_for(lambda: not silent(), lambda: [silent(), self.logs("plc1")])

    def command_to_the_other_host(self):
        _, outcome = self.outcome("zero", "axis2", "--yes", "--reason", "test")
        self.assertEqual(outcome["outcome"], "succeeded", outcome)

    def run_both(self):
        for host in HOSTS:
            self.up(host)
        self.wait_good()

    def carries_only_the_chosen_link(self):
        self.link(1)
        self.link(2)
        right, wrong = self.capture("eth1"), self.capture("eth2")
        self.run_both()
        self.command_to_the_other_host()
        self.assertGreater(right.count(), 100)
        self.assertEqual(wrong.count(), 0, "messages leave by the route of the group")

    def test_one_link_carries_all_messages_and_the_other_none(self):
        self.configure()
        self.carries_only_the_chosen_link()

    def test_the_network_of_an_address_selects_it_on_both_hosts(self):
        self.configure(interface="10.1.0.0/24")
        self.carries_only_the_chosen_link()

    def test_an_ipv6_group(self):
        self.configure(group="[ff15::4c43]")
        self.carries_only_the_chosen_link()
        self.assertIn("lcm-spy receives IPv4 groups only", self.axlecast("spy", self.config)[2])

    def returns(self, group):
        """Missing at the start, made, deleted and made again, down and up: the same processes report it and continue."""
        self.configure(group)
        self.link(2)
        wrong = self.capture("eth2")
        for host in HOSTS:
            self.up(host)
        wait_for(lambda: any(fault == "LCM: " + MISSING + ": LCM sends and receives nothing until there is one "
                             "(`ip -brief link` lists the interfaces)" for fault in self.status("plc1")["faults"]),
                 lambda: self.status("plc1")["faults"])
        self.wait_reported(MISSING)
        self.link(1)
        self.wait_good()
        before = self.processes_of()
        for _ in range(2):
            ip("link", "del", "eth1")
            wait_for(lambda: self.status("cell2")["reception"]["network"].startswith(MISSING), lambda: self.status("cell2"))
            self.link(1)
            self.wait_good()
        ip("link", "set", "eth1", "down")
        wait_for(lambda: any("the interface eth1 is down" in fault for fault in self.status("plc1")["faults"]),
                 lambda: self.status("plc1")["faults"])
        wait_for(lambda: any("the interface eth1 has no carrier" in fault for fault in self.status("cell2")["faults"]),
                 lambda: self.status("cell2")["faults"])
        ip("link", "set", "eth1", "up")
        self.wait_good()
        self.wait_reported("the network can be used again")
        self.command_to_the_other_host()
        self.assertEqual(self.processes_of(), before, "a process was started again")
        self.assertEqual(wrong.count(), 0, "messages left by the other link while eth1 was missing")

    def test_it_may_be_missing_deleted_and_down(self):
        self.returns("239.255.76.67")

    def test_it_may_be_missing_deleted_and_down_with_ipv6(self):
        self.returns("[ff15::4c43]")

    def test_readings_return_within_two_seconds(self):
        self.configure()
        self.link(1)
        self.run_both()
        received = []
        for _ in range(3):
            ip("link", "del", "eth1")
            wait_for(lambda: self.status("plc1")["reception"]["network"].startswith(MISSING), lambda: self.status("plc1"))
            watch = subprocess.Popen([BIN / "axlecast", "watch", self.config, "--channel", "POSITION/axis2", "--count", "1", "--json"],
                                     stdout=subprocess.PIPE, text=True)
            self.addCleanup(watch.stdout.close)
            self.link(1)
            made = time.monotonic()
            self.assertTrue(watch.stdout.readline())
            received.append(time.monotonic() - made)
            watch.wait()
        self.assertLess(min(received), 2, f"s after the link was made: {received}")

    def test_doctor_names_it(self):
        self.configure()
        only = ("--only", "lcm_interface,interface_choice,multicast_route,multicast_silent,multicast_interface", "--host", "plc1", "--json")

        def doctor():
            code, out, err = self.axlecast("doctor", self.config, *only)
            self.assertTrue(out, err)
            return code, json.loads(out)
        self.link(2)
        code, found = doctor()
        self.assertEqual((code, [each["name"] for each in found["findings"]]), (1, ["lcm_interface"]), found)
        self.assertIn(MISSING, found["findings"][0]["found"])
        self.link(1)
        ip("link", "set", "eth1", "down")
        code, found = doctor()
        self.assertEqual(found["findings"][0]["mend"], ["ip link set eth1 up"], found)
        ip("link", "set", "eth1", "up")
        code, found = wait_for(lambda: not doctor()[0] and doctor(), "a carrier")
        self.assertEqual((code, found["findings"]), (0, []), found)
        self.assertEqual(set(found["interfaces"].values()), {"eth1"})
        self.config.write_text(self.config.read_text().replace("interface: eth1, ", ""))
        code, found = doctor()
        self.assertEqual((code, [each["name"] for each in found["findings"]]), (1, ["interface_choice"]), found)
        self.assertIn("several interfaces are up (eth1, eth2)", found["findings"][0]["found"])
        self.assertEqual(set(found["interfaces"].values()), {"eth2"})


if __name__ == "__main__":
    unittest.main()
