"""What `axlecast log convert` and the metrics write, with awkward values, read by other readers: CSV by Python's csv module and by pandas,
MCAP by its own TypeScript library, the page for Prometheus by Prometheus' Python client. Every value must return."""

import csv
import io
import json
import math
import os
import random
import struct
import subprocess
import sys
import unittest

import pandas
from compared import CASES, PROGRAMS, SEED, SOURCE
from prometheus_client.parser import text_string_to_metric_families

sys.path.insert(0, str(SOURCE / "tests/convert"))
from example_log import START, Converted, peer  # noqa: E402

DOUBLES = (math.nan, -math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, -5e-324, 2.2250738585072014e-308, 1.7976931348623157e308, 0.1, 1e22,
           2.0**53 + 2, 1 / 3)
PIECES = ("a", "\"", "\"\"", ",", ";", "\n", "\r\n", "\r", "\t", " ", "'", "=", "+", "-", "@", "\\", "é", "€", "😀", "NaN", "null", "1e5", "0x10")
SINGLES = ("voltage_v", "current_a", "accel_mps2")  # fields of 32 bits
FORMULAS = "=+-@\t\r"  # a cell that begins so gets an apostrophe, unless it is a number: docs/convert.md


def single(value):
    """The nearest number of 32 bits."""
    return struct.unpack("f", struct.pack("f", value))[0]


class Random(random.Random):
    def double(self):
        return self.choice(DOUBLES) if self.random() < 0.4 else struct.unpack("d", self.randbytes(8))[0]

    def single(self):
        value = self.choice(DOUBLES) if self.random() < 0.4 else struct.unpack("f", self.randbytes(4))[0]
        return single(value) if not math.isfinite(value) or abs(value) < 3e38 else 1.5

    def integer(self, bits):
        return self.choice((0, -1, 2**(bits - 1) - 1, -2**(bits - 1), 2**53 + 1 if bits > 54 else 7, self.getrandbits(bits) - 2**(bits - 1)))

    def text(self, longest):
        text = ""
        while self.random() < 0.8:
            text += self.choice(PIECES)
        return text.encode()[:longest].decode(errors="ignore")


class Messages(Converted):
    """Random messages of three types, as a log, and what each field must be."""

    def setUp(self):
        super().setUp()
        self.chance = Random(f"{SEED} {self.id()}")
        self.sent = []  # {name of a field: value}
        for number in range(CASES // 3):
            self.chance.choice((self.position, self.motor, self.alarm))(START + number)

    def add(self, channel, kind, at, **fields):
        self.log.add(at, channel, self.log.message(kind, at, self.chance.integer(64), **fields))
        self.sent.append({"log_utime": at, "channel": channel, **fields})

    def position(self, at):
        chance = self.chance
        self.add("POSITION/axis1", "position_t", at, counts=chance.integer(64), raw_counts=chance.integer(64), tick=chance.integer(64),
                 value=chance.double(), angle_rad=chance.double(), speed_rad_s=chance.double(), missed=chance.integer(32), unit=4)

    def motor(self, at):
        chance = self.chance
        self.add("MOTOR/gm1", "motor_health_t", at, voltage_v=chance.single(), current_a=chance.single(), trip_count=chance.integer(32),
                 accel_mps2=[chance.single() for _ in range(3)], analog_mono_ns=chance.integer(64))

    def alarm(self, at):
        chance, entries = self.chance, []
        for _ in range(chance.randrange(4)):
            entry = self.log.types.alarm_entry_t()
            entry.code, entry.name, entry.action = chance.integer(32), chance.text(24), chance.text(80)
            entries.append(entry)
        fields = {"device": chance.text(24), "n": len(entries), "entries": entries, "revision": chance.integer(64)}
        self.add(f"ALARM/{chance.choice(('a,1', 'b 2', 'c;3', 'd€'))}", "alarm_t", at, **fields)

    def same_number(self, name, value, read):
        """Also of -0. A number of 32 bits may be written with so many digits as distinguish it from other numbers of 32 bits."""
        if name.startswith(SINGLES):
            read = single(read)
        self.assertEqual((read, math.copysign(1, read)), (value, math.copysign(1, value)), name)

    @staticmethod
    def flat(fields):
        """Each cell: (its column, the value)."""
        for name, value in fields.items():
            if name == "entries":
                for place, entry in enumerate(value):
                    yield from ((f"entries[{place}].{part}", getattr(entry, part)) for part in ("code", "name", "action"))
            elif isinstance(value, list):
                yield from ((f"{name}[{place}]", item) for place, item in enumerate(value))
            else:
                yield name, value


class Csv(Messages):
    def compare(self, name, value, cell):
        if isinstance(value, str):
            guarded = value[:1] in FORMULAS and not self.is_number(value)
            self.assertEqual(cell, "'" + value if value and guarded else value)
        elif isinstance(value, int):
            self.assertEqual(int(cell), value, name)
        elif not math.isfinite(value):
            self.assertEqual(cell, "", name)
        else:
            self.same_number(name, value, float(cell))

    @staticmethod
    def is_number(text):
        try:
            float(text)
        except ValueError:
            return False
        return text.strip() == text and text[:1] != "+"  # which no number of ours has

    def compare_all(self, rows):
        self.assertEqual(len(rows), len(self.sent))
        for row, fields in zip(rows, self.sent, strict=True):
            for name, value in self.flat(fields):
                self.compare(name, value, row[name])

    def test_csv_of_python_and_pandas(self):
        out = self.convert("csv")
        with open(out, newline="", encoding="utf-8") as file:
            self.compare_all(list(csv.DictReader(file, strict=True)))
        table = pandas.read_csv(out, dtype=str, keep_default_na=False, encoding="utf-8", lineterminator=None)
        self.compare_all(table.to_dict("records"))


class Mcap(Messages):
    def test_mcap_of_its_own_library(self):
        found = json.loads(peer("node", os.environ["MCAP_READER"] + "/read.mjs", self.convert("mcap")))["messages"]
        self.assertEqual(len(found), len(self.sent))
        for message, fields in zip(found, self.sent, strict=True):
            self.assertEqual((message["topic"], int(message["logTime"]), message["encoding"]),
                             (fields["channel"], 1_000 * fields["log_utime"], "json"))
            content = json.loads(bytes.fromhex(message["hex"]))
            for name, value in self.flat({name: value for name, value in fields.items() if name not in ("log_utime", "channel", "n")}):
                read = content
                for part in name.replace("]", "").replace(".", "[").split("["):
                    read = read[int(part) if part.isdigit() else part]
                if isinstance(value, float):
                    self.number(name, value, read)
                else:
                    self.assertEqual(read, value, name)

    def number(self, name, value, read):
        if math.isfinite(value):
            self.same_number(name, value, float(read))
        else:
            self.assertIsNone(read, name)


class Prometheus(unittest.TestCase):
    def test_page_of_prometheus_client(self):
        chance, samples = Random(f"{SEED} {self.id()}"), {}
        for _ in range(CASES):
            labels = (chance.text(40).replace("\r", "").replace("\t", ""), chance.text(40).replace("\r", "").replace("\t", ""))
            samples.setdefault(labels, chance.integer(64) if chance.random() < 0.3 else chance.double())
        orders = io.StringIO()
        for labels, value in samples.items():
            texts = " ".join(text.encode().hex() or "-" for text in labels)
            orders.write(f"{texts} i {value}\n" if isinstance(value, int) else f"{texts} d {struct.pack('>d', value).hex()}\n")
        page = subprocess.run([PROGRAMS / "exposition_page"], input=orders.getvalue().encode(), stdout=subprocess.PIPE, check=True).stdout.decode()
        (family,) = text_string_to_metric_families(page)
        self.assertEqual((family.name, family.documentation, family.type), ("axlecast_sample", "Random samples.", "gauge"))
        self.assertEqual(len(family.samples), len(samples))
        for sample, (labels, value) in zip(family.samples, samples.items(), strict=True):
            self.assertEqual(sample.labels, {"bus": labels[0], "kind": labels[1]})
            expected = float(value)
            if math.isnan(expected):
                self.assertTrue(math.isnan(sample.value), labels)
            else:
                self.assertEqual((sample.value, math.copysign(1, sample.value)), (expected, math.copysign(1, expected)), labels)
        done = subprocess.run(["promtool", "check", "metrics"], input=page.encode(), capture_output=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    unittest.main()
