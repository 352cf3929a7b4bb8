"""One machine on two hosts: here two run directories in one network, each with its part of the machine."""

import json
import unittest

from machine import BIN, Machine, wait_for

CONFIG = """machine: test
bridge: {unsigned_commands: allow}
lcm: {url: "udpm://239.255.76.67:7667?ttl=1", command_url: "udpm://239.255.76.67:7668?ttl=1"}
hosts:
  plc1: {bridge: true, buses: [line]}
  cell2: {buses: [lift]}
buses:
  line: {family: tformat, simulate: true, poll_hz: 100,
         devices: {axis1: {model: ts5669n127, permit: not_required, timeout_us: 500000}}}
  lift: {family: tformat, simulate: true, poll_hz: 100,
         devices: {axis2: {model: ts5669n127, permit: not_required, timeout_us: 500000}}}
"""
HOSTS = ("plc1", "cell2")


class TwoHosts(Machine):
    def setUp(self):
        super().setUp()
        self.config = self.write(CONFIG)

    def up(self, host):
        return self.start(f"up-{host}", BIN / "axlecast", "up", self.config, "--host", host, "--no-table",
                          env={"AXLECAST_RUN_DIR": str(self.folder / host)})

    def status(self):
        return json.loads(self.axlecast("status", self.config, "--json")[1])

    def wait_good(self):
        wait_for(lambda: self.status()["good"], lambda: [self.status()["faults"], *(self.log(f"up-{host}") for host in HOSTS)])

    def test_each_runs_its_part_and_all_together_are_the_machine(self):
        running = {host: self.up(host) for host in HOSTS}
        self.wait_good()
        for host, bus in (("plc1", "line"), ("cell2", "lift")):
            logs = {path.stem for path in (self.folder / host / "test/log").glob("*.log")}
            self.assertEqual({name for name in logs if "driver" in name}, {name for name in logs if f"driver-{bus}" in name or f"driver {bus}" in name})
            self.assertEqual(any("bridge" in name for name in logs), host == "plc1", logs)
        # A command to a device of the other host.
        _, outcome = self.outcome("zero", "axis2", "--yes", "--reason", "test")
        self.assertEqual(outcome["outcome"], "succeeded", outcome)
        running["cell2"].terminate()
        running["cell2"].wait()
        wait_for(lambda: any(fault.startswith("host cell2: nothing arrives from its buses (lift)") for fault in self.status()["faults"]),
                 lambda: self.status()["faults"])

    def test_units_and_refusals_are_those_of_the_host(self):
        listed = {host: self.axlecast("check-config", self.config, "--list", "units", "--host", host)[1].split() for host in HOSTS}
        self.assertEqual(listed["plc1"], ["axlecast-bridge.service", "axlecast-simulate.service", "axlecast-driver@line.service"])
        self.assertEqual(listed["cell2"], ["axlecast-simulate.service", "axlecast-driver@lift.service"])
        for command in (("up",), ("doctor", "--only", "multicast_route"), ("check-config", "--list", "units")):
            code, _, err = self.axlecast(command[0], self.config, *command[1:], "--host", "desk")
            self.assertEqual(code, 1, err)
            self.assertIn("'desk', is not under `hosts`", err)


if __name__ == "__main__":
    unittest.main()
