"""A fleet database with made-up machines, for the page: its rows are computed here, not shipped."""

import json
import math
import pathlib
import sys
import time

from page import SOURCE

sys.path.insert(0, str(SOURCE / "tests/fleet"))
# pylint: disable=wrong-import-position
import chunk_body  # noqa: E402
from cluster import Cluster  # noqa: E402

UNIT_MM = 4
PER_COUNT = 0.001  # mm
AMPLITUDE = 50.0  # mm
PERIOD = 600.0  # s
RAW_S = 120  # of the newest samples that are stored, at 10 Hz
SECONDS_S = 2 * 3600
MINUTES_S = 3 * 86400


def value(t):
    """mm, of every axis: a swing."""
    return AMPLITUDE * math.sin(2 * math.pi * t / PERIOD)


def counts(t):
    return round(value(t) / PER_COUNT)


def lit(text):
    return "'" + str(text).replace("'", "''") + "'"


class Fleet(Cluster):
    """press1 is well; press2 has alarms, an absent device and a hole; press10 has sent nothing for an hour."""

    def fill(self):
        self.create_database()
        self.now = int(time.time()) // 60 * 60  # so that the intervals of a curve that ends now are whole
        self.statements = [file.read_text(encoding="utf-8") for file in sorted(pathlib.Path(SOURCE, "tools/fleet/schema").glob("*.sql"))]
        self.add("SELECT axlecast.ensure_partitions(current_date - 4, current_date + 1)")
        self.add("CREATE ROLE viewer LOGIN IN ROLE axlecast_reader")
        self.add("CREATE ROLE stranger LOGIN")
        self.streams = 0
        # The first two are current for as long as a test takes.
        for name, newest in (("press1", self.now + 900), ("press2", self.now + 900), ("press10", self.now - 3600)):
            self.machine(name, newest)
        for device in ("axis1", "axis2"):
            self.axis("press1", device)
        self.axis("press2", "axis1", seconds=60)
        self.health("press2", "gearbox", "offline", "no reply")
        self.motor("press1", "conveyor")
        self.events("press2")
        self.sql(";\n".join(self.statements))
        return self

    def add(self, statement):
        self.statements.append(statement)

    def machine(self, name, newest):
        self.add(f"""INSERT INTO axlecast.machine (name, installation, last_batch, last_utime, lag_bytes, lag_logs)
            VALUES ({lit(name)}, gen_random_uuid(), now(), {newest}000000, 1500000, 1)""")
        self.add(f"""INSERT INTO axlecast.log (machine, name, host, start_utime, file_number)
            SELECT id, 'all', 'h', 1, 1 FROM axlecast.machine WHERE name = {lit(name)}""")

    def health(self, machine, device, state="online", reason=""):
        self.add(f"INSERT INTO axlecast.device (machine, name) SELECT id, {lit(device)} FROM axlecast.machine WHERE name = {lit(machine)}")
        self.add(f"""INSERT INTO axlecast.device_health (t, boot_id, good, errors, machine, nv_writes, datum_epoch, device, bus, family,
                model, serial, firmware, state, reason, message, log, seq)
            SELECT now(), 1, 1, '{{}}', id, 0, 0, {lit(device)}, 'rs485-0', 'tformat', 'ts5669n127', 'S-1', '', {lit(state)},
                {lit(reason)}, '{{}}', 1, 1 FROM axlecast.machine WHERE name = {lit(machine)}""")

    def axis(self, machine, device, seconds=SECONDS_S):
        """Two starts of the driver; samples, seconds and minutes up to now."""
        self.health(machine, device)
        for boot, age in ((1, 2 * 86400), (2, seconds)):
            self.add(f"""INSERT INTO axlecast.stream (device, boot_id, datum_epoch, counts_per_turn, unit, unit_per_count, seen)
                SELECT d.id, {boot}, 0, 100000, {UNIT_MM}, {PER_COUNT}, to_timestamp({self.now - age}) FROM axlecast.device d
                JOIN axlecast.machine m ON m.id = d.machine WHERE m.name = {lit(machine)} AND d.name = {lit(device)}""")
        older, newer = self.streams + 1, self.streams + 2  # identities of a new table
        self.streams = newer
        chunk = ",".join(self.chunk(newer, self.now - RAW_S + 10 * i) for i in range(RAW_S // 10))
        self.add(f"""INSERT INTO axlecast.position_chunk (t0, t1, seq0, first, last, lo, hi, mean, stream, log, n, valid, missed,
                flags_or, flags_and, body) VALUES {chunk}""")
        intervals = "(stream, t, lo, hi, mean, n, valid, missed, flags_or, flags_and) VALUES"
        second = ",".join(self.interval(newer, t, 1) for t in range(self.now - seconds, self.now))
        self.add(f"INSERT INTO axlecast.position_second {intervals} {second}")
        begin = (self.now - MINUTES_S) // 60 * 60
        minute = ",".join(self.interval(newer if t >= self.now - seconds else older, t, 60) for t in range(begin, self.now, 60))
        self.add(f"INSERT INTO axlecast.position_minute {intervals} {minute}")

    @staticmethod
    def chunk(stream, start):
        times = [i * 100_000 for i in range(100)]
        values = [counts(start + t / 1e6) for t in times]
        body = chunk_body.chunk(times, values, [1] * 100)
        return (f"(to_timestamp({start}), to_timestamp({start} + 9.9), 0, {values[0]}, {values[-1]}, {min(values)}, {max(values)}, "
                f"{sum(values) / 100}, {stream}, 1, 100, 100, 0, 1, 1, '\\x{body.hex()}')")

    @staticmethod
    def interval(stream, start, length):
        values = [counts(start + i * length / 10) for i in range(10)]
        return (f"({stream}, to_timestamp({start}), {min(values)}, {max(values)}, {sum(values) / 10}, {10 * length}, {10 * length}, 0, 1, 1)")

    def motor(self, machine, device):
        self.health(machine, device)
        self.add(f"""INSERT INTO axlecast.motor_health (t, boot_id, machine, power_w, current_a, trip_count, status_bits, flags, device, message, log, seq)
            SELECT to_timestamp({self.now} - i), 1, m.id, 300 + i % 10, 1.5, 1, 0, 3, {lit(device)}, '{{}}', 1, i
            FROM axlecast.machine m, generate_series(0, 1800) i WHERE m.name = {lit(machine)}""")

    def events(self, machine):
        at = f"to_timestamp({self.now} - 600)"
        of = f"FROM axlecast.machine WHERE name = {lit(machine)}"
        for event, (name, code, state, severity) in enumerate((("battery_alarm", 1, "appeared", "warning"), ("over_speed", 2, "appeared", "error"),
                                                               ("over_speed", 2, "cleared", "error"))):
            self.add(f"""INSERT INTO axlecast.alarm (t, machine, device, boot_id, code, source, name, severity, state, alarm_state, text,
                    first_utime, last_utime, count, cause, message, log)
                SELECT {at} + interval '{event} s', id, 'axis1', 1, {code}, 'device', {lit(name)}, {lit(severity)}, {lit(state)}, 'live',
                    'Check <b>it</b>', 1, 1, 1, '', '{{}}', 1 {of}""")
        for event, (state, final) in enumerate((("issued", "false"), ("succeeded", "true"))):
            message = json.dumps({"is_unsigned": 1, "changes": [{"key": "single_turn", "before": "131071", "after": "0"}]})
            self.add(f"""INSERT INTO axlecast.command (t, machine, device, command_id, operation, state, finding, is_final, verified,
                    reason_code, text, started, finished, boot_id, seq, message, log)
                SELECT {at} + interval '{event} s', id, 'axis1', '00000000-0000-0000-0000-00000000000a', 'zero_single_turn', {lit(state)},
                    '', {final}, {final}, 0, 'read back: 0 counts', {at}, {at} + interval '1 s', 1, {event}, {lit(message)}, 1 {of}""")
        trip = json.dumps({"utime": (self.now - 600) * 10**6, "device": "conveyor", "log_index": 1, "trip_count": 3, "factor_bits": 1,
                           "not_before_utime": 0, "not_after_utime": (self.now - 601) * 10**6, "interval_us": 100000, "valid_mask": 127,
                           "samples": [[float(100 + i * (row + 1)) for i in range(20)] for row in range(7)]})
        self.add(f"""INSERT INTO axlecast.trip (t, machine, device, trip_count, factor_bits, interval_us, key, boot_id, message, log)
            SELECT {at}, id, 'conveyor', 3, 1, 100000, 7, 1, {lit(trip)}, 1 {of}""")
        self.add(f"INSERT INTO axlecast.hole (machine, cause, messages) SELECT id, 'disk nearly full', 1234 {of}")
