"""The reader of logs of the Python package, against `axlecast log`, stock liblcm and the program zstd: logs of the recorder and of
lcm-logger, whole, damaged in random places, compressed, and of random bytes."""

import json
import os
import pathlib
import random
import re
import signal
import struct
import subprocess
import sys
import unittest

import lcm_log
from machine import BIN, one_axis, wait_for
from recording import URL, Recorder

PACKAGE = os.environ["AXLECAST_PYTHON_PACKAGE"]
sys.path.insert(0, PACKAGE)
import axlecast  # noqa: E402 pylint: disable=wrong-import-position
from axlecast import log_file  # noqa: E402 pylint: disable=wrong-import-position
from axlecast.crc32c import crc32c  # noqa: E402 pylint: disable=wrong-import-position
from axlecast.log import Damage, Log  # noqa: E402 pylint: disable=wrong-import-position

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
MESSAGES = SOURCE / "tests/compatibility/messages-0.1.log"  # one of each type, written by lcm-gen's Python
START = 1_790_000_000_000_000
SYNC = struct.pack(">I", lcm_log.SYNC)


def numbered(count, channel="TEST", size=40, start=START):
    """Records 1 ms apart."""
    return [lcm_log.record(start + 1000 * number, channel, bytes([number % 251]) * size, number) for number in range(count)]


def damage(log, chance):
    """The log with one to six damages of any kind."""
    log = bytearray(log)
    for _ in range(chance.randrange(1, 7)):
        place = chance.randrange(len(log))
        records = [match.start() for match in re.finditer(re.escape(SYNC), log)]
        kind = chance.randrange(6)
        if kind == 0:
            log[place] = chance.randrange(256)
        elif kind == 1:
            log[place:place + chance.randrange(60)] = chance.randbytes(chance.randrange(60))
        elif kind == 2:
            del log[place:place + chance.randrange(1, 300)]
        elif kind == 3:
            log[min(chance.choice(records or [0]) + chance.randrange(28), len(log) - 1)] = chance.randrange(256)  # in a header
        elif kind == 4:
            begin = chance.choice(records or [0])
            log[place:place] = log[begin:begin + chance.randrange(400)]  # records inside data, and torn ones
        elif chance.random() < 0.3:
            del log[place:]
        if len(log) < 29:
            return bytes(log)
    return bytes(log)


class Logs(Recorder):
    """What tests of logs have in common."""

    def save(self, content, name="run.lcm"):
        path = self.folder / name
        path.write_bytes(content if isinstance(content, bytes) else b"".join(content))
        return path

    def cat(self, path, *options):
        """(number, utime, channel, data) of each event, as `axlecast log cat` reads the log; its output is a file, because it is large."""
        output = self.folder / "cat.json"
        with open(output, "wb") as file:
            done = subprocess.run([BIN / "axlecast", "log", "cat", path, "--raw", *options], stdout=file, stderr=subprocess.PIPE,
                                  timeout=120, check=False)
        self.assertIn(done.returncode, (0, 1, 3), done.stderr)
        return [(event["number"], event["received_utime"], event["channel"], event["data"])
                for event in map(json.loads, output.read_text(encoding="utf-8").splitlines())]

    def read(self, path, *selected, **times):
        """The same, as the Python package reads it, and what it skips."""
        with Log(path) as log:
            events = [(event.number, event.utime, event.channel, event.data.hex()) for event in log.events(*selected, **times)]
            return events, log.skipped

    def compare(self, path):
        """Both readers find the same events and the same defects. Returns what the Python package has found."""
        expected = self.cat(path)
        events, skipped = self.read(path)
        self.assertEqual(events, expected)
        with Log(path) as log:
            found = log.verify()
        code, out, err = self.axlecast("log", "verify", path, "--json")
        if code == 1:
            self.assertEqual((events, found.events), ([], 0), err)
            return found
        check = json.loads(out)
        self.assertEqual([{"offset": place.offset, "bytes": place.size} for place in skipped.places], check["damage"])
        for name in ("events", "seals", "bad_seals", "unsealed_events", "missing_events", "wrong_numbers", "new_beginnings", "backward",
                     "max_backward_us", "lost"):
            self.assertEqual(getattr(found, name), check[name], name)
        self.assertEqual([{"offset": seal.offset, "events_sealed": seal.events_sealed, "events_found": seal.events_found}
                          for seal in found.first_bad_seals], check["first_bad_seals"])
        self.assertEqual(found.whole, code == 0, f"{found} {out}{err}")
        self.assertEqual(found.proven_events + found.broken_events + found.unsealed_events + found.seals, found.events)
        return found

    def recording(self, *options):
        """A log of a simulated axis by our recorder, about two seconds of it, and the machine's file."""
        config = self.write(one_axis("{speed_rpm: 90}"))
        process = self.recorder(self.log_path, "--config", config, "--name", "test", *options)
        self.simulator(config, "rs485-0")
        self.driver(config, "rs485-0")
        sealed = lambda: [channel for channel, _ in lcm_log.events(self.log_path)].count("AXLECAST/seal") >= 2
        wait_for(lambda: self.readable_now(sealed), "two seals")
        self.end(process)
        return self.log_path, config

    @staticmethod
    def readable_now(condition):
        """Whether the condition is met; the recorder may be writing an event."""
        try:
            return condition()
        except (ValueError, struct.error, FileNotFoundError):
            return False


class OfTheRecorder(Logs):
    def test_events_head_and_seals(self):
        path, config = self.recording()
        found = self.compare(path)
        self.assertTrue(found.whole)
        self.assertGreaterEqual(found.seals, 3)
        self.assertEqual((found.broken_events, found.unsealed_events), (0, 0))
        with Log(path) as log:
            self.assertEqual([(event.channel, event.data) for event in log], list(lcm_log.events(path)))
            self.assertEqual(log.machine(), config.read_text(encoding="utf-8"))
            self.assertIn("struct position_t", log.schema())
            recorder = log.recorder()
            self.assertEqual((recorder["name"], recorder["file_number"]), ("test", 0))
            positions = [log.decode(event) for event in log.events("POSITION/axis1")]
        lines = self.axlecast("log", "cat", path, "--channel", "^POSITION/axis1$")[1].splitlines()
        self.assertGreater(len(positions), 100)
        self.assertEqual([(position.seq, position.counts, position.value) for position in positions],
                         [(line["seq"], line["counts"], line["value"]) for line in map(json.loads, lines)])

    def test_a_changed_byte_breaks_its_seal_only(self):
        path, _ = self.recording()
        content = bytearray(path.read_bytes())
        content[content.index(b"POSITION/axis1") + 60] ^= 1
        found = self.compare(self.save(bytes(content)))
        self.assertEqual((found.bad_seals, found.skipped.count, found.whole), (1, 0, False))
        self.assertGreater(found.broken_events, 0)
        self.assertGreater(found.proven_events, 0)

    def test_damage_in_random_places_of_a_recording(self):
        path, _ = self.recording()
        content = path.read_bytes()
        chance = random.Random(7)
        broken = skipped = 0
        for _ in range(60):
            begin = chance.randrange(len(content) // 2) if chance.random() < 0.7 else 0
            found = self.compare(self.save(damage(content[begin:begin + 60_000], chance)))
            broken += found.bad_seals
            skipped += found.skipped.count
        self.assertGreater(broken, 5)
        self.assertGreater(skipped, 30)

    def test_losses_that_the_recorder_states(self):
        process = self.record(self.log_path)
        health = self.watch_health()
        self.sender.send(10)
        self.sender.sent += 5
        self.sender.send(10)
        wait_for(lambda: health() and health().lost == 5, "the recorder to state the loss")
        recorded = lambda: sum(channel == "RECORDER/test" for channel, _ in lcm_log.events(self.log_path))
        stated = recorded()
        wait_for(lambda: self.readable_now(lambda: recorded() > stated + 1), "the statement to be recorded")
        _, summary = self.end(process)
        with Log(self.log_path) as log:
            losses = log.losses()
        self.assertEqual(list(losses), ["RECORDER/test"])
        stated = losses["RECORDER/test"]
        self.assertEqual((stated.name, stated.lost, stated.lost), ("test", 5, summary["lost_by_number"]))
        by_sender = {sender.sender: (sender.received, sender.lost) for sender in stated.senders}
        self.assertEqual([by_sender[sender] for sender in by_sender if sender.endswith(f":{self.sender.own_port()}")], [(20, 5)])
        info = json.loads(self.axlecast("log", "info", self.log_path, "--json")[1])["recorders"]["RECORDER/test"]
        self.assertEqual(by_sender, {sender["sender"]: (sender["received"], sender["lost"]) for sender in info["senders"]})


class OfStockTools(Logs):
    def test_a_log_of_lcm_logger(self):
        config = self.write(one_axis("{speed_rpm: 90}"))
        path = self.folder / "stock.lcm"
        self.simulator(config, "rs485-0")
        self.driver(config, "rs485-0")
        logger = self.start("lcm-logger", "lcm-logger", "-q", f"--lcm-url={URL}", path)
        wait_for(lambda: path.exists() and path.stat().st_size > 100_000, "positions to record")
        logger.send_signal(signal.SIGINT)
        logger.wait(20)
        events, skipped = self.read(path)
        self.assertEqual([(channel, bytes.fromhex(data)) for _, _, channel, data in events], list(lcm_log.stock_events(path)))
        self.assertEqual(skipped.count, 0)
        found = self.compare(path)
        self.assertEqual((found.seals, found.unsealed_events, found.proven_events), (0, found.events, 0))
        with Log(path) as log:
            self.assertEqual((log.machine(), log.schema(), log.recorder(), log.losses()), (None, None, {}, {}))
        chance = random.Random(8)
        content = path.read_bytes()
        for _ in range(40):
            self.compare(self.save(damage(content[:40_000], chance)))

    def test_every_type(self):
        values = json.loads(MESSAGES.with_suffix(".json").read_text(encoding="utf-8"))
        with Log(MESSAGES) as log:
            decoded = {event.channel: log.decode(event) for event in log}
        self.assertTrue(set(decoded) <= set(str(values).split("'")))
        for name, message in decoded.items():
            self.assertIs(type(message), getattr(axlecast, name))
        self.compare(MESSAGES)

    def test_messages_that_are_missing_by_their_numbers(self):
        chance = random.Random(14)
        position = axlecast.position_t()
        lost = 0
        for publishers in (1, 3, 70):  # more than are remembered
            boots = [chance.randrange(-2**63, 2**63) for _ in range(publishers)]
            newest = dict.fromkeys(boots, 0)
            records = []
            for number in range(1_500):
                position.boot_id = chance.choice(boots)
                step = chance.choice((1, 1, 2, 5, -1, -chance.randrange(300), 0, 2**54 if number % 500 == 0 else 1))
                position.seq = newest[position.boot_id] + step
                newest[position.boot_id] = max(newest[position.boot_id], position.seq if step < 100 else 0)
                records.append(lcm_log.record(START + number, f"POSITION/axis{number % 2}", position.encode(), number))
            lost += sum(self.compare(self.save(records)).lost.values())
        self.assertGreater(lost, 500)

    def test_numbers_that_restart_and_times_that_run_back(self):
        found = self.compare(self.save(numbered(50, start=START + 10_000_000) + numbered(50)))
        self.assertEqual((found.new_beginnings, found.backward, found.whole), (1, 1, True))
        found = self.compare(self.save(numbered(50)[:20] + numbered(50)[23:]))
        self.assertEqual((found.missing_events, found.whole), (3, False))


class Damaged(Logs):
    def test_a_cut_at_every_byte(self):
        whole = b"".join(numbered(6))
        for size in range(len(whole)):
            complete = b"".join(lcm_log.whole_records(whole[:size]))
            events, skipped = self.read(self.save(whole[:size]))
            self.assertEqual(len(events), len(complete) // len(numbered(1)[0]))
            self.assertEqual((skipped.bytes, skipped.torn), (size - len(complete),) * 2, size)

    def test_places_and_bytes(self):
        log = numbered(100)
        size = len(log[0])
        log[49] = bytes(4) + log[49][4:]
        log[70] = log[70][:24] + struct.pack(">I", 175) + log[70][28:]  # it reaches over the next events
        path = self.save(log[:-1] + [log[-1][:-1]])
        events, skipped = self.read(path)
        self.assertEqual([event[0] for event in events], [number for number in range(99) if number not in (49, 70)])
        self.assertEqual(skipped.places, [Damage(49 * size, size), Damage(70 * size, size), Damage(99 * size, size - 1)])
        self.assertEqual((skipped.count, skipped.bytes, skipped.torn), (3, 3 * size - 1, size - 1))
        self.compare(path)

    def test_logs_inside_of_data(self):
        inside = b"".join(numbered(20, "INSIDE", start=START - 86_400_000_000))
        chance = random.Random(9)
        datas = [inside, b"x" + inside[:300], SYNC * 9, inside[5:], inside[:-7], b""]
        log = [lcm_log.record(START + 1000 * number, "OUTSIDE", datas[number % len(datas)], number) for number in range(36)]
        self.assertEqual(self.compare(self.save(log)).events, 36)
        for _ in range(80):
            self.compare(self.save(damage(b"".join(log), chance)))

    def test_a_channel_with_nul_is_damage(self):
        log = numbered(5)
        log[2] = lcm_log.record(START + 2_000, "TE\0T", b"", 2)
        self.assertEqual(self.compare(self.save(log)).skipped.places, [Damage(2 * len(log[0]), len(log[2]))])

    def test_a_length_that_reaches_exactly_over_other_damage(self):
        log = numbered(10)
        size = len(log[0])
        log[3] = log[3][:24] + struct.pack(">I", 40 + 3 * size) + log[3][28:]
        log[5] = bytes(size)
        found = self.compare(self.save(log))
        self.assertEqual((found.events, found.skipped.places), (8, [Damage(3 * size, size), Damage(5 * size, size)]))

    def test_a_length_that_ends_before_a_record_inside_of_data(self):
        inner = numbered(8, "INSIDE", start=START - 86_400_000_000)[7]
        log = numbered(6)
        log[2] = lcm_log.record(START + 2_000, "TEST", bytes(50) + inner, 2)
        log[2] = log[2][:24] + struct.pack(">I", 50) + log[2][28:]
        begin = 2 * len(log[0]) + len(log[2]) - len(inner)
        found = self.compare(self.save(log))
        self.assertEqual((found.events, found.skipped.places), (6, [Damage(begin, len(inner))]))

    def test_random_bytes_raise_nothing(self):
        chance = random.Random(10)
        pieces = [SYNC, struct.pack(">q", START), bytes(4), b"\0\0\0\x04", b"TEST", numbered(1)[0], b"AXLECAST/seal", b"AXLECAST/recorder",
                  b"\x28\xb5\x2f\xfd", b"\x50\x2a\x4d\x18", axlecast.position_t().encode()]
        for turn in range(1_500):
            content = b"".join(chance.choice(pieces) if chance.random() < 0.7 else chance.randbytes(chance.randrange(40))
                               for _ in range(chance.randrange(40)))
            path = self.save(content, "run.lcm.zst" if turn % 3 == 0 else "run.lcm")
            with Log(path) as log:
                events = list(log)
                covered = sum(28 + len(event.channel.encode()) + len(event.data) for event in events)
                if not log.compressed_damage and content[:4] not in (b"\x28\xb5\x2f\xfd", b"\x50\x2a\x4d\x18"):
                    self.assertEqual(covered + log.skipped.bytes, len(content))
                self.assertEqual(log.verify().events, len(events))
                for event in events:
                    log.decode(event)
                self.assertIsInstance((log.recorder(), log.losses()), tuple)

    def test_damaged_heads_raise_nothing(self):
        for text in (b"", b"[1]", b"{", b"[" * 100_000, b"\xff", b"9" * 5_000):
            path = self.save([lcm_log.record(START, "AXLECAST/recorder", text), lcm_log.record(START, "AXLECAST/machine.yaml", b"\xff", 1),
                              lcm_log.record(START, "AXLECAST/seal", b"short", 2)])
            with Log(path) as log:
                self.assertEqual((log.recorder(), log.machine()), ({}, "\ufffd"))
                self.assertEqual((log.verify().bad_seals, log.verify().broken_events), (1, 2))

    def test_a_log_that_is_cut_or_grows_while_it_is_read(self):
        path = self.save(numbered(60_000))
        size = len(numbered(1)[0])
        with Log(path) as log:
            events = log.events()
            first = next(events)
            with open(path, "ab") as file:
                file.write(b"".join(numbered(10)))
            self.assertEqual(sum(1 for _ in events) + 1, 60_000)
            self.assertEqual((first.number, log.truncated, log.skipped.count), (0, False, 0))
            events = log.events()
            next(events)
            os.truncate(path, 40_000 * size + 7)
            self.assertEqual(sum(1 for _ in events) + 1, 40_000)
            self.assertEqual((log.truncated, log.skipped.torn), (True, 20_000 * size))
            self.assertFalse(log.verify().whole)


class Compressed(Logs):
    def zstd(self, path, *options):
        compressed = self.folder / f"{path.name}.zst"
        subprocess.run(["zstd", "-q", "-f", *options, path, "-o", compressed], check=True, timeout=120)
        return compressed

    def test_logs_of_the_program_zstd(self):
        path = self.save(numbered(30_000, size=100))
        expected = self.read(path)[0]
        for options in ((), ("--no-check",), ("-19",), ("-B16KiB",), ("--no-content-size",)):
            self.assertEqual(self.read(self.zstd(path, *options))[0], expected, options)
        self.compare(self.zstd(path))
        path.unlink()
        self.assertEqual(self.read(path)[0], expected, "NAME.lcm that was compressed meanwhile")

    def test_logs_that_the_recorder_compresses(self):
        folder = self.folder / "logs"
        folder.mkdir()
        process = self.record(folder, "--compress", "--split-time", "1s")

        def compressed():
            self.sender.send(20)
            return len(sorted(folder.glob("*.lcm.zst"))) >= 2
        wait_for(compressed, "two compressed logs")
        self.end(process)
        for path in sorted(folder.glob("*.lcm.zst")):
            self.assertTrue(self.compare(path).whole)
            with Log(path) as log:
                self.assertEqual((log.recorder()["name"], log.compressed_damage), ("test", []))

    def test_damage_of_compressed_logs(self):
        chance = random.Random(11)
        frames = []  # as the recorder writes them, smaller
        for begin in range(0, 8_000, 2_000):
            records = [lcm_log.record(START + number, "TEST", chance.randbytes(80), number) for number in range(begin, begin + 2_000)]
            frames.append(self.zstd(self.save(records, "frame.lcm")).read_bytes())
        content = b"".join(frames)
        damaged = 0
        for _ in range(25):
            changed = bytearray(content)
            for _ in range(chance.randrange(1, 4)):
                place = chance.randrange(len(changed))
                if chance.random() < 0.5:
                    changed[place:place + 1] = chance.randbytes(chance.randrange(3))
                else:
                    del changed[place:place + chance.randrange(100_000)]
            path = self.save(bytes(changed), "damaged.lcm.zst")
            with Log(path) as log:
                events = {(event.number, event.data.hex()) for event in log}
                # The command loses the whole last block of a frame with a wrong checksum.
                self.assertLessEqual({(number, data) for number, _, _, data in self.cat(path)}, events)
                self.assertEqual(log.verify().whole, not log.compressed_damage and log.skipped.count == 0 and len(events) == 8_000)
                damaged += len(log.compressed_damage)
                report = self.axlecast("log", "cat", path)[2]
                size = sum(place.size for place in log.compressed_damage)
                if size:
                    self.assertIn(f"{size} compressed bytes in {len(log.compressed_damage)} place", report)
                else:
                    self.assertNotIn("compressed bytes", report)
        self.assertGreater(damaged, 10)

    def test_without_the_package_zstandard(self):
        path = self.zstd(self.save(numbered(10)))
        code = "import sys; sys.modules['zstandard'] = None; from axlecast.log import Log; Log(sys.argv[1])"
        done = subprocess.run([sys.executable, "-B", "-c", code, path], env={**os.environ, "PYTHONPATH": PACKAGE}, capture_output=True,
                              text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"ModuleNotFoundError: .*run\.lcm\.zst is compressed: install the package python3-zstandard")

    def test_a_full_folder_for_temporary_files_is_named(self):
        path = self.zstd(self.save(numbered(30_000)))
        small = self.folder / "small"
        small.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=100k", "tmpfs", small], check=True)
        self.addCleanup(subprocess.run, ["umount", small], check=True)
        code = "import sys; from axlecast.log import Log; Log(sys.argv[1])"
        done = subprocess.run([sys.executable, "-B", "-c", code, path], capture_output=True, text=True, timeout=60, check=False,
                              env={**os.environ, "PYTHONPATH": PACKAGE, "TMPDIR": str(small)})
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, rf"OSError: .*No space left on device: .*{small}: set TMPDIR to a folder with enough space")


class Selected(Logs):
    def test_channels(self):
        path = self.save([lcm_log.record(START + number, f"{'AB'[number % 2]}/axis{number % 7}", b"", number) for number in range(200)])
        for arguments, expression in ((("A/axis1",), "^A/axis1$"), ((None, "axis[12]$"), "axis[12]$"), (("A/axis1", "^B"), "^C"),
                                      ((None, re.compile("^B")), "^B")):
            self.assertEqual(self.read(path, *arguments)[0], self.cat(path, "--channel", expression), arguments)
        with Log(path) as log:
            self.assertRaises(re.error, log.events, None, "a(b")

    def test_times_in_a_large_log(self):
        chance = random.Random(13)
        for damaged in range(3):  # each third time, early or late by a day
            times = [START + 1_000 * number for number in range(60_000)]
            for number in range(3 + damaged, len(times), 3):
                times[number] += chance.choice((86_400_000_000, -86_400_000_000))
            path = self.save(lcm_log.record(utime, "TEST", bytes(100), number) for number, utime in enumerate(times))
            begin, end = START + 29_900_000, START + 30_200_000
            expected = self.cat(path, "--from", "29.9", "--until", "30.2")
            self.assertEqual(self.read(path, from_utime=begin, until_utime=end)[0], expected)
            self.assertGreater(len(expected), 150)
            with Log(path) as log:
                for _ in range(20):
                    begin = START + chance.randrange(60_000_000)
                    end = begin + chance.randrange(1_000_000)
                    self.assertEqual([event.number for event in log.events(from_utime=begin, until_utime=end)],
                                     [number for number, utime in enumerate(times) if begin <= utime < end], (begin, end))

    def test_a_place_is_found_without_reading_the_log(self):
        path = self.save(numbered(60_000, size=100))
        with Log(path) as log:
            file = log._file  # pylint: disable=protected-access
            read, sizes = file.read, []

            def counted(offset, size):
                sizes.append(size)
                return read(offset, size)
            file.read = counted
            self.assertEqual(next(log.events(from_utime=START + 50_000_000)).number, 50_000)
        self.assertLess(sum(sizes), path.stat().st_size)

    def test_types_of_others(self):
        class Own:
            @staticmethod
            def _get_packed_fingerprint():
                return b"12345678"

            @staticmethod
            def decode(data):
                return data[8:]
        with Log(self.save([lcm_log.record(START, "OWN", b"12345678own")])) as log:
            event = next(iter(log))
            self.assertIsNone(log.decode(event))
            log.register(Own)
            self.assertEqual(log.decode(event), b"own")


class Files(Logs):
    def test_what_is_no_log(self):
        self.assertRaises(FileNotFoundError, Log, self.folder / "none.lcm")
        self.assertRaises(IsADirectoryError, Log, self.folder)
        os.mkfifo(self.folder / "fifo")
        self.assertRaisesRegex(OSError, "is no regular file", Log, self.folder / "fifo")
        events, skipped = self.read(self.save(b"this is no log\n" * 100))
        self.assertEqual((events, skipped.places), ([], [Damage(0, 1_500)]))
        self.assertEqual(self.read(self.save(b""))[0], [])
        self.assertEqual(self.read(self.save(b"no log", "text.lcm.zst"))[0], [])

    def test_the_memory_does_not_depend_on_the_log(self):
        code = """import resource, sys
from axlecast.log import Log
with Log(sys.argv[1]) as log:
    events = log.events()
    next(events)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(sum(len(event.data) for event in events), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)"""
        path = self.folder / "large.lcm"
        with open(path, "wb") as file:
            for number in range(3_000):
                file.write(lcm_log.record(START + number, "BIG", bytes(30_000), number))
        done = subprocess.run([sys.executable, "-B", "-c", code, path], env={**os.environ, "PYTHONPATH": PACKAGE}, capture_output=True,
                              text=True, timeout=120, check=True)
        data, grown = map(int, done.stdout.split())
        self.assertEqual(data, 2_999 * 30_000)
        self.assertLess(grown, 8 * log_file.WINDOW // 1024, "kB")

    def test_crc32c(self):
        for data, expected in ((bytes(32), 0x8A9136AA), (b"\xff" * 32, 0x62A8AB43), (bytes(range(32)), 0x46DD794E),
                               (bytes(range(31, -1, -1)), 0x113FDB5C), (b"123456789", 0xE3069283)):  # RFC 3720, B.4; Rocksoft
            self.assertEqual(crc32c(data), expected)
        chance = random.Random(12)
        for size in (*range(120, 140), 4_095, 4_096, 300_000):
            data = chance.randbytes(size)
            bitwise = 0xFFFFFFFF
            for byte in data if size < 5_000 else ():
                bitwise ^= byte
                for _ in range(8):
                    bitwise = bitwise >> 1 ^ (0x82F63B78 if bitwise & 1 else 0)
            if size < 5_000:
                self.assertEqual(crc32c(data), bitwise ^ 0xFFFFFFFF, size)
            cut = chance.randrange(size)
            self.assertEqual(crc32c(data[cut:], crc32c(data[:cut])), crc32c(data))


class Examples(Logs):
    def gaps(self):
        """A log of 20 positions of axis1 and axis2, of which 7 is not valid, and 12 and 13 are lost."""
        position = axlecast.position_t()
        records = []
        for number in range(20):
            position.utime, position.seq, position.value, position.unit = START + 10_000 * number, number, number / 2, position.UNIT_MM
            position.flags = 0 if number == 7 else position.FLAG_VALID
            if number not in (12, 13):
                records += [lcm_log.record(position.utime, f"POSITION/axis{axis}", position.encode(), len(records)) for axis in (1, 2)]
        return self.save(records)

    def run_example(self, *words):
        done = subprocess.run([sys.executable, "-B", SOURCE / "client/example" / words[0], *words[1:]], capture_output=True, text=True,
                              env={**os.environ, "PYTHONPATH": PACKAGE, "MPLCONFIGDIR": str(self.folder)}, timeout=120, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_log_to_pandas(self):
        table = self.folder / "axis1.csv"
        printed = self.run_example("log_to_pandas.py", self.gaps(), "axis1", "--csv", table)
        self.assertIn("1 not valid, 2 lost, 0 bytes of the log damaged", printed)
        lines = table.read_text(encoding="utf-8").splitlines()
        self.assertEqual(len(lines), 19)
        self.assertEqual(lines[1], "2026-09-21 14:13:20+00:00,0.0,0,True,False,False,0,0")
        self.assertEqual(lines[8], "2026-09-21 14:13:20.070000+00:00,,,False,False,False,0,0")
        self.assertEqual(lines[13], "2026-09-21 14:13:20.140000+00:00,7.0,0,True,False,False,2,0")
        self.assertIn("example/log_to_pandas.py", (SOURCE / "docs/python.md").read_text(encoding="utf-8"))

    def test_plot_log(self):
        path, picture = self.gaps(), self.folder / "axes.png"
        self.run_example("plot_log.py", path, "axis1", "axis2", "-o", picture)
        self.assertEqual(picture.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        code = ("import sys; import plot_log; from axlecast.log import Log\n"
                "curve = plot_log.curves(Log(sys.argv[1]), ['axis1'])['axis1']; print(curve.unit, curve.values)")
        done = subprocess.run([sys.executable, "-B", "-c", code, path], capture_output=True, text=True, timeout=120, check=True,
                              env={**os.environ, "PYTHONPATH": f"{PACKAGE}:{SOURCE / 'client/example'}"})
        values = [str(number / 2) if number != 7 else "nan" for number in range(20) if number not in (12, 13)]
        self.assertEqual(done.stdout.strip(), f"mm [{', '.join(values[:12] + ['nan'] + values[12:])}]")
        self.assertIn("example/plot_log.py", (SOURCE / "docs/python.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    unittest.main()
