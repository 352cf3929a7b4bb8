"""`axlecast redecode` on the log of a machine with one captured bus, from a driver in virtual time."""

import json
import subprocess
import unittest

from machine import BIN, Machine

WHOLE, UNREADABLE, USAGE, DIFFERENT = 0, 1, 2, 3
SECONDS = 30


class Redecode(Machine):
    def capture(self):
        log = self.folder / "capture.lcm"
        subprocess.run([BIN.parent / "campaign" / "capture_hours", log, str(SECONDS)], check=True)
        return log

    def redecode(self, log, *words):
        code, out, err = self.axlecast("redecode", log, "--json", *words)
        return code, json.loads(out) if out else None, err

    def test_gives_every_position_again(self):
        code, report, err = self.redecode(self.capture(), "--diff")
        self.assertEqual(code, WHOLE, err)
        self.assertTrue(report["same"])
        self.assertEqual([bus["gaps"] for bus in report["buses"]], [[]])
        self.assertGreater(report["channels"][0]["equal"], 0.9 * SECONDS * 1000)

    def test_across_a_gap_it_says_so(self):
        log = self.capture()
        bytes_ = bytearray(log.read_bytes())
        at = bytes_.index(b"WIRE/rs485-0", len(bytes_) // 2)
        bytes_[at] ^= 0x20
        log.write_bytes(bytes_)
        code, report, _ = self.redecode(log)
        self.assertEqual(code, DIFFERENT)
        self.assertEqual([gap["messages"] for gap in report["buses"][0]["gaps"]], [1])

    def test_a_changed_machine_shows_what_it_would_have_made_of_it(self):
        log = self.capture()
        text = log.read_bytes()
        begin = text.index(b"\nmachine:")
        config = self.write(text[begin:text.index(b"\xed\xa1\xda\x01", begin)].decode().replace("5.0", "10.0"))
        again = self.folder / "again.lcm"
        code, report, err = self.redecode(log, "--diff", "--config", config, "--output", again)
        self.assertEqual(code, DIFFERENT, err)
        first = report["channels"][0]["first"][0]["fields"]
        self.assertEqual(list(first), ["value"])
        self.assertAlmostEqual(first["value"]["redecoded"], 2 * first["value"]["recorded"])
        self.assertIn(b"POSITION/axis1", again.read_bytes())
        code, _, err = self.redecode(log, "--output", again)
        self.assertEqual(code, UNREADABLE)
        self.assertIn(str(again), err)

    def test_what_holds_no_capture_is_refused_with_the_cause(self):
        log = self.folder / "empty.lcm"
        log.write_bytes(b"")
        code, _, err = self.redecode(log)
        self.assertEqual(code, UNREADABLE)
        self.assertIn("--config", err)
        code, _, err = self.redecode(self.folder / "missing.lcm")
        self.assertEqual(code, UNREADABLE)
        self.assertIn("missing.lcm", err)
        code, _, err = self.redecode(self.capture(), "--bus", "rs485-9")
        self.assertEqual(code, USAGE)
        self.assertIn("rs485-9", err)


if __name__ == "__main__":
    unittest.main()
