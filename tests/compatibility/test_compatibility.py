"""What a released version recorded, every later version reads: one message of every type, written with lcm-gen's Python."""

import json
import pathlib
import struct
import subprocess
import unittest

import lcm_log
from machine import BIN

HERE = pathlib.Path(__file__).resolve().parent
LOGS = sorted(HERE.glob("messages-*.log"))
NEWEST = json.loads(LOGS[-1].with_suffix(".json").read_text())


def same(stored, shown):
    """A stored value, and the JSON of axlecast: bytes as hex text, ids as hex text, float as the nearest single."""
    if isinstance(stored, dict):
        return all(name in shown and same(value, shown[name]) for name, value in stored.items())
    if isinstance(shown, str) and isinstance(stored, list):
        return bytes(stored) == bytes.fromhex(shown)
    if isinstance(shown, str) and isinstance(stored, int):
        return stored % 2**64 == int(shown, 16)
    if isinstance(stored, list):
        return len(stored) == len(shown) and all(map(same, stored, shown))
    if isinstance(stored, float) and not isinstance(shown, bool):
        return struct.pack(">f", stored) == struct.pack(">f", shown)
    return stored == shown


class Compatibility(unittest.TestCase):
    def test_no_type_of_a_released_message_has_changed(self):
        package = lcm_log.generated_types()
        for name, content in NEWEST.items():
            with self.subTest(name):
                now = getattr(package, name)._get_packed_fingerprint().hex()
                self.assertEqual(now, content["fingerprint"],
                                 f"{name} has other fields: older logs and programs cannot read it. Give the new message a "
                                 "new type, and keep this one")

    def test_every_type_is_in_the_newest_log(self):
        names = {path.stem for path in (HERE.parents[1] / "lcmtypes").glob("*.lcm")}
        self.assertEqual(names - set(NEWEST), set(), "write a log for this version: tests/compatibility/messages.py")

    def test_every_released_log_is_read(self):
        for log in LOGS:
            stored = json.loads(log.with_suffix(".json").read_text())
            done = subprocess.run([BIN / "axlecast", "log", "cat", log], capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 0, done.stderr)
            shown = {line["channel"]: line for line in map(json.loads, done.stdout.splitlines())}
            self.assertEqual(set(shown), set(stored))
            for name, content in stored.items():
                for field, value in content["fields"].items():
                    with self.subTest(log=log.name, type=name, field=field):
                        self.assertTrue(same(value, shown[name].get(field)), f"{value} is shown as {shown[name].get(field)}")


if __name__ == "__main__":
    unittest.main()
