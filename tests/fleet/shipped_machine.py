"""A machine's log in a fleet database: what the tests of `axlecast fleet` share. The log is a captured bus at 1 kHz, with the head and the
seals that docs/log.md describes, written here by that page alone."""

import csv
import hashlib
import io
import json
import os
import pathlib
import struct
import subprocess
import time

import lcm_log
from cluster import Cluster
from machine import BIN, Machine

MACHINE = "capture"
SECONDS = 4
SHIP = """
recorder:
  logs:
    all: {channels: ''}
ship:
  database: host=/nowhere
  detail:
    - {channels: '.', detail: full, raw: true}
"""
HEAD = {"version": "0", "name": "all", "host": "host1", "urls": [], "channel": "", "invert": False, "file_number": 0}
POSITION = struct.Struct(">8x7qiiqiqqddbdiii")  # lcmtypes/position_t.lcm behind its hash
TABLE = [0] * 256
for _byte in range(256):
    _crc = _byte
    for _ in range(8):
        _crc = _crc >> 1 ^ (0x82F63B78 if _crc & 1 else 0)
    TABLE[_byte] = _crc


def crc32c(data, crc=0):
    """RFC 3720, appendix B.4."""
    crc ^= 0xFFFFFFFF
    for byte in data:
        crc = TABLE[(crc ^ byte) & 0xFF] ^ crc >> 8
    return crc ^ 0xFFFFFFFF


def events(path):
    """(number, utime, channel, data) of each event."""
    data = pathlib.Path(path).read_bytes()
    for record in lcm_log.whole_records(data):
        _, number, utime, size, _ = struct.unpack_from(">IqqII", record)
        yield number, utime, record[28:28 + size].decode(), record[28 + size:]


def digest(path, channels=lambda channel: True):
    """SHA-256 over time, channel and data of the messages."""
    hashed = hashlib.sha256()
    for _, utime, channel, data in events(path):
        if not channel.startswith("AXLECAST/") and channels(channel):
            hashed.update(struct.pack(">qII", utime, len(channel), len(data)) + channel.encode() + data)
    return hashed.hexdigest()


def positions(path):
    """(utime, seq, counts, value, flags) of each position."""
    for _, _, channel, data in events(path):
        if channel == "POSITION/axis1":
            fields = POSITION.unpack_from(data)
            yield fields[0], fields[3], fields[12], fields[14], fields[-1]


class LogFile:
    """Writes a log with numbers and seals."""

    def __init__(self):
        self.records = []
        self.open = b""

    def add(self, utime, channel, data):
        record = lcm_log.record(utime, channel, data, len(self.records))
        self.records.append(record)
        self.open += record

    def seal(self, utime):
        count = len(self.records) - self.sealed if self.records else 0
        self.records.append(lcm_log.record(utime, "AXLECAST/seal", struct.pack(">QQI", len(self.open), count, crc32c(self.open)),
                                           len(self.records)))
        self.open = b""
        self.sealed = len(self.records)

    sealed = 0

    def write(self, path):
        path.write_bytes(b"".join(self.records))
        return path


def make_log(folder, ship=SHIP, seconds=SECONDS):
    """Returns the path of a recorded log, named as the recorder names it."""
    raw = folder / "capture.raw"
    subprocess.run([BIN.parent / "campaign" / "capture_hours", raw, str(seconds)], check=True)
    recorded = list(events(raw))
    raw.unlink()
    machine = recorded[0][3].decode() + ship
    log = LogFile()
    start = recorded[1][1]
    for channel, text in (("AXLECAST/recorder", json.dumps({**HEAD, "start_utime": start})), ("AXLECAST/machine.yaml", machine),
                          ("AXLECAST/schema", "// none")):
        log.add(start, channel, text.encode())
    sealed = start
    for _, utime, channel, data in recorded[1:]:
        log.add(utime, channel, data)
        if utime - sealed >= 1_000_000:
            log.seal(utime)
            sealed = utime
    log.seal(recorded[-1][1])
    (folder / "machine.yaml").write_text(machine)
    return log.write(folder / f"{MACHINE}-all_20231114T223000Z.lcm")


class ShippedMachine(Machine):
    """Base of the tests: a database with the schema, and a log that was shipped to it."""

    ship = SHIP

    def setUp(self):
        super().setUp()
        self.cluster = self.enterContext(Cluster())
        self.cluster.create_database()
        self.database = self.cluster.connection()
        self.must("init", self.database)
        self.logs = self.folder / "logs"
        self.logs.mkdir()
        self.recorded = make_log(self.logs, self.ship)
        self.config = self.logs / "machine.yaml"
        self.ship_logs()

    def ship_logs(self):
        """Ships all logs, as logs to which nobody has written for an hour: they are closed."""
        an_hour_ago = time.time() - 3600
        for log in self.logs.glob("*.lcm"):
            os.utime(log, (an_hour_ago, an_hour_ago))
        code, out, err = self.axlecast("ship", self.config, "--database", self.database, "--folder", self.logs, "--state",
                                       self.folder / "ship", "--once")
        self.assertEqual(code, 0, out + err)

    # -- axlecast fleet

    def fleet(self, command, *words, database=None):
        options = [] if command == "init" else ["--database", database or self.database]
        return self.axlecast("fleet", command, *words, *options)

    def must(self, command, *words):
        """Standard output of a command that must succeed."""
        code, out, err = self.fleet(command, *words)
        self.assertEqual(code, 0, out + err)
        return out

    def fails(self, code, command, *words, **options):
        """Standard error of a command that must fail with this code."""
        exit_code, out, err = self.fleet(command, *words, **options)
        self.assertEqual(exit_code, code, out + err)
        self.assertTrue(err.strip(), "no text states why")
        return err

    def query(self, kind, *words):
        return json.loads(self.must("query", kind, "--machine", MACHINE, "--format", "json", *words))

    def query_csv(self, kind, *words):
        return list(csv.DictReader(io.StringIO(self.must("query", kind, "--machine", MACHINE, *words), newline="")))
