"""Event logs: what our recorder writes, read by liblcm and by LCM's Java library, which has a reader of its own; what liblcm writes, read
by ours. liblcm's Python has no reader of its own: it calls the one in C."""

import ctypes
import random
import struct
import subprocess
import unittest
import zlib

import lcm_log
from compared import BIN, CASES, SEED, SOURCE
from machine import wait_for
from recording import OWN, Recorder, Sender

PIECES = ("POSITION/", "axis", "é", "€", " ", "\"", "\n", "😀", ".*", "A")
BEGIN = 1_790_000_000_000_000  # us, UNIX
JAVA = ("java", "-Dfile.encoding=UTF-8", "-cp", "/usr/share/java/lcm.jar")


def channel_name(chance, longest=63):
    name = b""
    while len(name) < (longest if chance.random() < 0.1 else 1):
        piece = "".join(chance.choice(PIECES) for _ in range(chance.randint(1, 5))).encode()
        name = piece if not name and len(piece) <= longest else name + (piece if len(name) + len(piece) <= longest else b"z")
    return name.decode()


def content(chance, before):
    """Data of any size; what looks like records of a log, whole or cut, is data all the same, if it was written `before` (us, UNIX)."""
    kind = chance.randrange(40)
    if kind == 0:
        return b""
    if kind in (1, 2, 3):
        records = b"".join(lcm_log.record(chance.randrange(before), channel_name(chance), chance.randbytes(chance.randrange(50)),
                                          chance.randrange(2**40)) for _ in range(chance.randint(1, 4)))
        return chance.randbytes(chance.choice((0, 0, 3))) + records[:len(records) - chance.choice((0, 0, 1, 20))]
    if kind == 4:
        return struct.pack(">I", lcm_log.SYNC) * chance.randint(1, 9)
    return chance.randbytes(300_000 if kind == 5 and chance.random() < 0.01 else chance.randrange(200))


def java_events(path):
    done = subprocess.run([*JAVA, SOURCE / "tests/differential/ReadLog.java", path], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def java_line(utime, channel, data):
    return f"{utime} {channel.encode().hex()} {len(data)} {zlib.crc32(data)}"


def stock_log(path, events):
    """A log that liblcm writes."""
    lcm = ctypes.CDLL("liblcm.so.1")
    lcm.lcm_eventlog_create.restype = ctypes.c_void_p
    log = ctypes.c_void_p(lcm.lcm_eventlog_create(str(path).encode(), b"w"))
    for utime, channel, data in events:
        name = channel.encode()
        event = lcm_log.StockEvent(0, utime, len(name), len(data), name, ctypes.cast(ctypes.c_char_p(data), ctypes.c_void_p))
        if lcm.lcm_eventlog_write_event(log, ctypes.byref(event)) != 0:
            raise OSError("lcm_eventlog_write_event")
    lcm.lcm_eventlog_destroy(log)


class Logs(Recorder):
    def setUp(self):
        super().setUp()
        self.chance = random.Random(f"{SEED} {self.id()}")

    def test_what_the_recorder_writes(self):
        """Both readers find every message that was sent, with its bytes, in order; and the recorder's own events besides."""
        senders = [Sender() for _ in range(3)]
        for sender in senders:
            self.addCleanup(sender.socket.close)
        process = self.record(self.log_path)
        sent, size = [], 0
        for _ in range(CASES):
            channel, data, sender = channel_name(self.chance), content(self.chance, BEGIN)[:1400], self.chance.choice(senders)
            sender.socket.sendto(struct.pack(">II", 0x4C433032, sender.sent) + channel.encode() + b"\0" + data, sender.address)
            sender.sent += 1
            sent.append((channel, data))
            size += 28 + len(channel.encode()) + len(data)
            if len(sent) % 5_000 == 0:  # less than its buffer
                wait_for(lambda: self.log_path.stat().st_size >= size, "what was sent in the log")
        code, summary = self.end(process)
        self.assertEqual((code, summary["whole"]), (0, True), summary)
        stock = list(lcm_log.stock_events(self.log_path))
        self.assertEqual([event for event in stock if not event[0].startswith("AXLECAST/") and event[0] not in OWN], sent)
        whole = [struct.unpack_from(">qII", record, 12) + (record[28:],) for record in lcm_log.whole_records(self.log_path.read_bytes())]
        self.assertEqual(len(whole), len(stock))
        lines = [java_line(utime, body[:name].decode(), body[name:]) for utime, name, size, body in whole if size > 0]
        self.assertTrue(java_events(self.log_path) == lines, "the events that LCM's Java library reads")

    def test_what_liblcm_writes(self):
        """Read by `axlecast log`, which writes what it has read into another log."""
        utime, read = BEGIN, 0
        while read < CASES:
            events = []
            for _ in range(self.chance.choice((1, 2, 50, 3_000))):
                utime += self.chance.choice((0, 1, 777, self.chance.randrange(10**7)))
                events.append((utime, channel_name(self.chance, 255), content(self.chance, utime)))
            log, copy = self.folder / "stock.lcm", self.folder / "copy.lcm"
            stock_log(log, events)
            copy.unlink(missing_ok=True)
            done = subprocess.run([BIN / "axlecast", "log", "filter", log, copy, "--channel", ""], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            found = [struct.unpack_from(">qII", record, 12) + (record[28:],) for record in lcm_log.whole_records(copy.read_bytes())]
            found = [(at, body[:name].decode(), body[name:]) for at, name, _, body in found if not body.startswith(b"AXLECAST/")]
            self.assertEqual(found, events)
            read += len(events)


if __name__ == "__main__":
    unittest.main()
