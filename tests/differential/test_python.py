"""Random messages of every type: decoded by Python, with the code that lcm-gen generates, and by the C++ that `axlecast log cat` prints."""

import json
import math
import pathlib
import random
import struct
import subprocess
import sys
import tempfile
import unittest

import lcm_log
from compared import BIN, CASES, SEED, SOURCE

sys.path.insert(0, str(SOURCE / "tests/compatibility"))
from messages import INTEGER_BYTES, Filler, definitions, plain  # noqa: E402 pylint: disable=wrong-import-position
from test_compatibility import same  # noqa: E402 pylint: disable=wrong-import-position

BEGIN = 1_790_000_000_000_000  # us, UNIX
TEXTS = ("", "a", "axis1", "µm ±", "\"", "\\", "\n", "\x7f", "😀", "x" * 300)
REALS = (0.0, -0.0, 1.5, -1e300, 5e-324, math.inf, -math.inf, math.nan)


class RandomFiller(Filler):
    """Any value of each type, the greatest and the smallest among them; arrays of 0 to 3."""

    def __init__(self, types, chance):
        super().__init__(types)
        self.chance = chance

    def scalar(self, kind):
        chance = self.chance
        if kind in INTEGER_BYTES:
            bits = 8 * INTEGER_BYTES[kind]
            low, high = (0, 2**bits - 1) if kind == "byte" else (-2**(bits - 1), 2**(bits - 1) - 1)
            return chance.choice((low, high, 0, 1, chance.randint(low, high), chance.randint(low, high)))
        if kind == "float":
            return chance.choice((0.0, -2.5, 2.0**-140, 2.0**120, chance.randint(-2**24, 2**24) / 1024, *REALS[5:]))
        if kind == "double":
            return chance.choice((*REALS, chance.uniform(-1e6, 1e6), chance.uniform(-1e-6, 1e-6)))
        if kind == "boolean":
            return chance.random() < 0.5
        if kind == "string":
            return chance.choice(TEXTS)
        return super().scalar(kind)

    def array_size(self):
        return self.chance.randrange(4)


def is_single(value):
    """Returns True if the value may be that of a field of 32 bits, which is shown with fewer digits."""
    try:
        return struct.unpack(">f", struct.pack(">f", value))[0] == value
    except OverflowError:
        return False


def equal(decoded, shown):
    """As `same`, with numbers that JSON does not have: they are null."""
    if isinstance(decoded, dict):
        return isinstance(shown, dict) and all(name in shown and equal(value, shown[name]) for name, value in decoded.items())
    if isinstance(decoded, list) and isinstance(shown, list):
        return len(decoded) == len(shown) and all(map(equal, decoded, shown))
    if isinstance(decoded, float) and not math.isfinite(decoded):
        return shown is None
    if isinstance(decoded, float) and not is_single(decoded):
        return decoded == shown
    return same(decoded, shown)


class Messages(unittest.TestCase):
    def setUp(self):
        self.chance = random.Random(SEED)
        self.types = definitions()
        self.log = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) / "messages.lcm"

    def test_python_and_cpp_decode_the_same(self):
        filler = RandomFiller(self.types, self.chance)
        names = list(self.types)
        sent = [(name, filler.message(self.types[name]).encode()) for name in self.chance.choices(names, k=CASES)]
        lcm_log.write(self.log, [(index, name, data) for index, (name, data) in enumerate(sent)], BEGIN)
        with subprocess.Popen([BIN / "axlecast", "log", "cat", self.log], stdout=subprocess.PIPE, text=True) as cat:
            count = 0
            for (name, data), line in zip(sent, cat.stdout):
                shown = json.loads(line)
                decoded = plain(self.types[name].decode(data), self.types)
                self.assertEqual(shown["channel"], name)
                for field, value in decoded.items():
                    self.assertTrue(equal(value, shown.get(field)), f"{name}.{field}: Python {value!r}, C++ {shown.get(field)!r}")
                count += 1
        self.assertEqual((cat.returncode, count), (0, len(sent)))


if __name__ == "__main__":
    unittest.main()
