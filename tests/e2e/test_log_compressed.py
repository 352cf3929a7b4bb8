"""Compressed logs: every command reads them, and the program zstd and axlecast read each other's files."""

import json
import signal
import struct
import subprocess
import unittest

import lcm_log
from machine import BIN, wait_for
from recording import Recorder, numbers

START = 1_790_000_000_000_000


def record(number, channel="T", size=200):
    data = struct.pack(">I", number).ljust(size, b".")
    return struct.pack(">IqqII", lcm_log.SYNC, number, START + 1000 * number, len(channel), size) + channel.encode() + data


def zstd(*arguments):
    return subprocess.run(["zstd", "-q", *arguments], capture_output=True, timeout=120)


class CompressedLogs(Recorder):
    def setUp(self):
        super().setUp()
        self.plain = self.folder / "run.lcm"
        self.plain.write_bytes(b"".join(record(i) for i in range(5_000)))
        self.compressed = self.folder / "run.lcm.zst"
        self.assertEqual(zstd("-k", self.plain).returncode, 0)

    def run_log(self, *arguments, code=0):
        status, out, err = self.axlecast("log", *arguments)
        self.assertEqual(status, code, f"{arguments}: {out}{err}")
        return out, err

    def both(self, *arguments):
        """What a command prints of the log in both forms, which must be equal."""
        command, rest = arguments[0], arguments[1:]
        plain, _ = self.run_log(command, self.plain, *rest)
        compressed, _ = self.run_log(command, self.compressed, *rest)
        self.assertEqual(compressed.replace(str(self.compressed), str(self.plain)), plain)
        return plain

    def test_every_command_reads_both_forms(self):
        self.assertEqual(json.loads(self.both("info", "--json"))["channels"][0]["channel"], "T")
        self.assertEqual(len(self.both("cat", "--from", "1", "--until", "2").splitlines()), 1_000)
        self.both("verify", "--json")
        for command, output in (("filter", "f.lcm"), ("merge", "m.lcm")):
            self.run_log(command, self.compressed, self.folder / output)
            self.assertEqual(self.recorded(self.folder / output), list(range(5_000)))
        self.run_log("convert", self.compressed, "--to", "mcap", "-o", self.folder / "a.mcap")
        self.run_log("convert", self.plain, "--to", "mcap", "-o", self.folder / "b.mcap")
        self.assertEqual((self.folder / "a.mcap").read_bytes(), (self.folder / "b.mcap").read_bytes())
        self.assertIn("nothing to repair", self.run_log("repair", self.compressed)[0])

    def test_replay_sends_a_compressed_log(self):
        recorder = self.record(self.folder / "replayed.lcm")
        code, out, err = self.axlecast("replay", self.compressed, "--url", "udpm://239.255.76.67:7667?ttl=0", "--speed", "10",
                                       "--allow-live", "--yes-allow-live")
        self.assertEqual(code, 0, out + err)
        recorder.send_signal(signal.SIGINT)
        recorder.wait(30)
        self.assertEqual(self.recorded(self.folder / "replayed.lcm"), list(range(5_000)))

    def test_a_log_that_was_compressed_meanwhile_is_found(self):
        self.plain.unlink()
        out, _ = self.run_log("cat", self.plain)
        self.assertEqual(len(out.splitlines()), 5_000)

    def test_damage_is_reported_and_the_rest_is_read(self):
        content = self.compressed.read_bytes()
        cut = self.folder / "cut.lcm.zst"
        cut.write_bytes(content[:-100])
        out, err = self.run_log("cat", cut, code=3)
        self.assertGreater(len(out.splitlines()), 1_000)
        self.assertIn("are damaged: a part of the log is missing", err)
        for command in ("info", "verify"):
            self.assertIn("are damaged", self.run_log(command, cut, code=3)[1])
        self.run_log("repair", cut, "--output", self.folder / "whole.lcm", code=3)
        self.assertIn(f"{cut} is compressed, and not repaired in place: give the repaired log a name by --output",
                      self.run_log("repair", cut, code=2)[1])
        self.assertGreater(len(self.recorded(self.folder / "whole.lcm")), 1_000)
        other = self.folder / "text.lcm.zst"
        other.write_text("no log")
        self.assertIn("is it a compressed log?", self.run_log("info", other, code=1)[1])

    def test_a_full_disk_for_temporary_files_is_named(self):
        small = self.folder / "small"
        small.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=100k", "tmpfs", small], check=True)
        self.addCleanup(subprocess.run, ["umount", small], check=True)
        done = subprocess.run([BIN / "axlecast", "log", "info", self.compressed], capture_output=True, text=True,
                              timeout=60, env={"TMPDIR": str(small)})
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn(f"{small}: No space left on device: set TMPDIR to a folder with enough space", done.stderr)

    def test_append_refuses_a_compressed_log(self):
        before = self.compressed.read_bytes()
        code, _, err = self.axlecast("record", self.compressed, "--append", "--url", "udpm://239.255.76.67:7667?ttl=0")
        self.assertEqual(code, 4, err)
        self.assertIn(f"{self.compressed}: is compressed, and cannot be continued", err)
        self.assertEqual(self.compressed.read_bytes(), before)

    def test_the_recorder_compresses_closed_logs(self):
        folder = self.folder / "logs"
        folder.mkdir()
        process = self.record(folder, "--compress", "--split-time", "1s")
        closed = lambda: sorted(folder.glob("test_*.lcm.zst"))

        def send():
            self.sender.send(50)
            return len(closed()) >= 2
        wait_for(send, "two compressed logs")
        code, end = self.end(process)
        self.assertEqual(code, 0, self.log("record"))
        self.assertTrue(end["whole"])
        left = sorted(folder.glob("test_*.lcm"))
        self.assertGreaterEqual(len(left), 1, "the last one is compressed by the next recorder")
        found = []
        for path in sorted([*closed(), *left]):
            if path.suffix == ".zst":
                self.assertEqual(zstd("-t", path).returncode, 0)
                self.assertEqual(zstd("-dk", "-o", self.folder / path.stem, path).returncode, 0)
                path = self.folder / path.stem
            found += self.recorded(path)
            self.run_log("verify", path)
        self.assertEqual(found, list(range(self.sender.sent)))
        process = self.record(folder, "--compress", name="second")
        wait_for(lambda: len(sorted(folder.glob("test_*.lcm"))) == 1, "the logs of the first recorder to be compressed")
        self.end(process, "second")

    def test_kills_leave_each_log_complete(self):
        """kill -9 while closed logs are compressed, ten times: every message is there, once, and no other file stays."""
        folder = self.folder / "logs"
        folder.mkdir()
        for turn in range(10):
            stamp = f"20261121T07{turn:02}00Z"
            (folder / f"test_{stamp}.lcm").write_bytes(b"".join(record(i, size=5_000) for i in range(4_000)))
            process = self.record(folder, "--compress", name=f"turn{turn}")
            if turn % 2:
                wait_for(lambda: any(folder.glob("*.zst.??????")) or (folder / f"test_{stamp}.lcm.zst").exists(),
                         "the compression to begin")
            process.kill()
            process.wait(30)
        process = self.record(folder, "--compress", name="last")
        done = lambda: not any(folder.glob("test_20261121T*.lcm")) and not any(folder.glob("*.zst.??????"))
        wait_for(done, "all of them to be compressed", limit=300)
        self.end(process, "last")
        for turn in range(10):
            path = folder / f"test_20261121T07{turn:02}00Z.lcm.zst"
            self.assertEqual(zstd("-d", "-o", self.folder / f"{turn}.lcm", path).returncode, 0)
            self.assertEqual(numbers(lcm_log.events(self.folder / f"{turn}.lcm")), list(range(4_000)))


if __name__ == "__main__":
    unittest.main(verbosity=2)
