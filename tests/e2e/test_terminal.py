"""What is printed cannot steer the terminal that it is printed on, whatever files, names, logs and command lines."""

import json
import re
import struct
import subprocess
import unittest

from machine import BIN, Machine, one_axis

# Clears the screen, sets the title, moves the cursor; C1's CSI; what turns the direction of writing.
EVIL = "\x1b[2J\x1b]0;owned\x07\r\b\x9b31m\u202e\u2066\u2028"
UNSAFE = re.compile("[\0-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")


class Terminal(Machine):
    def run_safely(self, *words, program="axlecast"):
        """Runs it; its output, which is text and steers no terminal."""
        done = subprocess.run([BIN / program, *map(str, words)], capture_output=True, timeout=60, stdin=subprocess.DEVNULL, check=False)
        shown = (done.stdout + done.stderr).decode()  # strict: it is UTF-8
        self.assertTrue(shown, words)
        self.assertIsNone(UNSAFE.search(shown), f"{words}: {shown!r}")
        return shown

    def evil_config(self):
        escapes = "".join(f"\\u{ord(c):04x}" for c in EVIL)
        return self.write(one_axis() + f'"{escapes}": 1\nbuses2: "{escapes}"\n', f"m{EVIL[:8]}.yaml")

    def test_keys_and_values_of_a_machines_file(self):
        config = self.evil_config()
        for words in (("check-config", config), ("status", config), ("up", config, "--no-table"), ("web", config), ("mqtt", config)):
            self.assertIn("owned", self.run_safely(*words))
        self.assertIn("owned", self.run_safely("--config", config, "--bus", "rs485-0", program="axlecast-tformat"))
        self.assertIn("owned", self.run_safely("--config", config, program="axlecast-bridge"))

    def test_names_on_the_command_line(self):
        for words in ((EVIL,), ("status", "--config", EVIL), ("log", "info", EVIL), ("decode", "tformat", EVIL), ("do", EVIL, EVIL),
                      ("status", f"--{EVIL}"), ("web", "--log", EVIL), ("record", f"/none/{EVIL}/a.lcm")):
            self.run_safely(*(word.replace("\0", "") for word in words))

    def log_of(self, *channels):
        path = self.folder / f"log{EVIL[:6]}.lcm"
        with open(path, "wb") as log:
            for number, channel in enumerate(channels):
                name = channel.encode()
                log.write(struct.pack(">IqqII", 0xEDA1DA01, number, 1_700_000_000_000_000 + number, len(name), 8) + name + b"\x1b" * 8)
        return path

    def test_channels_and_names_of_a_log(self):
        path = self.log_of("POSITION/" + EVIL, EVIL, "POSITION/axis1")
        for words in (("info",), ("cat",), ("verify",), ("info", "--json")):
            self.run_safely("log", words[0], path, *words[1:])
        lines = [json.loads(line) for line in self.run_safely("log", "cat", path).splitlines() if line.startswith("{")]
        self.assertIn(EVIL, {line.get("channel") for line in lines}, "JSON loses nothing")


if __name__ == "__main__":
    unittest.main()
