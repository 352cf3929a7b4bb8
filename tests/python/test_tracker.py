"""The tracker and the time base of Python and of C++: one table of cases for both, and equal answers to random messages."""

import enum
import math
import os
import pathlib
import random
import subprocess
import sys
import unittest
from decimal import Decimal

sys.path.insert(0, os.environ["AXLECAST_PYTHON_PACKAGE"])
# pylint: disable=wrong-import-position
import axlecast  # noqa: E402
from axlecast.position_tracker import Answer, Freshness, InstantOf, Options, PositionTracker  # noqa: E402
from axlecast.time_base import TimeBase, id_of_name, own_clock_id  # noqa: E402

ANSWERS = pathlib.Path(os.environ["AXLECAST_BIN"]).parent / "campaign/tracker_answers"
TABLE = pathlib.Path(__file__).with_name("tracker_cases.txt")
FLAGS = {"v": axlecast.position_t.FLAG_VALID, "t": axlecast.position_t.FLAG_TURNS_VALID, "s": axlecast.position_t.FLAG_SPEED_VALID,
         "r": axlecast.position_t.FLAG_REFERENCED, "i": axlecast.position_t.FLAG_IMPLAUSIBLE}
MS, US = 1_000_000, 1_000  # ns
OWN, OTHER = 5, 77  # clocks

# The lines of a script as dictionaries, with these values if the table does not state others.
CASE = {"max_age_ns": 0, "max_extrapolation_ns": -1, "max_gap_ns": -1, "machine_id": 0, "clock_id": OWN, "time": 0,
        "max_time_half_width_ns": 0, "instant": 0}
POSITION = {"boot_id": 5, "machine_id": 1, "clock_id": OWN, "time_uncertainty_ns": 2 * US, "missed": 0, "counts_per_turn": 131_072,
            "speed_rad_s": math.nan, "datum_epoch": 0, "flags": FLAGS["v"] | FLAGS["t"]}
DEVICE = {"boot_id": 5, "machine_id": 1, "poll_us": 1_000, "publish_us": 1_000, "max_age_us": 20_000, "counts_per_turn": 131_072,
          "ratio_num": 1, "ratio_den": 1, "per_turn": 360.0, "modulo": 0.0}
TIME = {"boot_id": 1, "machine_id": 1, "base_id": 9, "epoch": 0, "half_width_ns": 100 * US,
        "grade": axlecast.time_quality_t.GRADE_PROVEN, "growth_ppb": 600_000, "valid_ms": 1_000}


def ns(text):
    return int((Decimal(text) * MS).to_integral_value())


def thousandfold(text):
    """us as ns, or ms as us."""
    return int((Decimal(text) * 1_000).to_integral_value())


def flags_of(text):
    return 0 if text == "-" else sum(FLAGS[letter] for letter in text)


# What a key of the table means in a line of the script.
CASE_KEYS = {"max_age": ("max_age_ns", ns), "max_extrapolation": ("max_extrapolation_ns", ns), "max_gap": ("max_gap_ns", ns),
             "machine": ("machine_id", int), "time": ("time", lambda text: int(text == "yes")),
             "max_half_width": ("max_time_half_width_ns", thousandfold),
             "instant": ("instant", lambda text: list(InstantOf).index(InstantOf[text.upper()]))}
MESSAGE_KEYS = {"boot": ("boot_id", int), "machine": ("machine_id", int), "clock": ("clock_id", int), "seq": ("seq", int),
                "got": ("received_ns", ns), "uncertainty": ("time_uncertainty_ns", thousandfold), "missed": ("missed", int),
                "speed": ("speed_rad_s", float), "epoch": ("datum_epoch", int), "flags": ("flags", flags_of),
                "poll": ("poll_us", thousandfold), "publish": ("publish_us", thousandfold), "max_age": ("max_age_us", thousandfold),
                "cpt": ("counts_per_turn", int), "num": ("ratio_num", int), "den": ("ratio_den", int), "per_turn": ("per_turn", float),
                "modulo": ("modulo", float)}
TIME_KEYS = {"half": ("half_width_ns", thousandfold), "base_id": ("base_id", int), "epoch": ("epoch", int), "now": ("now_ns", ns),
             "grade": ("grade", lambda text: getattr(axlecast.time_quality_t, "GRADE_" + text.upper()))}


def values(words, keys):
    return {keys[key][0]: keys[key][1](text) for key, text in (word.split("=") for word in words)}


class Step:
    """A line of the table: of a script, with the answer that is expected."""

    def __init__(self, case, number, line, expected=None):
        self.case, self.number, self.line, self.expected = case, number, line, expected


def steps_of(table):
    """The steps of the table. `positions FROM COUNT COUNTS STEP` is COUNT messages, 1 ms and STEP counts apart."""
    case, seq = "", 0
    for number, text in enumerate(table.splitlines(), 1):
        words, _, expected = text.partition("->")
        command, *words = words.split() or [""]
        if command in ("", "#"):
            continue
        if command == "case":
            case, seq = text[5:], 0
            options = [word for word in words if "=" in word]
            yield Step(case, number, {"command": "case", **CASE, **values(options, CASE_KEYS)})
        elif command == "position":
            line = {"command": command, "mono_ns": ns(words[0]), "received_ns": ns(words[0]) + 200 * US, "counts": int(words[1]),
                    "seq": seq, **POSITION, **values(words[2:], MESSAGE_KEYS)}
            seq = line["seq"] + 1
            yield Step(case, number, line, expected.split())
        elif command == "positions":
            first, count, counts, step = map(int, words)
            for i in range(count):
                yield Step(case, number, {"command": "position", "mono_ns": (first + i) * MS, "received_ns": (first + i) * MS,
                                          "counts": counts + i * step, "seq": seq + i, **POSITION}, ["used"])
            seq += count
        elif command == "device":
            yield Step(case, number, {"command": command, **DEVICE, **values(words, MESSAGE_KEYS)})
        elif command == "time":
            line = {"command": command, "clock_id": int(words[0]), "mono_ns": ns(words[1]), "base_ns": ns(words[2]),
                    "now_ns": ns(words[1]), **TIME, **values(words[3:], TIME_KEYS)}
            yield Step(case, number, line)
        elif command == "totals":
            yield Step(case, number, {"command": command}, expected.split())
        else:
            yield Step(case, number, {"command": command, "ns": ns(words[0])}, expected.split())


def message_of(kind, line):
    message = kind()
    for key, value in line.items():
        if key in kind.__slots__:
            setattr(message, key, value)
    return message


def bare(value):
    """As the C++ program prints it: an enumeration is the number of its value."""
    if isinstance(value, enum.Enum):
        return list(type(value)).index(value)
    return int(value) if isinstance(value, bool) else value


class InPython:
    """Answers the lines of a script with the Python tracker."""

    tracker, time_base = PositionTracker(), TimeBase()

    def answer(self, line):
        return [bare(value) for value in getattr(self, line["command"])(line)]

    def case(self, line):
        self.time_base = TimeBase()
        options = {key: value for key, value in line.items() if key not in ("command", "time", "instant")}
        self.tracker = PositionTracker(Options(**options, time=self.time_base if line["time"] else None,
                                               instant=list(InstantOf)[line["instant"]]))
        return []

    def position(self, line):
        return self.tracker.on_position(message_of(axlecast.position_t, line), line["received_ns"])

    def device(self, line):
        self.tracker.on_device(message_of(axlecast.device_info_t, line))
        return []

    def time(self, line):
        self.time_base.on_time(message_of(axlecast.time_quality_t, line), line["now_ns"])
        return []

    def check(self, line):
        return [self.tracker.check(line["ns"])]

    def age(self, line):
        return [self.tracker.age_ns(line["ns"])]

    @staticmethod
    def numbers(position):
        return [position.answer, position.counts, position.value, position.timing_error_counts, position.flags, position.datum_epoch]

    def at(self, line):
        return self.numbers(self.tracker.at(line["ns"]))

    def newest(self, line):
        return self.numbers(self.tracker.newest(line["ns"]))

    def totals(self, _):
        totals = self.tracker.totals
        return [totals.received, totals.lost, totals.late, totals.restarts, totals.datum_changes, totals.missed_readings,
                totals.two_publishers, totals.other_machine]

    def on_clock(self, line):
        instant = self.time_base.on_clock(line["clock_id"], line["of"], line["ns"], line["now_ns"])
        return [instant.answer, instant.ns, instant.half_width_ns, instant.base_id]


def in_python(script):
    player = InPython()
    return [player.answer(line) for line in script]


def number(text):
    return float.fromhex(text) if "x" in text or "n" in text else int(text)


def in_cpp(script):
    text = "".join(line["command"] + "".join(f" {key}={value!r}" for key, value in line.items() if key != "command") + "\n"
                   for line in script)
    run = subprocess.run([ANSWERS], input=text, capture_output=True, text=True, check=True)
    return [[number(word) for word in line.split()] for line in run.stdout.splitlines()]


def equal(a, b):
    if isinstance(a, float) or isinstance(b, float):
        return math.isnan(a) and math.isnan(b) or math.isclose(a, b, rel_tol=1e-12, abs_tol=1e-12)
    return a == b


class Table(unittest.TestCase):
    """Every case of tracker_cases.txt, in both languages."""

    NAMES = {"at": ("counts", "value", "error", "flags", "epoch"),
             "totals": ("received", "lost", "late", "restarts", "datum_changes", "missed", "two_publishers", "other_machine")}

    def test_both_answer_as_the_table(self):
        steps = list(steps_of(TABLE.read_text(encoding="utf-8")))
        script = [step.line for step in steps]
        asked = {(step.number, step.case) for step in steps if step.expected is not None}
        self.assertGreaterEqual(len(asked), 200)
        for language, answers in (("C++", in_cpp(script)), ("Python", in_python(script))):
            self.assertEqual(len(answers), len(steps))
            for step, answer in zip(steps, answers):
                if step.expected is not None:
                    with self.subTest(language=language, case=step.case, line=step.number):
                        self.assertTrue(step.expected, "no answer is expected")
                        getattr(self, "check_" + step.line["command"])(step.expected, answer)

    def check_position(self, expected, answer):
        used, restarted, datum, lost = answer
        words = ["used" if used else "ignored", *["restarted"] * restarted, *["datum"] * datum, *([f"lost={lost}"] if lost else [])]
        self.assertEqual(words, expected)

    def check_check(self, expected, answer):
        self.assertEqual([list(Freshness)[answer[0]].name.lower()], expected)

    def check_age(self, expected, answer):
        self.assertEqual(answer[0], -1 if expected == ["none"] else ns(expected[0]))

    def check_at(self, expected, answer):
        self.assertEqual(list(Answer)[answer[0]].name.lower(), expected[0])
        self.check_values("at", expected[1:], answer[1:])

    check_newest = check_at

    def check_totals(self, expected, answer):
        self.check_values("totals", expected, answer)

    def check_values(self, kind, expected, answer):
        values_of = dict(zip(self.NAMES[kind], answer))
        for word in expected:
            key, text = word.split("=")
            wanted = flags_of(text) if key == "flags" else float(text)
            self.assertTrue(equal(float(values_of[key]), float(wanted)), f"{key} is {values_of[key]}, not {text}")


class Random(unittest.TestCase):
    """Whatever arrives, both give the same answers."""

    CASES, LINES = 1_500, 40

    def setUp(self):
        self.random = random.Random(7)

    def rarely(self, usual, *others):
        return usual if self.random.random() < 0.9 else self.random.choice(others)

    def options(self):
        chosen = self.random
        return {"command": "case", **CASE, "max_age_ns": chosen.choice([0, 0, 5 * MS, 200 * MS]),
                "max_extrapolation_ns": chosen.choice([-1, 0, 30 * MS]), "max_gap_ns": chosen.choice([-1, -1, 3 * MS]),
                "machine_id": chosen.choice([0, 0, 1]), "time": chosen.randrange(2), "max_time_half_width_ns": chosen.choice([0, MS, MS]),
                "instant": chosen.choice([0, 0, 0, 1, 2])}

    def position(self, now, seq, usual_clock):
        chosen = self.random
        clock = self.rarely(usual_clock, 0, OWN, OTHER)
        return {"command": "position", **POSITION, "mono_ns": now + (1_000_000 * MS if clock == OTHER else 0) + self.rarely(0, -MS, 3 * MS),
                "received_ns": now + chosen.randrange(MS), "seq": self.rarely(seq, seq - 2, seq + 9, 2**63 - 1, -2**63),
                "boot_id": self.rarely(5, 6), "machine_id": self.rarely(1, 0, 2), "clock_id": clock,
                "counts": self.rarely(chosen.randrange(-10**6, 10**6), 2**63 - 1, -2**63), "flags": self.rarely(3, 0, 1, 2, 0x13, 0x100),
                "speed_rad_s": self.rarely(math.nan, 0.0, -4.0, 1e300), "datum_epoch": self.rarely(0, 1), "missed": self.rarely(0, 3),
                "time_uncertainty_ns": chosen.randrange(300 * US)}

    def device(self):
        return {"command": "device", **DEVICE, "boot_id": self.rarely(5, 6), "machine_id": self.rarely(1, 2), "poll_us": self.rarely(1_000, 0),
                "publish_us": self.random.choice([1_000, 20_000]), "max_age_us": self.rarely(20_000, 0, 300_000),
                "ratio_num": self.rarely(1, -7), "ratio_den": self.rarely(1, 0, 3), "modulo": self.random.choice([0.0, 360.0, 1e-3])}

    def times(self, now):
        for clock, ahead in ((OWN, 0), (OTHER, 1_000_000 * MS)):
            yield {"command": "time", "clock_id": clock, "now_ns": now, **TIME, "mono_ns": now + ahead + self.rarely(0, -50 * MS),
                   "base_ns": now + 500 * MS + self.random.randrange(20 * US), "half_width_ns": self.rarely(50 * US, -1, 4 * MS),
                   "base_id": self.rarely(9, 8, 0), "epoch": self.rarely(0, 1), "grade": self.rarely(TIME["grade"], 1),
                   "valid_ms": self.rarely(1_000, 3), "machine_id": self.rarely(1, 2)}

    def script(self):
        now, clock = 1_000 * MS, self.random.choice([OWN, OTHER])
        yield self.options()
        for seq in range(self.LINES):
            now += self.random.randrange(20 * MS)
            if self.random.random() < 0.15:
                yield self.device()
            if self.random.random() < 0.3:
                yield from self.times(now)
            yield self.position(now, seq, clock)
            for command in ("check", "age", "newest", "at", "at", "at"):
                yield {"command": command, "ns": now + self.random.randrange(-60 * MS, 40 * MS)}
            yield {"command": "at", "ns": now}
            yield {"command": "on_clock", "clock_id": OWN, "of": OTHER, "now_ns": now,
                   "ns": now + 1_000_000 * MS + self.random.randrange(-100 * MS, 20 * MS)}
        yield {"command": "totals"}

    def test_both_give_equal_answers(self):
        script = [line for _ in range(self.CASES) for line in self.script()]
        expected, answers = in_cpp(script), in_python(script)
        self.assertEqual(len(expected), len(script))
        known = collected = 0
        for line, wanted, answer in zip(script, expected, answers):
            if len(wanted) != len(answer) or not all(map(equal, wanted, answer)):
                self.fail(f"{line}: C++ {wanted}, Python {answer}")
            if line["command"] in ("at", "newest"):
                known += answer[0] <= list(Answer).index(Answer.EXTRAPOLATED)
                collected |= 1 << answer[0]
        self.assertGreater(known, self.CASES, "most answers state that nothing is known")
        missing = [answer.name for i, answer in enumerate(Answer) if not collected >> i & 1]
        self.assertEqual(missing, [])


class Names(unittest.TestCase):
    def test_the_id_of_a_name_is_fnv_1a(self):
        # http://www.isthe.com/chongo/tech/comp/fnv/ gives these for 64 bits.
        self.assertEqual(id_of_name("a") % 2**64, 0xAF63DC4C8601EC8C)
        self.assertEqual(id_of_name("foobar") % 2**64, 0x85944171F73967E8)

    def test_the_clock_of_this_process_is_that_of_a_driver(self):
        self.assertNotEqual(own_clock_id(), 0)


if __name__ == "__main__":
    unittest.main()
