"""A driver of SAA encoders on a CAN interface of the guest, and their simulator on another."""

import os
import re
import subprocess

import can_bus
from machine import BIN, Machine, wait_for

VALID = 0x1
ONLINE, DEGRADED, OFFLINE = 1, 2, 3
UP, DOWN = 1, 3  # bus_health_t
# s, from a cause to its report. That it takes less than a second is judged where nothing else runs: tools/campaign vm.
WITHIN = float(os.environ.get("AXLECAST_VM_WITHIN", 20))
TURRET = "turret: {bits: 14, node: 0x20, unit: deg, permit: not_required%s}"


def can_file(place, devices, keys=""):
    return f"""machine: test
bridge: {{unsigned_commands: allow}}
buses:
  can-0:
    family: saa_can
    {place}
    {keys}
    devices: {{{devices}}}
"""


class CanMachine(Machine):
    def setUp(self):
        super().setUp()
        for interface in ("can0", "can1"):
            can_bus.up(interface)
            self.addCleanup(can_bus.down, interface)

    # -- processes

    def encoder(self, device=TURRET % "", simulate="{turret: {start_deg: 215.32}}", bitrate=250000):
        """The simulator of the device, on can1."""
        place = f"simulate: {simulate}\n    link: {{bitrate: {bitrate}}}"
        self.nodes = self.write(can_file(place, device), "nodes.yaml")
        process = self.start("simulator", BIN / "axlecast", "simulate", self.nodes, "--bus", "can-0", "--on", "can1")
        wait_for(lambda: "simulating bus can-0" in self.log("simulator") or process.poll() is not None, "a simulator")
        self.assertIsNone(process.poll(), self.log("simulator"))
        return process

    def up(self, interface="can0", bitrate=250000, device=TURRET % "", keys="", online=True):
        """The driver, and a watch on all that it sends."""
        self.config = self.write(can_file(f"link: {{iface: {interface}, bitrate: {bitrate}}}", device, keys))
        self.data = self.watch(self.config)
        self.process = self.driver(self.config, "can-0", "saa-can")
        if online:
            self.wait_device(ONLINE)

    # -- what the driver publishes

    def wait_device(self, state):
        return wait_for(lambda: (lambda m: m if m and m["state"] == state else None)(self.data.last("DEVICE/turret")),
                        lambda: f"turret in state {state}; last {self.data.last('DEVICE/turret')}, "
                                f"{self.data.last('BUS/can-0')}; {self.log('driver-can-0')[-2000:]}")

    def positions(self, since=0):
        return [p for p in self.data.of("POSITION/turret", since) if p["flags"] & VALID]

    def wait_position(self, counts):
        return wait_for(lambda: next((p for p in reversed(self.positions()) if p["raw_counts"] == counts), None),
                        lambda: f"{counts} counts, last {self.data.last('POSITION/turret')}; "
                                f"{self.log('driver-can-0')[-2000:]}")

    def wait_more_positions(self):
        mark = self.data.mark()
        wait_for(lambda: self.positions(mark), lambda: f"a position; {self.data.last('DEVICE/turret')}")

    def reported(self, began_ns, text, within=WITHIN):
        """The first BUS/can-0 that has `text` after a time (time.time_ns)."""
        def found():
            return next((m for m in self.data.of("BUS/can-0") if re.search(text, m["last_error"])), None)
        message = wait_for(found, lambda: f"'{text}' in BUS/can-0, last {self.data.last('BUS/can-0')}")
        self.in_time("BUS", message, began_ns, within)
        return message

    def in_time(self, channel, message, began_ns, within=WITHIN):
        took = message["utime"] / 1e6 - began_ns / 1e9
        print(f"{channel} after {took:.2f} s: {self.id()}")
        self.assertLessEqual(took, within, message)

    def alarmed(self, began_ns, name):
        """ALARM/turret names it, first in time after that: its entry."""
        def found():
            return next(((m, entry) for m in self.data.of("ALARM/turret")
                         for entry in m["entries"] if entry["name"] == name), None)
        message, entry = wait_for(found, lambda: f"alarm {name}, last {self.data.last('ALARM/turret')}")
        self.in_time("ALARM", message, began_ns)
        return entry

    def type_what_it_says(self, text):
        """The text after "as root: ", typed by the operator."""
        line = text.split("as root: ")[1]
        done = subprocess.run(["sh", "-ec", line], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, f"{line}: {done.stderr}")
        return line

    def assert_recovered(self, boot_id):
        """Online, with positions, by the same process."""
        self.wait_device(ONLINE)
        self.wait_more_positions()
        self.assertEqual(self.data.last("DEVICE/turret")["boot_id"], boot_id)

    def boot_id(self):
        return self.data.last("DEVICE/turret")["boot_id"]
