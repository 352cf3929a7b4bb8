"""The schema by its own files, without our programs: decoding, views, partitions and retention, with bodies that chunk_body.py encodes."""

import os
import pathlib
import random
import unittest

import chunk_body
from cluster import Cluster, SqlError

SCHEMA = pathlib.Path(os.environ["AXLECAST_SOURCE"]) / "tools/fleet/schema"
LIMITS = (-2**63, 2**63 - 1)


def texts(values):
    return "{" + ",".join(map(str, values)) + "}"


def random_column(chance, mode, width, n, escapes, scale):
    """Returns a body of one column 2 of random bytes, many of them 0xff. `escapes`: their share, for widths 1 and 2."""
    heads = [chance.randint(-scale, scale) for _ in range(1 if mode == chunk_body.DELTA else 2)]
    data = b"".join(value.to_bytes(8, "big", signed=True) for value in heads)
    for _ in range(max(0, n - (0, 1, 2)[mode])):
        if width in (1, 2) and chance.random() < escapes:
            data += b"\xff" * width + chance.getrandbits(chance.choice((8, 16, 44, 63))).to_bytes(8, "big")
            continue
        residual = bytes(chance.choice((0, 1, 127, 128, 254, 255, 255, chance.randrange(256))) for _ in range(width))
        data += residual if width not in (1, 2) or residual != b"\xff" * width else b"\xfe" * width
    return chunk_body.body([bytes([2, mode, width]) + len(data).to_bytes(4, "big") + data])


class Schema(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cluster = cls.enterClassContext(Cluster())
        cls.cluster.create_database()
        cls.sql = cls.cluster.sql
        cls.value = cls.cluster.value
        script = "SET search_path = pg_catalog; SET client_min_messages = warning;\n"
        cls.sql("BEGIN;" + script + "\n".join(path.read_text() for path in sorted(SCHEMA.glob("*.sql"))) + "COMMIT")

    def setUp(self):
        tables = ",".join(f"axlecast.{name}" for name in (
            "machine, device, stream, log, position_chunk, position_second, position_minute, device_health, bus_health, recorder_health, "
            "alarm, command, trip, nv_writes, hole, odd, received").split(", "))
        self.sql(f"TRUNCATE {tables} RESTART IDENTITY CASCADE; UPDATE axlecast.retention SET keep = '14 days' WHERE kind = 'position_chunk'")

    def decoded(self, body, column, n):
        found = self.value(f"SELECT axlecast.column_values('\\x{body.hex()}', {column}, {n})")
        return None if found is None else [int(value) for value in found.strip("{}").split(",")] if found != "{}" else []

    def add_axis(self, machine="press", device="x", unit_per_count="0.5", seen="2026-01-01 00:00+00"):
        """Returns the id of a stream of a new or existing device."""
        self.sql(f"INSERT INTO axlecast.machine (name, installation) VALUES ('{machine}', gen_random_uuid()) ON CONFLICT DO NOTHING;"
                 f"INSERT INTO axlecast.device (machine, name) SELECT id, '{device}' FROM axlecast.machine WHERE name = '{machine}' ON CONFLICT DO NOTHING")
        return self.value(
            "INSERT INTO axlecast.stream (device, boot_id, datum_epoch, counts_per_turn, unit, unit_per_count, seen) "
            f"SELECT d.id, (SELECT count(*) FROM axlecast.stream), 0, 4096, 4, {unit_per_count}, '{seen}' FROM axlecast.device d "
            f"JOIN axlecast.machine m ON m.id = d.machine WHERE m.name = '{machine}' AND d.name = '{device}' RETURNING id")

    def add_chunk(self, stream, start, times, counts, flags, missed=None, seq=None):
        body = chunk_body.chunk(times, counts, flags, missed, seq)
        valid = [value for value, flag in zip(counts, flags) if flag & 1] or None
        low, high, mean = (min(valid), max(valid), sum(valid) / len(valid)) if valid else ("NULL",) * 3
        flags_or, flags_and = 0, -1
        for flag in flags:
            flags_or, flags_and = flags_or | flag, flags_and & flag
        self.sql(f"INSERT INTO axlecast.position_chunk VALUES ('{start}', timestamptz '{start}' + {times[-1]} * interval '1 us', 0, {counts[0]}, "
                 f"{counts[-1]}, {low}, {high}, {mean}, {stream}, 1, {len(counts)}, {len(valid or [])}, {sum(missed or [0])}, {flags_or}, {flags_and}, "
                 f"'\\x{body.hex()}')")

    def today(self, text=""):
        """A time of the server's present day, which has partitions."""
        return self.value("SELECT to_char(now() AT TIME ZONE 'UTC', 'YYYY-MM-DD')") + text

    # --- bodies ---

    def test_every_mode_and_width_is_decoded(self):
        random.seed(21)
        cases = []
        for mode in range(4):
            for width in (0, 1, 2, 4, 8):
                for scale in (0, 1, 100, 30_000, 10**8, 2**50, 2**62):
                    for n in (1, 2, 3, 256):
                        values = [random.randint(-scale, scale) for _ in range(n)]
                        column = chunk_body.column(2, mode, values, width)
                        if column and (mode != chunk_body.LINEAR or abs(values[-1] - values[0]) < 2**52):
                            other = chunk_body.column(9, chunk_body.RUNS, [7] * n, 0)
                            body = chunk_body.body([other, column])
                            cases.append(((mode, width, scale, n), body, values))
        self.assertGreater(len(cases), 200)
        selects = [f"SELECT {i}, axlecast.column_values('\\x{body.hex()}', 2, {len(values)}) = '{texts(values)}'::int8[]"
                   for i, (_, body, values) in enumerate(cases)]
        results = self.sql(" UNION ALL ".join(selects))
        self.assertEqual([cases[int(i)][0] for i, equal in results if equal != "t"], [])

    def test_loops_without_numeric_decode_as_the_one_with_it(self):
        """column_values against wide_column_values, which computes without overflow, value by value."""
        chance = random.Random(22)
        cases = []
        for mode in (chunk_body.LINEAR, chunk_body.DELTA, chunk_body.DELTA_OF_DELTA):
            for width in (0, 1, 2, 4, 8):
                for n in (1, 2, 3, 255, 256):
                    for escapes in (0, 0.02, 0.5):
                        scale = chance.choice((0, 1000, 2**49, 2**60 - 1))
                        cases.append((mode, width, n, random_column(chance, mode, width, n, escapes, scale)))
        selects = [f"SELECT {i}, axlecast.column_values('\\x{body.hex()}', 2, {n}) = "
                   f"axlecast.wide_column_values('\\x{body.hex()}', 9, {len(body)}, {mode}, {width}, {n})"
                   for i, (mode, width, n, body) in enumerate(cases)]
        for begin in range(0, len(selects), 100):
            results = self.sql(" UNION ALL ".join(selects[begin:begin + 100]))
            self.assertEqual([cases[int(i)][:3] for i, equal in results if equal != "t"], [])

    def test_values_at_the_ends_of_int8(self):
        values = [*LIMITS, 0, *LIMITS, -1, 1, LIMITS[1], LIMITS[1], LIMITS[0]]
        for mode in (chunk_body.DELTA, chunk_body.DELTA_OF_DELTA, chunk_body.RUNS):
            body = chunk_body.body([chunk_body.column(2, mode, values, 8)])
            self.assertEqual(self.decoded(body, 2, len(values)), values, mode)

    def test_escapes_are_decoded_at_every_place(self):
        for width, jump in ((1, 127), (1, 128), (1, 10**12), (2, 32767), (2, 32768), (2, 10**12), (1, 2**61)):
            for place in range(5):
                values = [5] * 5
                values[place] += jump
                for mode in (chunk_body.DELTA, chunk_body.DELTA_OF_DELTA):
                    body = chunk_body.body([chunk_body.column(2, mode, values, width)])
                    self.assertEqual(self.decoded(body, 2, 5), values, (width, jump, place, mode))

    def test_bad_bodies_are_errors(self):
        good = chunk_body.chunk([0, 1, 5], [1, 2, 4], [1, 1, 1])
        self.assertIsNone(self.decoded(good, 4, 3))  # no such column
        for body, n in ((b"", 3), (b"\x02\x00", 3), (good[:-1], 3), (good[:20], 3), (good, 300), (good, 2), (good, 0)):
            with self.assertRaises(SqlError, msg=(body, n)):
                for column in (1, 2, 3):
                    self.decoded(body, column, n)

    # --- samples and views ---

    def test_samples_are_those_of_the_time(self):
        stream = self.add_axis()
        start = self.today(" 10:00:00+00")
        self.add_chunk(stream, start, [0, 4000, 8001], [10, 20, -30], [1, 0, 3], [0, 2, 0], [7, 8, 9])
        self.add_chunk(stream, self.today(" 10:00:00.012+00"), [0, 4000], [40, 50], [1, 1])
        rows = self.sql(f"SELECT extract(epoch FROM t - '{start}') * 1e6, counts, value, flags, valid, missed, seq FROM axlecast.samples('press', 'x', "
                        f"timestamptz '{start}' + interval '4 ms', timestamptz '{start}' + interval '12 ms')")
        self.assertEqual([[float(row[0]), *row[1:]] for row in rows],
                         [[4000, "20", None, "0", "f", "2", "8"], [8001, "-30", "-15", "3", "t", "0", "9"], [12000, "40", "20", "1", "t", "0", None]])
        self.assertEqual(self.sql("SELECT * FROM axlecast.samples('press', 'y', '-infinity', 'infinity')"), [])

    def test_samples_of_an_unknown_unit_have_no_value(self):
        stream = self.add_axis(unit_per_count="NULL")
        self.add_chunk(stream, self.today(" 10:00+00"), [0], [10], [1])
        self.assertEqual(self.sql(f"SELECT counts, value FROM axlecast.samples('press', 'x', '{self.today()}', 'infinity')"), [["10", None]])

    def test_seconds_are_in_the_unit_of_the_axis(self):
        stream = self.add_axis(unit_per_count="-0.5")
        second = self.today(" 10:00:00+00")
        self.sql("INSERT INTO axlecast.position_second (t, lo, hi, mean, stream, n, valid, missed, flags_or, flags_and) VALUES "
                 f"('{second}', 0, 40, 16, {stream}, 115, 100, 1, 7, 0), "
                 f"(timestamptz '{second}' + interval '1 s', NULL, NULL, NULL, {stream}, 5, 0, 0, 0, 0)")
        with self.assertRaisesRegex(SqlError, "unique"):
            self.sql(f"INSERT INTO axlecast.position_second SELECT * FROM axlecast.position_second WHERE t = '{second}'")
        columns = "device, value_min, value_max, value_mean, lo, hi, n, valid, missed, flags_or, flags_and"
        expected = [["x", "-20", "-0", "-8", "0", "40", "115", "100", "1", "7", "0"], ["x", None, None, None, None, None, "5", "0", "0", "0", "0"]]
        self.assertEqual(self.sql(f"SELECT {columns} FROM axlecast.position_1s WHERE machine = 'press' AND t >= '{self.today()}' ORDER BY t"), expected)
        self.assertEqual(self.sql(f"SELECT {columns} FROM axlecast.seconds('press', '{self.today()}', '{self.today()} 12:00+00') ORDER BY t"), expected)
        self.assertEqual(self.sql(f"SELECT {columns} FROM axlecast.seconds('press', '{self.today()}', '{second}')"), [])

    def test_last_position_is_of_the_newest_stream(self):
        old = self.add_axis(seen=self.today(" 09:00+00"))
        new = self.add_axis(seen=self.today(" 10:00+00"))
        self.add_axis(device="none")
        rolled_up = self.add_axis(device="rolled up")
        self.add_chunk(old, self.today(" 09:00+00"), [0], [1], [1])
        self.add_chunk(new, self.today(" 10:00+00"), [0, 5], [2, 3], [1, 1])
        self.add_chunk(new, self.today(" 11:00+00"), [0, 5], [8, 9], [1, 2])
        self.sql(f"INSERT INTO axlecast.position_second VALUES ('{self.today(' 11:00+00')}', 4, 6, 5, {rolled_up}, 9, 9, 0, 1, 1)")
        self.assertEqual(self.sql("SELECT device, counts, value, valid, unit FROM axlecast.last_position ORDER BY device"),
                         [["rolled up", "5", "2.5", "t", "mm"], ["x", "9", None, "f", "mm"]])

    def test_writes_to_memory_outlive_the_messages(self):
        self.add_axis()
        for boot, writes in ((1, 3), (1, 5), (1, 4), (2, 2)):
            self.sql("INSERT INTO axlecast.device_health (t, boot_id, good, errors, machine, nv_writes, datum_epoch, device, bus, family, model, serial, "
                     f"firmware, state, reason, message, log, seq) VALUES (now(), {boot}, 1, '{{}}', 1, {writes}, 0, 'x', 'b', 'f', 'm', '', '', "
                     f"'online', '', '{{}}', 1, {writes})")
        self.assertEqual(self.sql("SELECT machine, device, state, nv_writes FROM axlecast.last_state"), [["press", "x", "online", "2"]])
        self.sql("TRUNCATE axlecast.device_health")
        self.assertEqual(self.sql("SELECT machine, device, writes, driver_starts FROM axlecast.wear"), [["press", "x", "7", "2"]])

    def test_error_rates_count_within_each_start(self):
        self.add_axis()
        hour = self.today(" 10:00+00")
        for minute, boot, exchanges, good, checksum in ((0, 1, 1000, 1000, 0), (10, 1, 2000, 1990, 10), (20, 2, 0, 0, 0), (30, 2, 1000, 970, 20)):
            errors = texts([0, 0, 0, checksum] + [0] * 12)
            self.sql("INSERT INTO axlecast.bus_health (t, boot_id, exchanges, good, late, rx_dropped, errors, machine, bus, family, port, state, message, log, "
                     f"seq) VALUES (timestamptz '{hour}' + {minute} * interval '1 min', {boot}, {exchanges}, {good}, 0, 0, '{errors}', 1, 'rs485', 'f', 'p', "
                     f"'up', '{{}}', 1, {minute})")
        self.assertEqual(self.sql("SELECT bus, exchanges, failed, failed_share, checksum, driver_starts FROM axlecast.error_rates_by_cable"),
                         [["rs485", "2000", "40", "0.02", "30", "2"]])

    def test_availability_counts_missed_readings(self):
        stream = self.add_axis()
        for minute, valid in ((0, 80), (1, 70)):
            self.sql("INSERT INTO axlecast.position_minute (t, n, valid, missed, stream, flags_or, flags_and) VALUES "
                     f"(timestamptz '{self.today()} 10:00+00' + {minute} * interval '1 min', 90, {valid}, 10, {stream}, 1, 0)")
        self.assertEqual(self.sql("SELECT device, n, valid, missed, valid_share, minutes FROM axlecast.availability"),
                         [["x", "180", "150", "20", "0.75", "2"]])

    def test_status_counts_holes_and_lag(self):
        self.add_axis()
        self.sql("UPDATE axlecast.machine SET last_utime = extract(epoch FROM now() - interval '1 h') * 1e6;"
                 "INSERT INTO axlecast.hole (machine, cause, messages) VALUES (1, 'disk nearly full', 5), (1, 'other', NULL)")
        self.assertEqual(self.sql("SELECT machine, round(extract(epoch FROM lag) / 60), holes, lost_messages, devices FROM axlecast.fleet_status"),
                         [["press", "60", "2", "5", "1"]])
        with self.assertRaisesRegex(SqlError, "unique"):
            self.sql("INSERT INTO axlecast.hole (machine, cause) VALUES (1, 'other')")

    def test_commands_are_one_row_each(self):
        self.add_axis()
        ids = ["00000000-0000-0000-0000-00000000000" + digit for digit in "12"]
        row = ("INSERT INTO axlecast.command (t, machine, device, command_id, operation, state, finding, is_final, verified, outcome, reason_code, reason, text, "
               "issued_by, boot_id, seq, message, log) VALUES ('{}', 1, 'x', '{}', 'zero', '{}', '{}', {}, false, {}, 0, NULL, '{}', {}, 1, 1, '{{}}', 1);")
        self.sql(row.format("2026-01-01 10:00+00", ids[0], "issued", "", False, "NULL", "", "'00ff'")
                 + row.format("2026-01-01 10:01+00", ids[0], "indeterminate", "", True, "'indeterminate'", "no answer", "NULL")
                 + row.format("2026-01-01 10:02+00", ids[0], "indeterminate", "effect_seen", True, "'indeterminate'", "it is done", "NULL")
                 + row.format("2026-01-01 11:00+00", ids[1], "issued", "", False, "NULL", "", "NULL"))
        self.assertEqual(self.sql("SELECT command_id, t = '2026-01-01 10:00+00', outcome, finding, text, issued_by FROM axlecast.commands ORDER BY t"),
                         [[ids[0], "t", "indeterminate", "effect_seen", "it is done", "00ff"], [ids[1], "f", None, None, None, None]])

    def test_every_view_can_be_read(self):
        views = [row[0] for row in self.sql("SELECT viewname FROM pg_views WHERE schemaname = 'axlecast'")]
        self.assertGreater(len(views), 15)
        for view in views:
            self.sql(f"SELECT * FROM axlecast.{view}")

    # --- partitions, retention, roles ---

    def test_partitions_are_made_within_bounds(self):
        kinds = int(self.value("SELECT count(*) FROM pg_class WHERE relnamespace = 'axlecast'::regnamespace AND relkind = 'p'"))
        self.assertEqual(self.value("SELECT axlecast.ensure_partitions('2020-02-27', '2020-03-01')"), str((kinds - 1) * 4 + 2))
        self.assertEqual(self.value("SELECT axlecast.ensure_partitions('2020-02-27', '2020-03-01')"), "0")
        self.assertEqual(self.value("SELECT axlecast.ensure_partitions(current_date + 9, current_date + 9999)"), "0")
        self.assertEqual(self.value("SELECT axlecast.ensure_partitions('1970-01-01', '1970-02-01')"), "0")
        stream = self.add_axis()
        self.add_chunk(stream, "2020-02-29 23:59:59.999999+00", [0], [1], [1])
        with self.assertRaisesRegex(SqlError, "no partition"):
            self.add_chunk(stream, "2020-03-02 00:00:00+00", [0], [1], [1])
        self.assertEqual(self.value("SELECT attstorage FROM pg_attribute WHERE attrelid = 'axlecast.position_chunk_p20200229'::regclass AND attname = 'body'"),
                         "e")

    def test_expired_partitions_and_rows_are_deleted(self):
        self.sql("UPDATE axlecast.retention SET keep = NULL WHERE kind NOT IN ('position_chunk', 'position_minute', 'odd')")
        self.sql("SELECT axlecast.ensure_partitions(current_date - 20, current_date - 10), axlecast.ensure_partitions('2019-01-15', '2019-01-15')")
        stream = self.add_axis()
        for days in (1, 12, 18):
            self.add_chunk(stream, self.value(f"SELECT current_date - {days}") + " 10:00+00", [0], [days], [1])
        self.sql("INSERT INTO axlecast.odd (machine, log, event, channel, utime, received, cause, message, noticed) VALUES "
                 "(1, 1, 1, 'X', 0, 0, '', '', now() - interval '2 years'), (1, 1, 2, 'X', 0, 0, '', '', now())")
        expired = {row[0]: row[1:] for row in self.sql("SELECT * FROM axlecast.expire()")}
        self.assertEqual(expired["odd"], ["0", "1"])
        self.assertEqual(expired["position_minute"], ["1", "0"])  # of 2019
        self.assertGreaterEqual(int(expired["position_chunk"][0]), 6)  # 20 to 15 days, 2019, and what other tests have made
        self.assertEqual(self.sql("SELECT first FROM axlecast.position_chunk ORDER BY 1"), [["1"], ["12"]])
        self.assertEqual(self.sql("SELECT * FROM axlecast.expire()"), [])

    def test_old_runs_of_numbers_are_joined_and_make_no_gap(self):
        self.add_axis()
        self.sql("UPDATE axlecast.retention SET keep = '1 year' WHERE kind = 'received'")
        self.sql("INSERT INTO axlecast.log (machine, name, host, start_utime, file_number, last_utime) SELECT 1, 'l', 'h', age, 0, "
                 "extract(epoch FROM now() - age * interval '1 day') * 1e6 FROM unnest(ARRAY[500, 0]) age")
        for boot, runs in ((1, ((5, 9, 500), (12, 20, 450), (30, 40, 400), (45, 50, 1))),  # gaps before, among the old, and before the new one
                           (2, ((0, 9, 500), (12, 20, 450))),                              # a publisher that has ended
                           (3, ((3, 9, 500), )), (4, ((7, 9, 1), )),
                           (5, ((0, 4, 450), (8, 9, 1), (12, 20, 450), (25, 30, 400)))):   # the clock was wrong
            for first, last, age in runs:
                self.sql(f"INSERT INTO axlecast.received VALUES (now() - {age} * interval '1 day', now() - {age} * interval '1 day', {boot}, {first}, "
                         f"{last}, 1, {2 if age == 1 else 1}, 'X')")
        self.sql("INSERT INTO axlecast.received VALUES ('2020-01-01', '2020-01-01', 6, 3, 4, 1, 2, 'X'), (now(), now(), 6, 7, 8, 1, 2, 'X')")
        self.assertIn(["received", "0", "3"], self.sql("SELECT * FROM axlecast.expire()"))
        self.assertNotIn("received", [row[0] for row in self.sql("SELECT * FROM axlecast.expire()")])
        self.assertEqual(self.sql("SELECT boot_id, first_seq, last_seq FROM axlecast.received ORDER BY 1, 2"),
                         [["1", "0", "40"], ["1", "45", "50"], ["2", "0", "20"], ["3", "0", "9"], ["4", "7", "9"],
                          ["5", "0", "4"], ["5", "8", "9"], ["5", "12", "20"], ["5", "25", "30"], ["6", "3", "4"], ["6", "7", "8"]])
        self.assertEqual(self.sql("SELECT boot_id, first_seq, last_seq FROM axlecast.gaps ORDER BY 1, 2"),
                         [["1", "41", "44"], ["4", "0", "6"], ["5", "5", "7"], ["5", "10", "11"], ["5", "21", "24"], ["6", "0", "2"], ["6", "5", "6"]])
        # The run that stays is continued.
        self.sql("SELECT axlecast.add_received(1, 1, '{X}', '{2}', '{21}', '{25}', ARRAY[now()], ARRAY[now()])")
        self.assertEqual(self.sql("SELECT first_seq, last_seq FROM axlecast.received WHERE boot_id = 2"), [["0", "25"]])

    def test_many_shippers_expire_once(self):
        old = ("INSERT INTO axlecast.odd (machine, log, event, channel, utime, received, cause, message, noticed) VALUES "
               "(1, 1, 1, 'X', 0, 0, '', '', now() - interval '20 years')")
        self.sql("UPDATE axlecast.retention SET keep = '1 year' WHERE kind = 'odd'; TRUNCATE axlecast.expiry")
        self.sql(old)
        self.assertIn(["odd", "0", "1"], self.sql("SELECT * FROM axlecast.expire(interval '50 min')"))
        self.sql(old)
        self.assertEqual(self.sql("SELECT * FROM axlecast.expire(interval '50 min')"), [])
        self.assertEqual(self.value("SELECT count(*) FROM axlecast.odd"), "1")
        self.sql("UPDATE axlecast.expiry SET finished = now() - interval '51 min'")
        self.assertIn(["odd", "0", "1"], self.sql("SELECT * FROM axlecast.expire(interval '50 min')"))
        self.sql(old)
        self.assertIn(["odd", "0", "1"], self.sql("SELECT * FROM axlecast.expire()"))

    def test_roles_may_do_what_they_need(self):
        self.sql("CREATE ROLE ship LOGIN IN ROLE axlecast_writer; CREATE ROLE look LOGIN IN ROLE axlecast_reader; CREATE ROLE stranger LOGIN")
        self.sql("SELECT axlecast.ensure_partitions(current_date - 40, current_date - 39)", user="ship")
        self.sql("SELECT axlecast.expire(), axlecast.expire(interval '1 h')", user="ship")
        self.sql("INSERT INTO axlecast.machine (name, installation) VALUES ('m', gen_random_uuid()); UPDATE axlecast.machine SET generation = 2", user="ship")
        self.assertEqual(self.sql("SELECT name, generation FROM axlecast.machine", user="look"), [["m", "2"]])
        self.sql("SELECT * FROM axlecast.fleet_status, axlecast.samples('m', 'x', now(), now())", user="look")
        for user, statement in (("look", "INSERT INTO axlecast.machine (name, installation) VALUES ('n', gen_random_uuid())"),
                                ("look", "SELECT axlecast.expire()"), ("stranger", "SELECT * FROM axlecast.machine"),
                                ("ship", "DELETE FROM axlecast.machine"), ("ship", "DROP TABLE axlecast.odd"),
                                ("ship", "UPDATE axlecast.retention SET keep = NULL"), ("ship", "UPDATE axlecast.position_chunk SET n = 0")):
            with self.assertRaisesRegex(SqlError, "permission denied|must be owner", msg=statement):
                self.sql(statement, user=user)


if __name__ == "__main__":
    unittest.main()
