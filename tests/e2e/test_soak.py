"""The demo machine, to which things happen: processes are killed and frozen, disks are full, UNIX time is stepped, the interface goes
down, cables are pulled. After each episode everything must work again, and nothing may grow.

AXLECAST_SOAK sets the seconds, AXLECAST_SEED the faults, AXLECAST_SOAK_REPORT a folder for the figures and their picture
(tools/campaign soak)."""

import csv
import heapq
import json
import math
import os
import pathlib
import random
import re
import subprocess
import time
import unittest

from machine import BIN, LIMIT, Machine, wait_for
from soak_faults import Faults, FullDisk, Network
from soak_parts import Consumer, Part

SECONDS = float(os.environ.get("AXLECAST_SOAK", "12"))
SEED = int(os.environ.get("AXLECAST_SEED", "1"))
REPORT = os.environ.get("AXLECAST_SOAK_REPORT")
POLL_HZ = os.environ.get("AXLECAST_SOAK_HZ", "250")  # of the four fastest buses
SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
FRESH = 3.0  # s: a device that works has published in this time
CALM = 4.0  # s between two episodes in which nothing is lost
RECOVERY = 60 + LIMIT  # s
HISTORY = 900.0  # s after which the web page's 30,000 rows of samples of each device are there
FAMILIES = {"rs485": "tformat", "saa": "saa-serial", "modbus": "saa-modbus", "can": "saa-can", "ssi": "ssi", "biss": "biss", "motors": "tsubaki-sc"}


class Soak(Machine):
    def setUp(self):
        super().setUp()
        text = (SOURCE / "config/demo.yaml").read_text().replace("poll_hz: 1000", f"poll_hz: {POLL_HZ}")
        # The power of axis4 is switched by its script; the script of a motor stops nothing.
        text = re.sub(r"          script:\n(            - .*\n)+          script_period_s: 120\n", "", text)
        self.config = self.write(text)
        self.buses = re.findall(r"^  ([a-z0-9-]+):\n    family:", text, re.MULTILINE)
        self.buses_with_adapter = [bus for bus in self.buses if not bus.startswith(("ssi", "biss"))]
        self.encoders = ["axis1", "axis2", "axis3", "joint1", "joint2", "hoist", "boom", "winch", "gantry", "turntable"]
        self.devices = self.encoders + ["axis4", "conveyor", "lift"]
        self.disks = {"logs": FullDisk(self.folder / "logs", "64m"), "journal": FullDisk(self.folder / "state/axlecast", "16m")}
        for disk in self.disks.values():
            self.addCleanup(disk.unmount)
        self.offset = 0
        self.clock = self.folder / "clock"
        self.step_clock(0)
        self.parts = {}
        self.network = Network()
        self.started_again = 0
        self.consumer = Consumer()
        self.rows = []
        self.events = []
        self.began = time.monotonic()

    def step_clock(self, seconds):
        """UNIX time of the processes that have it from the file: read again each second."""
        self.offset += seconds
        draft = self.clock.with_suffix(".new")
        draft.write_text(f"{self.offset:+d}s\n")
        draft.rename(self.clock)

    def part(self, name, *command, steps=False, **options):
        library = next(pathlib.Path("/usr/lib").glob("*/faketime/libfaketime.so.1"))
        env = {"LD_PRELOAD": str(library), "FAKETIME_TIMESTAMP_FILE": str(self.clock), "FAKETIME_DONT_FAKE_MONOTONIC": "1",
               "FAKETIME_CACHE_DURATION": "1", "FAKETIME_DISABLE_SHM": "1", "NO_FAKE_STAT": "1"} if steps else {}
        log = open(self.folder / f"{name}.log", "ab")
        self.addCleanup(log.close)
        self.parts[name] = Part(name, command, log, env, **options)
        self.parts[name].start()

    def start_machine(self):
        for bus in self.buses:
            self.part(f"simulator of {bus}", BIN / "axlecast", "simulate", self.config, "--bus", bus)
        for bus in self.buses:
            family = next(family for start, family in FAMILIES.items() if bus.startswith(start))
            self.part(f"driver of {bus}", BIN / f"axlecast-{family}", "--config", self.config, "--bus", bus, steps=bus == "rs485-0")
        self.part("bridge", BIN / "axlecast-bridge", "--config", self.config, steps=True)
        self.part("recorder", BIN / "axlecast", "record", f"{self.disks['logs'].folder}/", "--config", self.config, "--split-size", "4MB",
                  "--quota", "24MB", steps=True)
        self.part("web", BIN / "axlecast", "web", self.config, "--port", "0", settled=HISTORY)
        self.addCleanup(self.end_machine)
        self.addCleanup(self.write_report)

    def end_machine(self):
        for part in self.parts.values():
            if part.runs():
                part.kill()

    def simulate(self, *options):
        """Changes a simulator; one that is dead or frozen does not answer."""
        try:
            subprocess.run([BIN / "axlecast", "simulate", self.config, *options], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                           stdin=subprocess.DEVNULL, timeout=10, check=False)
        except subprocess.TimeoutExpired:
            pass

    # -- time passes

    def sample(self):
        valid, lost = self.consumer.counts()
        row = {"s": round(time.monotonic() - self.began, 2), "valid": valid, "lost": lost, "memory": 0, "files": 0, "threads": 0}
        for part in self.parts.values():
            if not (use := part.use()):
                continue
            part.lives[-1].uses.append(use)
            row["memory"] += use.memory
            row["files"] += use.files
            row["threads"] += use.threads
        self.rows.append(row)

    def pass_time(self, until):
        """Samples each second."""
        while (left := until - time.monotonic()) > 0:
            time.sleep(min(left, 1))
            self.sample()
            self.no_process_ended()

    def no_process_ended(self):
        """Except that a process that starts without a network ends with the cause: this test starts it again, as systemd does."""
        for part in self.parts.values():
            if part.process is None or part.process.poll() is None:
                continue
            if part.lives[-1].began > self.network.worked_until and part.process.returncode > 0:
                self.started_again += 1
                part.start()
            else:
                self.fail(f"{part.name} ended by itself with {part.process.returncode}:\n{self.log(part.name)[-3000:]}")

    def episode(self, faults):
        """Some faults that overlap."""
        plan, number = [], 0
        now = time.monotonic()
        for _ in range(faults.chance.randint(1, 3)):
            name, begin, end, lasts = faults.draw()
            at = now + faults.chance.uniform(0, 3)
            for when, act, what in ((at, begin, name), (at + lasts, end, "")):
                heapq.heappush(plan, (when, number, act, what))
                number += 1
        while plan:
            when, _, act, what = heapq.heappop(plan)
            self.pass_time(when)
            if what:
                self.events.append((round(time.monotonic() - self.began, 2), what))
            act()

    def restore(self):
        """What a simulator did not receive while it was dead or frozen."""
        for device in self.encoders:
            self.simulate("--set", f"{device}.power=on", "--set", f"{device}.fault=none")
        for bus in self.buses_with_adapter:
            self.simulate("--bus", bus, "--plug")

    def recovered(self):
        began = time.monotonic()
        while silent := self.consumer.silent(self.devices, FRESH):
            if time.monotonic() - began > RECOVERY:
                self.fail(f"no good reading of {', '.join(silent)} within {RECOVERY:.0f} s after {self.events[-3:]}")
            self.pass_time(time.monotonic() + 0.5)
        value = round(random.uniform(-100, 100), 3)
        def homed():
            self.sample()
            code, out, _ = self.axlecast("home", "turntable", "--value", value, "--yes", "--json", "--config", self.config)
            return code == 0 and json.loads(out)["id"]
        self.commands.append(wait_for(homed, f"a command that succeeds after {self.events[-3:]}", RECOVERY))
        sizes = lambda: {file.name: file.stat().st_size for file in self.disks["logs"].folder.glob("*.lcm")}
        before = sizes()
        wait_for(lambda: sizes() != before, f"the recorder writes after {self.events[-3:]}", RECOVERY)
        self.no_process_ended()
        self.network.worked_until = math.inf

    def calm(self):
        """Nothing is lost while nothing happens."""
        _, before = self.consumer.counts()
        self.pass_time(time.monotonic() + CALM)
        self.lost_in_calm += self.consumer.counts()[1] - before

    def pass_episode(self, faults):
        """Returns how many seconds it takes to recover."""
        _, before = self.consumer.counts()
        flaps = faults.counts.get("interface", 0)
        self.episode(faults)
        over = time.monotonic()
        self.restore()
        self.recovered()
        took = time.monotonic() - over
        if flaps == faults.counts.get("interface", 0):
            self.lost_with_network += self.consumer.counts()[1] - before
        self.calm()
        return took

    # -- the test

    def test_it_works_again_after_everything_and_nothing_grows(self):
        self.commands, self.lost_in_calm, self.lost_with_network, episodes = [], 0, 0, 0
        faults = Faults(self, random.Random(SEED))
        self.start_machine()
        self.recovered()
        self.calm()
        ends = time.monotonic() + SECONDS
        slowest = 0.0
        while time.monotonic() < ends or episodes == 0:
            slowest = max(slowest, self.pass_episode(faults))
            episodes += 1
        grown = [life.growth() for part in self.parts.values() for life in part.lives]
        valid, lost = self.consumer.counts()
        print(f"{time.monotonic() - self.began:.0f} s, {episodes} episodes, {sum(faults.counts.values())} faults {faults.counts}; "
              f"{valid} valid readings, {lost} lost, {self.lost_with_network} of them in episodes with the interface up, {self.lost_in_calm} in calm; recovered within {slowest:.1f} s; "
              f"{self.started_again} processes started again that began without a network; "
              f"{len(self.commands)} commands; growth of {len([life for life in grown if life is not None])} lives judged")
        self.assertEqual(self.lost_in_calm, 0)
        self.assertEqual([text for text in grown if text], [])
        self.every_command_is_in_the_journal()
        self.every_log_is_readable()

    def every_command_is_in_the_journal(self):
        for command in self.commands:
            code, out, err = self.axlecast("outcome", command, "--json", "--config", self.config)
            self.assertEqual(code, 0, f"{command}: {out}{err}")

    def every_log_is_readable(self):
        self.parts["recorder"].process.terminate()
        self.parts["recorder"].process.wait(LIMIT)
        logs = sorted(self.disks["logs"].folder.glob("*.lcm"))
        self.assertTrue(logs)
        for log in logs:
            code, out, err = self.axlecast("log", "verify", log, "--json")
            self.assertIn(code, (0, 3), f"{log.name}: {out}{err}")

    def write_report(self):
        if not REPORT:
            return
        folder = pathlib.Path(REPORT)
        folder.mkdir(parents=True, exist_ok=True)
        with open(folder / "soak.csv", "w", newline="") as file:
            table = csv.DictWriter(file, self.rows[0].keys())
            table.writeheader()
            table.writerows(self.rows)
        gaps = [(round(at - self.began, 2), f"{missing} readings of {device} are missing") for at, device, missing in self.consumer.gaps]
        (folder / "faults.txt").write_text("".join(f"{at} {what}\n" for at, what in sorted(self.events + gaps)))
        subprocess.run(["gnuplot", "-e", f"folder='{folder}'", SOURCE / "tests/e2e/soak.gnuplot"], check=True)
        print(f"picture: {folder / 'soak.svg'}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
