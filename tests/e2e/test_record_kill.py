"""axlecast record killed under load, again and again: what is in the log is whole, and it ends just before the kill. And
`axlecast log repair` of a recorder's damaged logs.

AXLECAST_RECORD_KILLS sets how often, AXLECAST_RECORD_RATE the load, AXLECAST_LOG_DAMAGES how many places are damaged
(tools/campaign)."""

import json
import os
import pathlib
import random
import re
import signal
import statistics
import struct
import subprocess
import sys
import time
import unittest

import lcm_log
import numbered_load
from machine import BIN, Machine, wait_for

KILLS = int(os.environ.get("AXLECAST_RECORD_KILLS", "4"))
RATE = int(os.environ.get("AXLECAST_RECORD_RATE", "5000"))  # messages a second
MEDIAN_MS = 100  # of what a kill costs: the bound that holds for a power failure
MOST_MS = 2_000  # of one kill: a busy disk, and a machine that runs other programs, hold the recorder up
DAMAGES = int(os.environ.get("AXLECAST_LOG_DAMAGES", "20"))  # of each size
PORT = 7667
URL = f"udpm://239.255.76.67:{PORT}?ttl=0"
KILLS_A_LOG = 2


def load_of(records):
    """(number, instant of sending) of the load's messages."""
    found = []
    for record in records:
        channel_size, = struct.unpack_from(">I", record, 20)
        if record[28:28 + channel_size] == numbered_load.CHANNEL.encode():
            found.append(numbered_load.DATA.unpack_from(record, 28 + channel_size))
    return found


def dropped_by_kernel():
    """What the sockets of the port dropped so far."""
    lines = pathlib.Path("/proc/net/udp").read_text().splitlines()[1:]
    return sum(int(line.split()[-1]) for line in lines if line.split()[1].endswith(f":{PORT:04X}"))


class UnderLoad(Machine):
    """A recorder, and a load that counts itself."""

    def setUp(self):
        super().setUp()
        self.chance = random.Random(1)
        self.count_file = self.folder / "count"
        self.count_file.write_bytes(bytes(8))
        self.runs = 0

    def load(self):
        load = self.start("load", sys.executable, numbered_load.__file__, self.count_file, RATE)
        self.wait_load(1)
        return load

    def delivered(self):
        return struct.unpack("<q", self.count_file.read_bytes())[0]

    def wait_load(self, count):
        """So many messages more."""
        began = self.delivered()
        wait_for(lambda: self.delivered() >= began + count, lambda: f"a load; {self.log('load')}")

    def record(self, log, env=None):
        """A recorder that continues the log, and its name."""
        self.runs += 1
        name = f"record{self.runs}"
        return self.start(name, BIN / "axlecast", "record", log, "--append", "--url", URL, "--json", "--name", "test",
                          env=env), name

    def said(self, name, kind):
        lines = (json.loads(line) for line in self.log(name).splitlines() if line.startswith("{"))
        return next((line for line in lines if line["kind"] == kind), None)

    def listens(self, process, name):
        wait_for(lambda: self.said(name, "start") or process.poll() is not None, "the recorder to listen")
        self.assertIsNone(process.poll(), self.log(name))

    def log_command(self, *arguments):
        done = subprocess.run([BIN / "axlecast", "log", *arguments], capture_output=True, text=True, timeout=120)
        return done.returncode, done.stdout + done.stderr


class RecordKill(UnderLoad):
    def setUp(self):
        super().setUp()
        self.lost_ms = []
        self.torn = 0

    def until_the_kill(self, process, name):
        """To an instant at random, which is the point here: some while it starts, some while it writes much at once.
        Since when it had listened (None: it need not have), and how long it was held up; ns."""
        kind = self.chance.random()
        if kind < 0.2:
            time.sleep(self.chance.uniform(0, 0.1))
            return None, 0
        self.listens(process, name)
        listened = time.monotonic_ns()
        self.wait_load(10)
        if kind < 0.6:
            time.sleep(self.chance.uniform(0, 0.4))
            return listened, 0
        self.stand_still(process)
        began = time.monotonic_ns()
        time.sleep(self.chance.uniform(0.05, 0.2))
        process.send_signal(signal.SIGCONT)
        held_up = time.monotonic_ns() - began
        time.sleep(self.chance.uniform(0, 0.004))
        return listened, held_up

    def judge_kill(self, log):
        before = log.stat().st_size if log.exists() else 0
        process, name = self.record(log)
        listened, held_up = self.until_the_kill(process, name)
        dropped = dropped_by_kernel()
        delivered, killed = self.delivered(), time.monotonic_ns()
        self.kill(process)
        data = log.read_bytes() if log.exists() else b""
        records = list(lcm_log.whole_records(data))
        whole = b"".join(records)
        self.judge_readers(log, data, records)
        new = load_of(lcm_log.whole_records(data[before:])) if len(whole) > before else []
        if not new and listened is None:
            return
        numbers = [number for number, _ in new]
        self.assertEqual(numbers, sorted(set(numbers)))
        if numbers:
            missing = sorted(set(range(numbers[0], numbers[-1])) - set(numbers))
            self.assertLessEqual(len(missing), dropped, f"from {numbers[:3]} to {numbers[-1]} are missing {missing[:20]}")
        all_there = numbers and numbers[-1] + 1 >= delivered
        last = new[-1][1] if new else listened
        lost_ms = 0 if all_there else (killed - last - held_up) * 1e-6
        self.assertLessEqual(lost_ms, MOST_MS, f"{name} was killed; written {numbers[-1:]}, delivered {delivered}")
        if held_up == 0:
            self.lost_ms.append(lost_ms)

    def judge_readers(self, log, data, records):
        """Stock liblcm reads to the last whole event; repair leaves exactly these."""
        whole = b"".join(records)
        self.torn += len(whole) < len(data)
        if not data:
            return
        self.assertEqual(len(list(lcm_log.stock_events(log))), len(records))
        repaired = self.folder / "repaired.lcm"
        code, out = self.log_command("repair", log, "--output", repaired, "--force")
        self.assertEqual(code, 3 if len(whole) < len(data) else 0, out)
        if code == 3:
            self.assertEqual(repaired.read_bytes(), whole)

    # -- the end of a log

    def judge_end(self, log):
        """The log continues once more, to its end: it is whole."""
        process, name = self.record(log)
        self.listens(process, name)
        self.wait_load(200)
        dropped, delivered = dropped_by_kernel(), self.delivered()
        process.send_signal(signal.SIGINT)
        code = process.wait(60)
        summary = self.said(name, "end")
        self.assertEqual(code, 3 if summary["lost"] or dropped else 0, summary)
        numbers = [number for number, _ in load_of(lcm_log.whole_records(log.read_bytes()))]
        self.assertGreaterEqual(numbers[-1], delivered - 1)
        code, out = self.log_command("verify", log)
        self.assertEqual(code, 0, out)
        self.assertEqual(len(list(lcm_log.stock_events(log))), len(list(lcm_log.events(log))))

    def played(self, log):
        """How many events stock lcm-logplayer reports that it plays."""
        done = subprocess.run(["lcm-logplayer", "-v", "--speed=1000", "--lcm-url=udpm://239.255.76.67:7700?ttl=0", log],
                              capture_output=True, text=True, timeout=120)
        return len(re.findall(r"^\d+\.\d+ Channel", done.stdout, re.MULTILINE))

    def test_a_kill_costs_only_what_was_in_memory(self):
        load = self.load()
        killed = 0
        while killed < KILLS:
            log = self.folder / "run.lcm"
            for _ in range(KILLS_A_LOG):
                self.judge_kill(log)
                killed += 1
            self.judge_end(log)
            if killed < KILLS:
                log.unlink()
        self.assertIsNone(load.poll(), self.log("load"))
        self.assertEqual(self.played(log), len(list(lcm_log.events(log))))
        self.assertLessEqual(statistics.median(self.lost_ms), MEDIAN_MS)
        print(f"{killed} kills, {self.torn} torn ends; lost at the end, of {len(self.lost_ms)}: "
              f"median {statistics.median(self.lost_ms):.1f} ms, most {max(self.lost_ms):.1f} ms")


class Start(UnderLoad):
    def test_under_a_load_that_fills_the_socket_of_its_own_self_test(self):
        load = self.load()
        log = self.folder / "run.lcm"
        process, name = self.record(log, {"LD_PRELOAD": str(BIN.parent / "campaign/axlecast_slow_send.so")})
        self.listens(process, name)
        self.wait_load(10)
        load.terminate()
        load.wait(10)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 0, self.log(name))
        numbers = [number for number, _ in load_of(lcm_log.whole_records(log.read_bytes()))]
        self.assertEqual(numbers, list(range(numbers[0], self.delivered())), "from its first message on without a gap")


class Damage(UnderLoad):
    """Of a recorder's own log, with its head and its seals, repaired by the command."""

    def recorded(self):
        log = self.folder / "whole.lcm"
        process, name = self.record(log)
        self.listens(process, name)
        load = self.load()
        self.wait_load(200)
        load.terminate()
        load.wait(10)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 0)
        return log.read_bytes()

    def judge_repair(self, damaged, undamaged, where):
        """Every undamaged record is in the repaired log, in order, and all of it can be read by stock tools."""
        log, repaired = self.folder / "damaged.lcm", self.folder / "repaired.lcm"
        log.write_bytes(damaged)
        repaired.unlink(missing_ok=True)
        code, out = self.log_command("repair", log, "--output", repaired)
        self.assertIn(code, (0, 3), f"{where}: {out}")
        repaired = repaired if code == 3 else log
        data = repaired.read_bytes()
        kept = list(lcm_log.whole_records(data))
        self.assertEqual(b"".join(kept), data, where)
        rest = iter(kept)
        self.assertTrue(all(record in rest for record in undamaged), where)
        self.assertEqual(len(list(lcm_log.stock_events(repaired))), len(kept), where)

    def test_a_cut_costs_only_the_cut_event(self):
        data = self.recorded()
        records = list(lcm_log.whole_records(data))
        begin = len(data) - sum(map(len, records[-3:]))
        for size in range(begin, len(data), 1 if DAMAGES >= 1_000 else 37):
            cut = data[:size]
            self.judge_repair(cut, list(lcm_log.whole_records(cut)), f"cut to {size} bytes")

    def test_damage_costs_only_the_damaged_events(self):
        data = self.recorded()
        records = list(lcm_log.whole_records(data))
        for size in (1, 10, 100):
            for _ in range(DAMAGES):
                begin = self.chance.randrange(len(data) - size)
                damaged = bytearray(data)
                for i in range(begin, begin + size):
                    damaged[i] ^= self.chance.randrange(1, 256)
                undamaged, offset = [], 0
                for record in records:
                    if offset + len(record) <= begin or offset >= begin + size:
                        undamaged.append(record)
                    offset += len(record)
                self.judge_repair(damaged, undamaged, f"{size} bytes at {begin}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
