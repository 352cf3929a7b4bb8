"""Event logs of axlecast's own messages, encoded by the Python that lcm-gen makes."""

import math
import os
import pathlib
import struct
import subprocess
import tempfile
import unittest

import lcm_log

BIN = pathlib.Path(os.environ["AXLECAST_BIN"])
SYNC = 0xEDA1DA01
START = 1_763_740_800_000_000  # us: 2025-11-21 16:00:00 UTC
BOOT = 0x00C0FFEE12345678
COUNTS_PER_TURN = 131072
VALID = 1


class Log:
    """Events, in order of their time."""

    types = None

    def __init__(self):
        Log.types = Log.types or lcm_log.generated_types()
        self.events = []  # (utime, channel, data)

    def add(self, utime, channel, data):
        self.events.append((utime, channel, data if isinstance(data, bytes) else data.encode()))

    def message(self, kind, at, seq, /, **fields):
        """A message of the type `kind` with this head; its numbers are 0 unless given."""
        message = getattr(self.types, kind)()
        message.utime, message.mono_ns, message.boot_id, message.seq = at, 1_000 * (at - START), BOOT, seq
        for name, value in fields.items():
            setattr(message, name, value)
        return message

    def write(self, path):
        self.events.sort(key=lambda event: event[0])
        with open(path, "wb") as file:
            for number, (utime, channel, data) in enumerate(self.events):
                name = channel.encode()
                file.write(struct.pack(">IqqII", SYNC, number, utime, len(name), len(data)) + name + data)

    # -- what a machine publishes

    def device(self, name, at, max_age_us=20_000, per_turn=5.0, modulo=0.0):
        self.add(at, f"DEVICE/{name}", self.message(
            "device_info_t", at, 0, device=name, counts_per_turn=COUNTS_PER_TURN, ratio_num=1, ratio_den=1,
            per_turn=per_turn, unit=4, max_age_us=max_age_us, modulo=modulo))

    def position(self, name, at, seq, counts, flags=VALID, per_turn=5.0, speed=math.nan):
        self.add(at + 150, f"POSITION/{name}", self.message(
            "position_t", at, seq, counts=counts, counts_per_turn=COUNTS_PER_TURN, flags=flags, unit=4,
            value=counts * per_turn / COUNTS_PER_TURN, speed_rad_s=speed, raw_counts=counts % COUNTS_PER_TURN))

    def wire(self, bus, kind, at, seq, records):
        """Records: (dt_ns, direction, id, data) or with flags behind."""
        made = []
        for dt_ns, direction, number, data, *flags in records:
            record = self.types.wire_record_t()
            record.dt_ns, record.direction, record.id = dt_ns, direction, number
            record.duration_ns, record.flags = 47_000, flags[0] if flags else 0
            record.len, record.data = len(data), data
            made.append(record)
        self.add(at, f"WIRE/{bus}", self.message("wire_t", at, seq, bus=bus, kind=kind, n=len(made), records=made))


class Converted(unittest.TestCase):
    """A folder, a log in the making, and axlecast log."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="axlecast-convert-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.log = Log()
        self.path = self.folder / "machine.log"

    def axlecast(self, command, *options, exit_code=0):
        """Its standard error; the log is written first."""
        if not self.path.exists():
            self.log.write(self.path)
        done = subprocess.run([BIN / "axlecast", "log", command, self.path, *options], capture_output=True, text=True,
                              check=False)
        self.assertEqual(done.returncode, exit_code, done.stderr)
        self.said = done.stdout
        return done.stderr

    def convert(self, kind, *options, exit_code=0):
        out = self.folder / f"out.{kind}"
        self.axlecast("convert", "--to", kind, "-o", out, *options, exit_code=exit_code)
        return out


def peer(*command):
    """What somebody else's program prints."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(f"{command[0]}: exit code {done.returncode}: {done.stderr}")
    return done.stdout
