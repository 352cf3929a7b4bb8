"""The whole demo machine in the guest, and beside it a CAN bus and two SPI buses on kernel interfaces."""

import json
import os
import pathlib
import re

import can_bus
from machine import BIN, Machine, wait_for
from spi_bus import stand_as

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
ONLINE, VALID, SIMULATED = 1, 0x1, 0x2000

# {place}: for the drivers the interface, for the simulators opposite what they simulate.
BUSES = """
  can-vm:
    family: saa_can
    {can}
    devices:
      turret: {{bits: 14, node: 0x20, unit: deg}}
  ssi-vm:
    family: ssi
    {ssi}
    poll_hz: 10
    devices:
      gate: {{model: twk, bits: 13, turn_bits: 12, unit: deg}}
  biss-vm:
    family: biss
    {biss}
    poll_hz: 10
    devices:
      spindle: {{model: saa, bits: 16, unit: deg}}
"""


def slow(text):
    """The file at rates that an emulated machine can do."""
    text = re.sub(r"poll_hz: \d+", "poll_hz: 10", text)
    text = re.sub(r"publish_hz: \d+", "publish_hz: 10", text)
    return re.sub(r"timeout_us: \d+", "timeout_us: 1000000", text)


class Demo(Machine):
    def test_every_device_is_online_and_read(self):
        demo = slow((SOURCE / "config/demo.yaml").read_text())
        config = self.write(demo + BUSES.format(can="link: {iface: can0, bitrate: 250000}",
                                                ssi="link: {spidev: /dev/spidev0.0}",
                                                biss="link: {spidev: /dev/spidev0.1}"))
        nodes = self.write("machine: demo\nbuses:" + BUSES.format(
            can="simulate: {turret: {start_deg: 215.32}}", ssi="simulate: {gate: {start_deg: 90.01, start_turns: 17}}",
            biss="simulate: {spindle: {start_deg: 195.312}}"), "nodes.yaml")
        for interface in ("can0", "can1"):
            can_bus.up(interface)
            self.addCleanup(can_bus.down, interface)
        self.start("can-vm", BIN / "axlecast", "simulate", nodes, "--bus", "can-vm", "--on", "can1")
        self.start("spi-vm", BIN / "axlecast", "simulate", nodes, "--bus", "ssi-vm", "--bus", "biss-vm")
        for name, bus in (("spidev0.0", "ssi-vm"), ("spidev0.1", "biss-vm")):
            place = self.run_dir / f"demo/{bus}.spi"
            wait_for(place.exists, lambda: f"{place}; {self.log('spi-vm')}")
            stand_as(self, name, place)

        watch = self.watch(config)
        self.start("up", BIN / "axlecast", "up", config, "--no-table")
        code, out, err = self.axlecast("check-config", config, "--json")
        self.assertEqual(code, 0, err)
        devices = [device["device"] for bus in json.loads(out)["buses"] for device in bus["devices"]]
        self.assertGreaterEqual(len(devices), 12)

        # Once: the demo lets things happen to axis4 and to the conveyor.
        def never_online():
            return [name for name in devices if not any(m["state"] == ONLINE for m in watch.of(f"DEVICE/{name}"))]
        wait_for(lambda: not never_online(),
                 lambda: f"{[watch.last(f'DEVICE/{name}') or name for name in never_online()]}; "
                         f"{self.log('up')[-3000:]}")
        for device, counts, turns in (("turret", 9799, 0), ("gate", 2048, 17), ("spindle", 35555, 0)):
            position = wait_for(lambda: watch.last(f"POSITION/{device}"), f"a position of {device}")
            self.assertEqual((position["raw_counts"], position["raw_turns"], position["flags"] & (VALID | SIMULATED)),
                             (counts, turns, VALID), position)
