#!/usr/bin/env python3
"""axlecast ship and a log that is damaged in 1,000 places, closed or while it grows: what a seal verifies is in the database once, and every
damaged stretch is a hole with its cause."""
import bisect
import json
import os
import random
import signal
import struct
import sys
import time
import unittest

import lcm_log
from machine import wait_for
from shipped_machine import LogFile
from shipping import TYPES, UTIME_EACH, Load, Positions, Shipping

PLACES = 1_000
STRETCHES = 2_500      # of EVENTS messages each: a log of about 11 MB, two batches
EVENTS = 25
KINDS = ("flip", "zero", "remove", "insert")
LIVE_PLACES = 8


def damaged(data, places, chance):
    """Returns the log with damage of all kinds at `places` random places, and the ranges of the original bytes that were hit."""
    hits = []
    pieces, end = [], 0
    for i, at in enumerate(sorted(chance.sample(range(2_000, len(data) - 600, 600), places))):
        size = chance.randrange(1, 600)
        kind = KINDS[i % len(KINDS)]
        pieces.append(data[end:at])
        if kind == "flip":
            size = 1
            pieces.append(bytes([data[at] ^ 1 << chance.randrange(8)]))
        elif kind == "zero":
            pieces.append(bytes(size))
        elif kind == "insert":
            pieces.append(chance.randbytes(size))
            size = 0
        end = at + size
        hits.append((at, max(end, at + 1), kind))
    pieces.append(data[end:])
    return b"".join(pieces), hits


class ShipDamage(Shipping):
    axes = ("a1",)

    def make_log(self):
        """A sealed log of positions of one axis. Returns its path, the stretches as (begin, end, first event), and (event, us, counts) of
        each position."""
        self.logs.mkdir()
        log = LogFile()
        utime = int((time.time() - 3600) * 1e6)
        head = {"version": "0", "name": "positions", "host": "host1", "urls": [], "channel": "^POSITION/", "invert": False, "file_number": 0,
                "start_utime": utime}
        for channel, text in (("AXLECAST/recorder", json.dumps(head)), ("AXLECAST/machine.yaml", self.config.read_text())):
            log.add(utime, channel, text.encode())
        stretches, positions, begin, first = [], [], 0, 0
        size = 0
        for i in range(STRETCHES * EVENTS):
            utime += UTIME_EACH
            message = TYPES.position_t()
            message.utime, message.mono_ns, message.boot_id, message.seq = utime, utime * 1000, 77, i
            message.counts_per_turn, message.counts, message.flags = 131072, i * 7 % 997, 0x2003
            message.value, message.unit = message.counts * 360 / 131072, TYPES.position_t.UNIT_DEG
            positions.append((len(log.records), utime, message.counts))
            log.add(utime, "POSITION/a1", message.encode())
            if i % EVENTS == EVENTS - 1:
                log.seal(utime)
                size += sum(map(len, log.records[first:]))
                stretches.append((begin, size, first))
                begin, first = size, len(log.records)
        path = log.write(self.logs / "press3-positions_20261121T070000Z.lcm")
        return path, stretches, positions

    def test_a_log_with_1000_damaged_places(self):
        path, stretches, positions = self.make_log()
        original = path.read_bytes()
        data, hits = damaged(original, PLACES, random.Random(11))
        path.write_bytes(data)
        self.make_quiet()
        begun = time.monotonic()
        code, status, errors = self.ship_once()
        took = time.monotonic() - begun
        self.assertEqual(code, 3, errors)

        # The stretches that no damage has touched, by the bytes of the original.
        begins = [begin for begin, _, _ in stretches]
        hit = {bisect.bisect_right(begins, position) - 1 for begin, end, _ in hits for position in (begin, end - 1)}
        # An insertion exactly between two stretches damages none.
        untouched = [i for i in range(len(stretches)) if i not in hit]
        self.assertGreater(len(hit), PLACES // 3)
        self.assertGreater(len(untouched), STRETCHES // 3)
        stored = self.samples("a1")
        self.assertEqual(len(stored), len(set(stored)), "a position is in the database twice")
        by_event = {event: (utime, counts) for event, utime, counts in positions}
        firsts = [first for _, _, first in stretches]
        of_stretch = lambda event: bisect.bisect_right(firsts, event) - 1
        event_of = {sample: event for event, sample in by_event.items()}
        self.assertLessEqual(set(stored), set(event_of), "a position is in the database that was never recorded")
        events = sorted(event_of[sample] for sample in stored)
        self.assertGreaterEqual({of_stretch(event) for event in events}, set(untouched))
        in_database = {}
        for event in events:
            in_database[of_stretch(event)] = in_database.get(of_stretch(event), 0) + 1
        self.assertEqual(set(in_database.values()), {EVENTS}, "a stretch is in the database in part")

        # Every stretch that is not there is in one hole, and a hole contains nothing that is there.
        holes = [(int(first), int(messages), cause, int(size), t0, t1) for first, messages, cause, size, t0, t1 in self.cluster.sql(
            "SELECT first_event, messages, cause, bytes, t0, t1 FROM axlecast.hole ORDER BY first_event")]
        self.assertEqual(len({first for first, *_ in holes}), len(holes))
        self.assertEqual({cause for _, _, cause, *_ in holes}, {"the log is damaged"})
        for hole in holes:
            *_, size, t0, t1 = hole
            # Nothing follows the last one.
            self.assertTrue(size > 0 and t0 and (t1 is None if hole is holes[-1] and t1 is None else t0 <= t1), hole)
        missing = sorted(set(by_event) - set(events))
        last = [first for first, *_ in holes] + [1 << 62]
        for event in missing:
            self.assertGreaterEqual(bisect.bisect_right(last, event), 1, f"no hole before the missing event {event}")
        for first, messages, *_ in holes:
            seals = messages // EVENTS + 1
            inside = [event for event in missing if first <= event < first + messages + seals]
            self.assertGreaterEqual(len(inside), min(messages - seals, 1))
        in_holes = sum(messages for _, messages, *_ in holes)
        heads = 2 if 0 not in in_database else 0
        # Exact but for the seals: one that cannot be read is counted as a message of its hole.
        lost_seals = len(stretches) - len(in_database)
        self.assertGreaterEqual(len(stored) + in_holes, len(positions))
        self.assertLessEqual(len(stored) + in_holes, len(positions) + heads + lost_seals)
        self.assertEqual(status["holes"], len(holes))
        self.assertEqual(status["samples"], len(stored))

        lines = [line for line in errors.splitlines() if "hole" in line or "damage" in line]
        self.assertLessEqual(len(lines), 3, errors)
        self.assertIn("holes recorded: axlecast fleet status names their causes", errors)
        print(f"{self.id()}: {PLACES} places in {len(data)} bytes: {len(stored)} of {len(positions)} samples in {len(in_database)} stretches "
              f"shipped, {len(holes)} holes with {in_holes} messages and seals, {len(untouched)} untouched stretches, {took:.1f} s",
              file=sys.stderr)

        self.check_verify(path, len(holes), len(stored))
        self.assertEqual(self.ship_once()[1]["holes"], 0, "each hole is recorded once")
        self.assertEqual(self.samples("a1"), stored)

    def check_verify(self, path, holes, samples):
        code, out, errors = self.axlecast("fleet", "verify", "--json", "--complete", path, "--database", self.cluster.connection())
        report = json.loads(out)
        self.assertEqual((code, report["differences"]), (0, []), errors)
        self.assertEqual(report["holes"], holes)
        self.assertEqual(report["devices"], [{"device": "a1", "samples_in_log": samples, "samples_in_database": samples, "compared": True}])
        self.cluster.sql("DELETE FROM axlecast.hole WHERE first_event = (SELECT max(first_event) FROM axlecast.hole)")
        code, out, errors = self.axlecast("fleet", "verify", path, "--database", self.cluster.connection())
        self.assertEqual(code, 3, out + errors)
        self.assertIn("the database has no hole there", out)

    def test_a_log_that_is_damaged_while_it_grows(self):
        recorder = self.recorder()
        sender = Positions(self.axes)
        self.addCleanup(sender.close)
        load = Load(sender)
        load.start()
        self.addCleanup(load.stop)
        shipper = self.shipper()
        path = wait_for(lambda: next(self.logs.glob("*-positions_*.lcm"), None), "the log")
        chance = random.Random(3)
        wait_for(lambda: self.cluster.value("SELECT coalesce(max(upto), 0) > 0 FROM axlecast.log") == "t", lambda: self.log("ship"))
        upto = lambda: int(self.cluster.value("SELECT coalesce(max(upto), 0) FROM axlecast.log"))
        for _ in range(LIVE_PLACES):
            before = path.stat().st_size
            wait_for(lambda before=before: path.stat().st_size > before + 2_000, "the log to grow")
            with open(path, "r+b") as log:  # in what the shipper may have read already, or not yet
                log.seek(before + chance.randrange(2_000))
                log.write(chance.randbytes(chance.randrange(1, 300)))
            shipped = upto()
            wait_for(lambda shipped=shipped: upto() > shipped + 400, lambda: "the log behind the damage: " + self.log("ship"))
        load.stop()
        sent = sender.sent["a1"]
        size = [0, 0.0]

        def quiet():
            now = path.stat().st_size
            if now != size[0]:
                size[:] = [now, time.monotonic()]
            return time.monotonic() - size[1] > 3
        wait_for(quiet, "the log to be at rest")
        for process in (recorder, shipper):
            process.send_signal(signal.SIGTERM)
            self.assertIn(process.wait(60), (0, 3), self.log("ship"))
        os.utime(path, (time.time() - 3600,) * 2)
        code, _, errors = self.ship_once()
        self.assertIn(code, (0, 3), errors)
        stored = self.samples("a1")
        self.assertEqual(len(stored), len(set(stored)))
        self.assertLessEqual(set(stored), set(sent))
        holes = self.cluster.sql("SELECT first_event, coalesce(messages, 0), cause FROM axlecast.hole WHERE first_event IS NOT NULL")
        in_holes = sum(int(messages) for _, messages, _ in holes)
        readable = sum(channel == "POSITION/a1" for channel in self.channels_of(path))
        # Exact but for the seals that cannot be read, and the head of the log.
        self.assertGreaterEqual(len(stored) + in_holes, len(sent))
        self.assertLessEqual(len(stored) + in_holes, len(sent) + 2 * LIVE_PLACES + 3)
        self.assertGreater(len(stored), len(sent) // 3)
        print(f"{self.id()}: {len(sent)} sent, {len(stored)} stored, {len(holes)} holes with {in_holes} messages and seals, "
              f"{readable} readable", file=sys.stderr)
        self.assertGreaterEqual(len(holes), LIVE_PLACES // 2)
        self.assertEqual({cause for _, _, cause in holes}, {"the log is damaged"})
        self.assertLess(self.log("ship").count("holes recorded"), 40)

    @staticmethod
    def channels_of(path):
        return [record[28:28 + struct.unpack_from(">I", record, 20)[0]].decode(errors="replace")
                for record in lcm_log.whole_records(path.read_bytes())]


if __name__ == "__main__":
    unittest.main()
