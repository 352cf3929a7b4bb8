"""CSV, read by Python's csv module and by sqlite3."""

import csv
import math
import unittest

from example_log import COUNTS_PER_TURN, START, VALID, Converted, peer


def rows(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file, strict=True))


class AsItIs(Converted):
    def test_every_field_of_every_position(self):
        for i in range(50):
            speed = math.nan if i % 3 == 0 else 0.1 * i
            self.log.position("axis1", START + 5_000 * i, i, -700 + 123 * i, speed=speed)
        found = rows(self.convert("csv"))
        self.assertEqual(len(found), 50)
        for (utime, channel, data), row in zip(self.log.events, found, strict=True):
            sent = self.log.types.position_t.decode(data)
            self.assertEqual((int(row["log_utime"]), row["channel"]), (utime, channel))
            self.assertEqual(int(row["boot_id"], 16), sent.boot_id)
            for name in ("utime", "mono_ns", "seq", "counts", "raw_counts", "unit", "flags"):
                self.assertEqual(int(row[name]), getattr(sent, name), name)
            self.assertEqual(float(row["value"]), sent.value)
            self.assertEqual(row["speed_rad_s"], "" if math.isnan(sent.speed_rad_s) else repr(sent.speed_rad_s))
            self.assertEqual(row["spare[1]"], "0")
            self.assertNotIn(None, row)

    def test_several_types_lists_and_awkward_text(self):
        entry = self.log.types.alarm_entry_t()
        entry.name, entry.action = 'a "quoted", name', "first line\r\nsecond"
        self.log.add(START, "ALARM/a,1", self.log.message("alarm_t", START, 0, device="x", n=1, entries=[entry]))
        self.log.add(START + 1, "ALARM/a,1", self.log.message("alarm_t", START, 1, device="y"))
        self.log.position("axis1", START + 10, 0, 5)
        self.log.add(START + 500, "CAMERA", b"no message of ours")
        alarm, empty, position = rows(self.convert("csv"))
        self.assertEqual(alarm["entries[0].name"], 'a "quoted", name')
        self.assertEqual(alarm["entries[0].action"], "first line\r\nsecond")
        self.assertEqual((alarm["channel"], alarm["counts"]), ("ALARM/a,1", ""))
        self.assertEqual((empty["device"], empty["entries[0].name"]), ("y", ""))
        self.assertEqual((position["counts"], position["device"]), ("5", ""))

    def test_sqlite_imports_it(self):
        for i in range(100):
            self.log.position("axis1", START + 1_000 * i, i, 10 * i)
        out = self.convert("csv")
        database = self.folder / "log.db"
        peer("sqlite3", database, f".import --csv {out} positions")
        sums = peer("sqlite3", database, "select count(*), sum(counts), min(channel), count(distinct seq) from positions")
        self.assertEqual(sums.strip(), f"100|{sum(10 * i for i in range(100))}|POSITION/axis1|100")

    def test_one_channel_and_a_span_of_time(self):
        for i in range(20):
            self.log.position("axis1", START + 1_000_000 * i, i, i)
            self.log.position("axis2", START + 1_000_000 * i, i, i)
        found = rows(self.convert("csv", "--channel", "axis2$", "--from", "2025-11-21T16:00:05", "--until",
                                  "2025-11-21T16:00:10"))
        self.assertEqual([(row["channel"], row["seq"]) for row in found],
                         [("POSITION/axis2", str(i)) for i in range(5, 10)])


class OnAGrid(Converted):
    """Against a second interpolation, written here."""

    def line(self, readings, at, max_age):
        before = [r for r in readings if r[0] <= at]
        after = [r for r in readings if r[0] >= at]
        if not before or not after or before[-1][3] != after[0][3]:
            return None
        (t0, c0, f0, _), (t1, c1, f1, _) = before[-1], after[0]
        if not f0 & f1 & VALID or t1 - t0 > max_age:
            return None
        return c0 if t1 == t0 else c0 + (c1 - c0) * (at - t0) / (t1 - t0)

    def test_positions_of_two_axes(self):
        readings = {"axis1": [], "axis2": []}
        for name, period, max_age in (("axis1", 3_300, 20_000), ("axis2", 7_000, 30_000)):
            self.log.device(name, START, max_age_us=max_age)
            for i in range(400):
                at = START + 1_000 + period * i
                if name == "axis1" and 100 <= i < 110:
                    continue  # a gap of 33 ms
                flags = 0 if i in (200, 201) else VALID | 2
                counts = round(40_000 * math.sin(at / 300_000))
                self.log.position(name, at, i, counts, flags=flags)
                readings[name].append((at, counts, flags, 0))
        found = rows(self.convert("csv", "--grid", "10ms"))
        times = [int(row["utime"]) for row in found]
        self.assertEqual(times, list(range(times[0], times[-1] + 1, 10_000)))
        self.assertEqual(times[0], START + 10_000)
        self.assertGreaterEqual(times[-1], START + 7_000 * 399 - 10_000)
        known = 0
        for row in found:
            at = int(row["utime"])
            for name, max_age in (("axis1", 20_000), ("axis2", 30_000)):
                counts = self.line(readings[name], at, max_age)
                before = [r for r in readings[name] if r[0] <= at]
                if counts is None:
                    self.assertEqual((row[f"POSITION/{name}:counts"], row[f"POSITION/{name}:value"]), ("", ""), at)
                    continue
                known += 1
                self.assertAlmostEqual(float(row[f"POSITION/{name}:counts"]), counts, delta=1e-3)
                self.assertAlmostEqual(float(row[f"POSITION/{name}:value"]), counts * 5 / COUNTS_PER_TURN, places=6)
                self.assertEqual(int(row[f"POSITION/{name}:flags"]), before[-1][2])
        self.assertGreater(known, 350)

    def test_modulo_wraps_between_readings(self):
        self.log.device("table", START, per_turn=360.0, modulo=360.0)
        turn = COUNTS_PER_TURN
        for i, counts in enumerate((turn - 1_000, turn + 1_000)):
            self.log.position("table", START + 10_000 + 10_000 * i, i, counts, per_turn=360.0)
        found = rows(self.convert("csv", "--grid", "5ms"))
        middle = next(row for row in found if int(row["utime"]) == START + 15_000)
        self.assertEqual(float(middle["POSITION/table:counts"]), turn)
        self.assertAlmostEqual(float(middle["POSITION/table:value"]), 0.0)

    def test_without_its_device_message_there_are_counts(self):
        for i in range(10):
            self.log.position("axis1", START + 1_000 * i, i, i)
        said = self.axlecast("convert", "--to", "csv", "--grid", "2ms", "-o", self.folder / "out.csv")
        self.assertIn("no DEVICE message", said)
        found = rows(self.folder / "out.csv")
        self.assertEqual([(row["POSITION/axis1:counts"], row["POSITION/axis1:value"]) for row in found],
                         [(str(i), "") for i in range(0, 9, 2)])

    def test_a_clock_that_jumped_is_no_endless_file(self):
        self.log.position("axis1", START, 0, 1)
        self.log.position("axis1", START * 2, 1, 1)
        said = self.axlecast("convert", "--to", "csv", "--grid", "1ms", "-o", self.folder / "out.csv", exit_code=1)
        self.assertIn("100,000,000 rows", said)


class Files(Converted):
    def test_a_file_that_is_there_stays_without_force(self):
        self.log.position("axis1", START, 0, 1)
        out = self.folder / "out.csv"
        out.write_text("precious")
        self.assertIn("--force", self.axlecast("convert", "--to", "csv", "-o", out, exit_code=2))
        self.assertEqual(out.read_text(), "precious")
        self.axlecast("convert", "--to", "csv", "-o", out, "--force")
        self.assertEqual(len(rows(out)), 1)
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["machine.log", "out.csv"])

    def test_standard_output(self):
        self.log.position("axis1", START, 0, 1)
        self.axlecast("convert", "--to", "csv", "-o", "-")
        self.assertEqual(len(self.said.splitlines()), 2)

    def test_a_damaged_log_is_converted_and_said_so(self):
        for i in range(100):
            self.log.position("axis1", START + 1_000 * i, i, i)
        self.log.write(self.path)
        data = bytearray(self.path.read_bytes())
        size = len(data) // 100
        data[10 * size:10 * size + 4] = b"\0\0\0\0"
        self.path.write_bytes(data)
        out = self.convert("csv", exit_code=3)
        self.assertEqual([int(row["seq"]) for row in rows(out)], [i for i in range(100) if i != 10])

    def test_what_is_no_log(self):
        self.path.write_text("text\n" * 100)
        self.axlecast("convert", "--to", "csv", "-o", self.folder / "out.csv", exit_code=1)
        self.assertFalse((self.folder / "out.csv").exists())


if __name__ == "__main__":
    unittest.main()
