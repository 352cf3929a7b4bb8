"""Figures, not verdicts: CAN frames decoded and published against candump on the same load, and where a driver on spidev
spends its time. Everything here is emulated: only what stands side by side means something. bench/run --only guest."""

import json
import os
import pathlib
import subprocess
import time

import can_bus
from can_bus import Candump, cangen
from can_machine import TURRET, CanMachine
from machine import BIN, Machine, wait_for
from spi_bus import machine_file, stand_as

TICK = os.sysconf("SC_CLK_TCK")
SECONDS = 10


def cpu_seconds(pid):
    """User and system time of a process."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return int(fields[11]) / TICK, int(fields[12]) / TICK


def report(**figures):
    print("figures: " + json.dumps(figures))


class Can(CanMachine):
    FRAMES = 20000

    def test_frames_decoded_and_published_beside_candump(self):
        """On vcan, which carries what two processes can exchange: the emulated controllers end at some 1000 a second."""
        self.assertEqual(subprocess.run(["ip", "link", "add", "vcan0", "type", "vcan"], check=False).returncode, 0)
        self.addCleanup(subprocess.run, ["ip", "link", "del", "vcan0"], check=False)
        self.assertEqual(can_bus.ip_link("vcan0 up"), "")
        self.up("vcan0", bitrate=1000000, device=TURRET % ", period_ms: 1, start: false, publish_hz: 1000", online=False)
        wait_for(lambda: (self.data.last("BUS/can-0") or {}).get("state") == 1, "an open bus")
        dump = Candump("vcan0", test=self)
        before = {"driver": cpu_seconds(self.process.pid), "candump": cpu_seconds(dump.process.pid)}
        cangen("vcan0", "-I", "120", "-L", 8, "-D", "4726000000000000", "-g", 0, "-p", 1000, "-n", self.FRAMES).wait()
        # Each of them reads what its socket had room for; the driver's counts are published once a second.
        wait_for(lambda: self.told_twice(), lambda: f"an end; candump {len(dump.lines('120'))}, driver {self.frames()}")
        spent = {"driver": sum(cpu_seconds(self.process.pid)) - sum(before["driver"]),
                 "candump": sum(cpu_seconds(dump.process.pid)) - sum(before["candump"])}
        lines = dump.lines("120")
        report(what="can", frames=self.FRAMES, frames_per_second=round(self.FRAMES / (lines[-1].time - lines[0].time)),
               driver_cpu_us_per_frame=round(spent["driver"] / self.FRAMES * 1e6, 1),
               candump_cpu_us_per_frame=round(spent["candump"] / self.FRAMES * 1e6, 1),
               ratio=round(spent["driver"] / max(spent["candump"], 1 / TICK), 2),
               driver_lost=self.FRAMES - self.frames(), candump_lost=self.FRAMES - len(lines))

    def frames(self):
        return self.data.last("BUS/can-0")["exchanges"]

    def told_twice(self):
        told = [message["exchanges"] for message in self.data.of("BUS/can-0")]
        return len(told) > 2 and told[-1] > 0 and told[-1] == told[-2] == told[-3]


class Spi(Machine):
    FAMILIES = {"ssi": "{gate: {model: twk, bits: 13, turn_bits: 12}}", "biss": "{gate: {model: saa58p24, bits: 16}}"}

    def test_share_of_the_time_in_ioctl(self):
        for family, devices in self.FAMILIES.items():
            bus = f"{family}-0"
            nodes = self.write(machine_file(bus, family, devices, simulate="true"), f"{bus}-nodes.yaml")
            config = self.write(machine_file(bus, family, devices, link="{spidev: /dev/spidev0.0}", keys="poll_hz: 0"),
                                f"{bus}.yaml")
            self.start(f"simulator-{bus}", BIN / "axlecast", "simulate", nodes, "--bus", bus)
            place = self.run_dir / f"test/{bus}.spi"
            wait_for(place.exists, f"{place}")
            bridge = stand_as(self, "spidev0.0", place)
            watch = self.watch(config)
            driver = self.driver(config, bus, family)
            self.wait_online(watch, "gate")
            begin, cpu = time.monotonic(), cpu_seconds(driver.pid)
            mark = watch.mark()
            wait_for(lambda: len(watch.of(f"BUS/{bus}", mark)) > SECONDS, f"{SECONDS} messages of BUS")
            wall = time.monotonic() - begin
            user, system = (after - before for after, before in zip(cpu_seconds(driver.pid), cpu))
            messages = watch.of(f"BUS/{bus}", mark)[1:]
            in_ioctl = sum(m["rate_hz"] * m["exchange_us"][1] * 1e-6 for m in messages) / len(messages)
            report(what=family, readings_per_second=round(sum(m["rate_hz"] for m in messages) / len(messages)),
                   exchange_p50_us=round(messages[-1]["exchange_us"][1]), share_of_time_in_ioctl=round(in_ioctl, 3),
                   cpu_user=round(user / wall, 3), cpu_system=round(system / wall, 3))
            watch.close()
            for process in (driver, bridge):
                process.terminate()
                process.wait()
