"""The examples in C, Java, Go and Python print the same positions of a simulated axis, and the same about readings of every kind."""

import os
import pathlib
import re
import subprocess
import sys
import threading
import time
import unittest

from machine import Machine, one_axis, wait_for

PACKAGE = pathlib.Path(os.environ["AXLECAST_PYTHON_PACKAGE"])
sys.path.insert(0, str(PACKAGE))
import axlecast  # noqa: E402 pylint: disable=wrong-import-position
from axlecast.receiver import Sender  # noqa: E402 pylint: disable=wrong-import-position

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
WORK = pathlib.Path(os.environ["AXLECAST_CONSUMERS"])
URL = "udpm://239.255.76.67:7667?ttl=0"
EXAMPLES = {
    "C": [WORK / "print_position_c"],
    "Go": [WORK / "print_position"],
    "Java": ["java", "-cp", os.environ["AXLECAST_JAVA_PATH"], "PrintPosition"],
    "Python": [sys.executable, "-B", SOURCE / "client/example/print_position.py"],
}
LINE = re.compile(r"(POSITION/\S+) (-?\d+\.\d{3}|not valid|too old) (\d+) lost\n")
FIRST = 0.125  # the value of the messages until an example receives


class Example:
    """A running example, and the lines that it has printed."""

    def __init__(self, case, language, *words):
        self.lines = []
        self._process = subprocess.Popen([*EXAMPLES[language], *words], stdout=subprocess.PIPE, text=True,
                                         env={**os.environ, "PYTHONPATH": str(PACKAGE)})
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        case.addCleanup(self._close)

    def _read(self):
        for line in self._process.stdout:
            self.lines.append(line)

    def _close(self):
        self._process.kill()
        self._process.wait()
        self._reader.join()
        self._process.stdout.close()

    def positions(self):
        """(channel, value, lost) of each line with a number."""
        found = [match.groups() for line in list(self.lines) if (match := LINE.fullmatch(line))]
        return [(channel, float(value), int(lost)) for channel, value, lost in found if value[-1].isdigit()]


class Positions(Machine):
    def equal_to_python(self, language):
        """Runs an example beside the one in Python: both print the same readings of a turning axis, and lose none."""
        examples = [Example(self, "Python", URL), Example(self, language, URL)]
        config = self.write(one_axis(simulate="{speed_rpm: 60}"))
        self.simulator(config, "rs485-0")
        self.driver(config, "rs485-0")
        wait_for(lambda: all(len(example.positions()) > 400 for example in examples),
                 lambda: f"400 positions of each: {[example.lines[-3:] for example in examples]}")
        python, other = (example.positions() for example in examples)
        shift = next(shift for shift in range(-300, 300) if similar(*overlapping(python, other, shift)))
        pairs = list(zip(*overlapping(python, other, shift)))
        self.assertGreaterEqual(len(pairs), 100)
        self.assertGreater(len({value for _, value, _ in other}), 100, "the axis turns")
        for ours, theirs in pairs:
            self.assertEqual((ours[0], theirs[0]), ("POSITION/axis1",) * 2)
            self.assertAlmostEqual(ours[1], theirs[1], delta=0.0015)  # Java rounds halves up
        self.assertEqual({lost for _, _, lost in python + other}, {0})

    def test_c(self):
        self.equal_to_python("C")

    def test_go(self):
        self.equal_to_python("Go")

    def test_java(self):
        self.equal_to_python("Java")


def overlapping(first, second, shift):
    """Two lists from where the second begins `shift` later than the first."""
    return first[max(0, shift):], second[max(0, -shift):]


def similar(first, second):
    return len(first) > 20 and len(second) > 20 and all(abs(a[1] - b[1]) < 0.0015 for a, b in zip(first[:20], second[:20]))


class Readings(unittest.TestCase):
    """What the examples make of readings that a test sends."""

    def send(self, sender, seq, value=1.25, channel="POSITION/axis1", **members):
        position = axlecast.position_t()
        position.utime, position.boot_id, position.seq, position.value = time.time_ns() // 1000, 7, seq, value
        position.flags = axlecast.position_t.FLAG_VALID
        for name, member in members.items():
            setattr(position, name, member)
        sender.publish(channel, position)

    def started(self, language, sender, *words):
        """An example that receives: the first message is sent until it has printed something."""
        example = Example(self, language, *words)

        def prints():
            self.send(sender, 0, FIRST)
            return any(f" {FIRST:.3f} " in line for line in example.lines)
        wait_for(prints, f"the first line of the example in {language}")
        return example

    def after(self, example, text):
        """The lines behind those of the first message, up to one with `text`."""
        wait_for(lambda: any(text in line for line in example.lines), lambda: f"{text}: {example.lines}")
        lines = [line for line in example.lines if f" {FIRST:.3f} " not in line]
        return lines[:next(index for index, line in enumerate(lines) if text in line) + 1]

    def test_not_valid_and_too_old(self):
        for language, old in (("C", "too old"), ("Java", "too old"), ("Go", "1.500"), ("Python", "1.500")):
            with self.subTest(language), Sender(URL) as sender:
                example = self.started(language, sender, URL)
                self.send(sender, 1, flags=0)
                self.send(sender, 2, 1.5, utime=time.time_ns() // 1000 - 2_000_000)
                self.send(sender, 3, 9.0)
                self.assertEqual(self.after(example, "9.000"), ["POSITION/axis1 not valid 0 lost\n", f"POSITION/axis1 {old} 0 lost\n",
                                                                "POSITION/axis1 9.000 0 lost\n"])

    def test_what_was_lost(self):
        for language in EXAMPLES:
            with self.subTest(language), Sender(URL) as sender:
                example = self.started(language, sender, URL)
                self.send(sender, 1)
                sender._number += 3  # pylint: disable=protected-access # three datagrams that nobody receives
                self.send(sender, 5, 9.0)
                self.assertEqual(self.after(example, "9.000")[-1], "POSITION/axis1 9.000 3 lost\n")

    def test_only_the_channels_of_the_prefix(self):
        for language in EXAMPLES:
            with self.subTest(language), Sender(URL) as sender, Sender(URL, prefix="press3.") as own:
                example = self.started(language, own, URL, "press3.")
                self.send(sender, 1, 5.0)
                self.send(own, 1, 9.0)
                self.assertEqual(self.after(example, "9.000"), ["POSITION/axis1 9.000 0 lost\n"])


class Page(unittest.TestCase):
    def test_the_page_names_every_example(self):
        page = (SOURCE / "docs/consumers.md").read_text(encoding="utf-8")
        for name in ("client/example/print_position.c", "client/example/PrintPosition.java", "client/go/cmd/print_position",
                     "client/example/print_position.py", "client/example/print_position.cpp", "client/example/control_process.c"):
            self.assertIn(name, page)
            self.assertTrue((SOURCE / name).exists(), name)


if __name__ == "__main__":
    unittest.main()
