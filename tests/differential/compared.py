"""What the differential tests share: how many cases, which random numbers, and how our programs are asked.

AXLECAST_CASES: random cases of each test (a few thousand). AXLECAST_SEED: of the random numbers."""

import json
import os
import pathlib
import random
import subprocess
import sys
import unittest

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
BIN = pathlib.Path(os.environ["AXLECAST_BIN"])
PROGRAMS = BIN.parent / "campaign"
CASES = int(os.environ.get("AXLECAST_CASES", "3000"))
SEED = int(os.environ.get("AXLECAST_SEED", "1"))
sys.path.insert(0, str(SOURCE / "tests/peers"))


def flipped(frame, chance, most=3):
    """A frame of bytes with a few inverted bits."""
    changed = bytearray(frame)
    for _ in range(chance.randint(1, most)):
        changed[chance.randrange(len(changed))] ^= 1 << chance.randrange(8)
    return bytes(changed)


def resized(frame, chance, fill):
    """A frame, or a text of bits, that lost its end or has something behind it."""
    return frame[:chance.randrange(len(frame))] if chance.random() < 0.5 else frame + fill(chance.randint(1, 3))


def decode(family, settings, lines, *options):
    """What `axlecast decode` makes of each line."""
    words = [word for setting in settings for word in ("--set", setting)]
    done = subprocess.run([BIN / "axlecast", "decode", family, *words, *options], input="".join(line + "\n" for line in lines),
                          stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode not in (0, 1):
        raise AssertionError(f"axlecast decode {family} {' '.join(words)}: exit code {done.returncode}")
    return [json.loads(line) for line in done.stdout.splitlines()]


def made(orders):
    """What frame_maker answers to each order."""
    done = subprocess.run([PROGRAMS / "frame_maker"], input="".join(order + "\n" for order in orders), stdout=subprocess.PIPE, text=True,
                          check=True)
    return done.stdout.splitlines()


class Compared(unittest.TestCase):
    """Counts what both sides accept and refuse: a test of which one half is empty shows nothing."""

    def setUp(self):
        self.chance = random.Random(f"{SEED} {self.id()}")
        self.accepted = self.refused = 0

    def tearDown(self):
        if self.accepted or self.refused:
            print(f"{self.id().rsplit('.')[-1]}: {self.accepted} frames accepted, {self.refused} refused by both", file=sys.stderr)
            self.assertGreater(min(self.accepted, self.refused), CASES // 20)

    def refuse(self, ours, where):
        self.refused += 1
        self.assertFalse(ours["ok"], where)
        self.assertFalse({"counts", "turns", "angle_deg", "registers"} & set(ours), where)
