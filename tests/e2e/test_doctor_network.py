"""`axlecast doctor`: what comes between the processes of a machine and LCM. Each test creates its condition in a network
of its own."""

import subprocess
import unittest

from doctor_machine import DoctorMachine
from machine import wait_for


def run(*words):
    subprocess.run(words, check=True)


class Network(DoctorMachine):
    def setUp(self):
        super().setUp()
        self.config = self.machine()
        self.far = self.machine(rest='lcm: {url: "udpm://239.255.76.67:7667?ttl=1"}', name="far.yaml")

    def veth(self):
        """An interface towards other hosts."""
        run("ip", "link", "add", "eth7", "type", "veth", "peer", "name", "eth8")
        run("ip", "addr", "add", "10.9.8.1/24", "dev", "eth7")
        run("ip", "link", "set", "eth7", "up")
        run("ip", "link", "set", "eth8", "up")

    def nft(self, *commands):
        run("nft", "add table inet plant")
        for command in commands:
            run("nft", command)

    def test_multicast_route(self):
        self.assert_quiet("multicast_route", self.config)
        run("ip", "route", "del", "224.0.0.0/4", "dev", "lo")
        finding = self.assert_found("multicast_route", self.config, "239.255.76.67")
        self.assertEqual(finding["severity"], "error")
        self.assert_mended("multicast_route", self.config)
        self.assert_quiet("multicast_silent", self.config)

    def test_multicast_route_towards_other_hosts_is_the_operators_choice(self):
        run("ip", "route", "del", "224.0.0.0/4", "dev", "lo")
        finding = self.assert_found("multicast_route", self.far, "239.255.76.67")
        self.assertFalse(finding["safe"])
        self.assertIn("dev INTERFACE", finding["mend"][0])

    def test_loopback_multicast(self):
        self.assert_quiet("loopback_multicast", self.config)
        run("ip", "link", "set", "lo", "multicast", "off")
        self.assert_found("loopback_multicast", self.config, "no MULTICAST flag")
        self.assert_mended("loopback_multicast", self.config)

    def test_loopback_multicast_of_an_interface_that_is_down(self):
        run("ip", "link", "set", "lo", "down")
        self.assert_found("loopback_multicast", self.config, "is down")
        self.assert_mended("loopback_multicast", self.config)
        self.assert_mended("multicast_route", self.config)

    def test_lcm_library(self):
        (self.root / "usr/lib/x86_64-linux-gnu").mkdir(parents=True)
        self.assert_quiet("lcm_library", self.config, "--root", self.root)
        for name in ("liblcm.so.1", "liblcm.so.1.3.4", "liblcms2.so.2.0.14"):
            self.put(f"usr/lib/x86_64-linux-gnu/{name}", "")
        finding = self.assert_found("lcm_library", self.config, "liblcm.so.1.3.4: one forged datagram", "--root", self.root)
        self.assertEqual(finding["severity"], "advice")
        self.assertIn("iifname != lo udp dport 7668 drop", finding["mend"][1])

    def test_multicast_interface(self):
        self.assert_quiet("multicast_interface", self.config)
        self.veth()
        run("ip", "route", "replace", "224.0.0.0/4", "dev", "eth7")
        self.assert_found("multicast_interface", self.config, "uses eth7")
        self.assert_mended("multicast_interface", self.config)
        self.assert_found("multicast_interface", self.far, "uses lo")

    def test_lcm_interface(self):
        config = self.machine(rest='lcm: {interface: eth7, url: "udpm://239.255.76.67:7667?ttl=1"}', name="chosen.yaml")
        self.assert_found("lcm_interface", config, "this host has no interface eth7")
        self.assert_quiet("lcm_interface", self.config)
        self.veth()
        wait_for(lambda: not self.found("lcm_interface", config), "a carrier")
        self.assert_quiet("multicast_route", config)
        run("ip", "link", "set", "eth8", "down")
        self.assert_found("lcm_interface", config, "the interface eth7 has no carrier")
        run("ip", "link", "set", "eth7", "down")
        finding = self.assert_found("lcm_interface", config, "the interface eth7 is down")
        self.assertFalse(finding["safe"])
        run("sh", "-c", finding["mend"][0])
        run("ip", "link", "set", "eth8", "up")
        wait_for(lambda: not self.found("lcm_interface", config), "a carrier")

    def test_interface_choice(self):
        run("ip", "link", "add", "eth5", "type", "veth", "peer", "name", "eth6")
        self.veth()
        run("ip", "route", "replace", "224.0.0.0/4", "dev", "eth7")
        other = str(self.other_network())  # so that only eth7 of this host is up
        run("ip", "link", "set", "eth8", "netns", other)
        run("nsenter", "--target", other, "--net", "ip", "link", "set", "eth8", "up")
        self.assert_quiet("interface_choice", self.far)
        for name in ("eth5", "eth6"):
            run("ip", "link", "set", name, "up")
        wait_for(lambda: self.found("interface_choice", self.far), "a carrier")
        finding = self.assert_found("interface_choice", self.far, "several interfaces are up (eth5, eth6, eth7)")
        self.assertEqual(finding["mend"], ["lcm: {interface: eth7}    # in the machine file"])
        self.assert_quiet("interface_choice", self.config)
        chosen = self.machine(rest='lcm: {interface: eth7, url: "udpm://239.255.76.67:7667?ttl=1"}', name="chosen.yaml")
        self.assert_quiet("interface_choice", chosen)

    def other_network(self):
        """The process id of a network of its own."""
        holder = subprocess.Popen(("unshare", "--net", "sh", "-c", "echo; exec sleep infinity"), stdout=subprocess.PIPE)
        self.addCleanup(holder.stdout.close)
        self.addCleanup(holder.wait)
        self.addCleanup(holder.kill)
        holder.stdout.readline()
        return holder.pid

    def test_multicast_silent(self):
        self.assert_quiet("multicast_silent", self.config)
        self.nft("add chain inet plant out { type filter hook output priority 0; }",
                 "add rule inet plant out udp dport 7668 drop")
        finding = self.assert_found("multicast_silent", self.config, ":7668")
        self.assertIn("7668", finding["mend"][0])

    def test_firewall(self):
        self.nft("add chain inet plant input { type filter hook input priority 0; policy drop; }",
                 "add rule inet plant input ct state established,related accept",
                 "add rule inet plant input tcp dport 22 accept", "add rule inet plant input iif lo accept")
        self.assert_quiet("firewall", self.config)  # the datagram to this host itself came back
        self.veth()
        run("ip", "route", "replace", "224.0.0.0/4", "dev", "eth7")
        finding = self.assert_found("firewall", self.far, "chain input of the table inet plant")
        self.assertFalse(finding["safe"])
        for line in finding["mend"]:  # each names a port in a rule, which ends the advice
            run("sh", "-c", line)
        self.assert_quiet("firewall", self.far)

    def test_receive_buffer_max(self):
        self.put("proc/sys/net/core/rmem_max", 212992)
        config = self.machine(rest='lcm: {url: "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152"}')
        self.assert_found("receive_buffer_max", config, "212992", "--root", self.root)
        self.assert_mended("receive_buffer_max", config, "--root", self.root)
        self.assertEqual(self.text("proc/sys/net/core/rmem_max"), "2097152\n")
        self.assertEqual(self.text("etc/sysctl.d/60-axlecast.conf"), "net.core.rmem_max = 2097152\n")
        recorded = self.machine(rest="recorder: {logs: {all: {quota: 20MB}}}")
        self.assert_found("receive_buffer_max", recorded, "33554432", "--root", self.root)
        self.assert_quiet("receive_buffer_max", self.machine(), "--root", self.root)

    def test_receive_buffer_default(self):
        self.put("proc/sys/net/core/rmem_default", 212992)
        self.assert_quiet("receive_buffer_default", self.config, "--root", self.root)
        fast = self.machine(bus="poll_hz: 2000", device="{model: ts5669n127, unit: deg, publish_hz: 2000}")
        self.assert_found("receive_buffer_default", fast, "2000 messages per second", "--root", self.root)
        self.assert_mended("receive_buffer_default", fast, "--root", self.root)
        self.assertEqual(self.text("etc/sysctl.d/60-axlecast.conf"), "net.core.rmem_default = 2097152\n")

    def other_driver(self, bus, name, machine):
        """A driver beside that of the machine: in a run directory of its own, as on another host."""
        text = self.config.read_text().replace("rs485-0", bus).replace("axis1", "axis-" + name)
        folder = self.folder / name
        folder.mkdir()
        self.driver(self.write(text.replace("machine: test", f"machine: {machine}"), f"{name}.yaml"), bus, name=name,
                    env={"AXLECAST_RUN_DIR": str(folder)})

    def test_other_machine(self):
        self.assert_quiet("other_machine", self.config)
        self.driver(self.config, "rs485-0")
        for bus in ("rs485-0", "rs485-9"):  # a bus of the same name, and another one
            with self.subTest(bus):
                self.other_driver(bus, f"beside-{bus}", "press4")
                finding = wait_for(lambda: self.found("other_machine", self.config), "a driver of another machine")[0]
                self.assertIn("machine 'press4' sends on the channels of machine 'test'", finding["found"])
                self.assertIn('lcm: {prefix: "press4/"}', " ".join(finding["mend"]))
                self.assert_quiet("duplicate_driver", self.config)

    def test_duplicate_driver(self):
        self.driver(self.config, "rs485-0")
        self.assert_quiet("duplicate_driver", self.config)
        self.other_driver("rs485-0", "second", "test")
        finding = wait_for(lambda: self.found("duplicate_driver", self.config), "two drivers of one bus")[0]
        self.assertIn("2 drivers of bus rs485-0", finding["found"])

    def test_machine_faults(self):
        """What `status` calls not good, `doctor` does, too; a machine that does not run is no fault of the host."""
        only = ("--only", "machine_faults")
        self.config = self.machine(device="{model: ts5669n127, unit: deg, publish_hz: 100, timeout_us: 500000}")  # a busy host
        self.assertEqual(self.axlecast("status", self.config)[0], 6)
        code, found = self.doctor(self.config, *only)
        self.assertTrue(found.pop("clock"))
        self.assertEqual((code, found), (0, {"file": str(self.config), "ok": True, "findings": [], "mended": [],
                                             "interfaces": {f"udpm://239.255.76.67:{port}?ttl=0": "lo" for port in (7667, 7668)}}))
        driver = self.driver(self.config, "rs485-0")
        code, text, _ = self.axlecast("status", self.config)
        self.assertEqual(code, 1, text)
        findings = wait_for(lambda: self.found("machine_faults", self.config), "no simulator: the bus is not UP")
        for part in ("axis1: ", "rs485-0: "):
            self.assertTrue(any(part in finding["found"] for finding in findings), findings)
        self.assertEqual(self.doctor(self.config, *only, "--listen", "0")[0], 0, "it was told not to listen")
        self.simulator(self.config, "rs485-0")
        wait_for(lambda: self.axlecast("status", self.config)[0] == 0, "a machine that is good")
        wait_for(lambda: not self.found("machine_faults", self.config), "a doctor that finds the same")
        driver.kill()
        driver.wait(30)
        self.assert_quiet("machine_faults", self.config)


if __name__ == "__main__":
    unittest.main()
