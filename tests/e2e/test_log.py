"""axlecast log against what stock LCM makes of the same files: lcm-logger's logs, and lcm-logplayer on repaired ones."""

import json
import os
import pathlib
import re
import signal
import struct
import subprocess
import unittest

import lcm_log
from machine import BIN, Machine, one_axis, wait_for

DATA_URL = "udpm://239.255.76.67:7667?ttl=0"
START = 1_790_000_000_000_000


def record(number, channel, data, utime=None):
    utime = START + 1000 * number if utime is None else utime
    return struct.pack(">IqqII", lcm_log.SYNC, number, utime, len(channel), len(data)) + channel.encode() + data


def log_of(count, channel="TEST", size=40):
    return [record(i, channel, bytes([i % 251]) * size) for i in range(count)]


class Log(Machine):
    def log_command(self, *arguments, code=0):
        """Standard output and error of `axlecast log ...`, which must end with this exit code."""
        done = subprocess.run([BIN / "axlecast", "log", *arguments], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, code, f"{arguments}: {done.stdout}{done.stderr}")
        return done.stdout, done.stderr

    def save(self, name, content):
        path = self.folder / name
        path.write_bytes(content if isinstance(content, bytes) else b"".join(content))
        return path

    def events(self, path):
        return list(lcm_log.events(path))

    def played(self, log):
        """How many events stock lcm-logplayer plays of the log: what it prints of each."""
        done = subprocess.run(["lcm-logplayer", "-v", "--speed=1000", f"--lcm-url={DATA_URL}", log],
                              capture_output=True, text=True, timeout=120)
        return len(re.findall(r"^\d+\.\d+ Channel", done.stdout, re.MULTILINE))

    def damaged(self, count=100):
        """A log of which event 49 lost its sync word, 70 reaches over the next ones, and the last one is torn."""
        log = log_of(count)
        log[49] = b"\0\0\0\0" + log[49][4:]
        log[70] = log[70][:24] + struct.pack(">I", 175) + log[70][28:]
        return log[:-1] + [log[-1][:-1]]

    def test_repair_makes_a_log_that_stock_logplayer_plays_to_its_end(self):
        log = self.save("run.log", self.damaged())
        before = log.read_bytes()
        log.chmod(0o640)
        self.assertLess(self.played(log), 50, "stock stops at the first damage")
        out, _ = self.log_command("repair", log, code=3)
        self.assertIn("97 events", out)
        self.assertEqual(self.played(log), 97)
        kept = [i for i in range(99) if i not in (49, 70)]
        self.assertEqual(log.read_bytes(), b"".join(log_of(100)[i] for i in kept))
        self.assertEqual(log.stat().st_mode & 0o777, 0o640)
        self.assertEqual((self.folder / "run.log.damaged").read_bytes(), before)
        out, _ = self.log_command("repair", log)
        self.assertIn("nothing to repair", out)
        out, _ = self.log_command("verify", log, code=3)
        self.assertIn("2 events are missing", out)

    def test_repair_keeps_every_damaged_log_and_can_write_elsewhere(self):
        log = self.save("run.log", self.damaged())
        other = self.folder / "other.log"
        self.log_command("repair", log, "--output", other, code=3)
        self.assertEqual(len(self.events(other)), 97)
        self.assertEqual(log.read_bytes(), b"".join(self.damaged()))
        self.log_command("repair", log, "--output", other, code=4)
        self.log_command("repair", log, "--output", other, "--force", code=3)
        for name in ("run.log.damaged", "run.log.damaged.2"):
            self.save("run.log", self.damaged())
            self.log_command("repair", log, code=3)
            self.assertEqual((self.folder / name).read_bytes(), b"".join(self.damaged()))

    def test_a_log_of_the_machine_by_lcm_logger(self):
        config = self.write(one_axis("{speed_rpm: 90}"))
        log = self.folder / "stock.log"
        watch = self.watch(config)
        up = self.start("up", BIN / "axlecast", "up", config, "--no-table")
        wait_for(lambda: watch.of("POSITION/axis1"), "positions")
        logger = self.start("lcm-logger", "lcm-logger", "-q", f"--lcm-url={DATA_URL}", log)
        mark = watch.mark()
        wait_for(lambda: len(watch.of("POSITION/axis1", mark)) > 300, "positions to record")
        logger.send_signal(signal.SIGINT)
        logger.wait(20)
        up.send_signal(signal.SIGINT)
        up.wait(20)
        watch.close()

        events = self.events(log)
        info = json.loads(self.log_command("info", log, "--json")[0])
        self.assertEqual(info["events"], len(events))
        self.assertIsNone(info["machine"])
        channels = {channel["channel"]: channel for channel in info["channels"]}
        self.assertEqual(set(channels), {channel for channel, _ in events})
        axis = channels["POSITION/axis1"]
        self.assertEqual(axis["type"], "position_t")
        self.assertEqual(axis["count"], sum(channel == "POSITION/axis1" for channel, _ in events))

        types = lcm_log.generated_types()
        lines = self.log_command("cat", log, "--channel", "^POSITION/axis1$")[0].splitlines()
        stock = [types.position_t.decode(data) for channel, data in events if channel == "POSITION/axis1"]
        self.assertEqual([(json.loads(line)["seq"], json.loads(line)["counts"]) for line in lines],
                         [(message.seq, message.counts) for message in stock])
        lost = stock[-1].seq - stock[0].seq + 1 - len(stock)  # by lcm-logger, on a busy machine
        self.assertEqual(axis["lost"], lost)
        self.log_command("verify", log, code=3 if info["lost"] else 0)

    def test_filter_and_merge_make_logs_that_stock_tools_read(self):
        header = record(0, "AXLECAST/machine.yaml", b"machine: press3\n")
        log = self.save("run.log", [header] + [record(i, "AB"[i % 2], b"%d" % i) for i in range(1, 101)])
        one, other, both = (self.folder / name for name in ("a.log", "b.log", "both.log"))
        self.log_command("filter", log, one, "--channel", "^A$")
        self.log_command("filter", log, other, "--channel", "^A$", "--invert")
        self.log_command("filter", log, other, code=4)
        for path, name in ((one, "A"), (other, "B")):
            self.assertEqual([channel for channel, _ in self.events(path) if not channel.startswith("AXLECAST/")],
                             [name] * 50)
            self.assertEqual(json.loads(self.log_command("info", path, "--json")[0])["machine"], "press3")
        self.log_command("merge", one, other, both)
        self.assertEqual([event for event in self.events(both) if event[0] != "AXLECAST/seal"], self.events(log))
        verified = json.loads(self.log_command("verify", both, "--json")[0])
        self.assertTrue(verified["whole"])
        self.assertGreater(verified["seals"], 0)
        self.assertEqual(self.played(both), len(self.events(both)))
        changed = bytearray(both.read_bytes())
        changed[changed.index(b"57")] ^= 1
        out, _ = self.log_command("verify", self.save("changed.log", bytes(changed)), code=3)
        self.assertIn("was changed", out)

    def test_ranges_of_time(self):
        log = self.save("run.log", log_of(100))
        numbers = lambda *options: [json.loads(line)["number"]
                                    for line in self.log_command("cat", log, *options)[0].splitlines()]
        self.assertEqual(numbers("--from", "0.010", "--until", "0.012"), [10, 11])
        self.assertEqual(numbers("--from", "2026-09-21T14:13:20.097"), [97, 98, 99])
        self.assertEqual(numbers("--until", "0.002"), [0, 1])
        self.assertIn("is not a time", self.log_command("cat", log, "--from", "noon", code=2)[1])
        self.assertIn("no event is between them", self.log_command("cat", log, "--from", "2", "--until", "1", code=2)[1])

    def reading(self, log):
        """`log cat` that has begun to read, and waits for somebody to take its lines."""
        cat = subprocess.Popen([BIN / "axlecast", "log", "cat", log], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               bufsize=0)
        self.processes.append(cat)
        first = cat.stdout.readline()
        wait_for(lambda: "S (sleeping)" in pathlib.Path(f"/proc/{cat.pid}/status").read_text(), "a full pipe")
        return cat, first

    def test_a_log_that_is_cut_while_it_is_read_is_read_up_to_there(self):
        size = len(log_of(1)[0])
        for left in (0, 20_000 * size + 7):
            log = self.save("run.log", log_of(50_000))
            cat, first = self.reading(log)
            os.truncate(log, left)
            out, err = cat.communicate(timeout=120)
            self.assertEqual(cat.returncode, 3, err)
            self.assertIn(f"of its {50_000 * size} bytes {left} are left", err.decode())
            self.assertIn("on are damaged", err.decode())
            lines = [first, *out.splitlines()]
            self.assertEqual([json.loads(line)["number"] for line in lines], list(range(len(lines))))
            self.assertTrue(left // size <= len(lines) < 50_000, len(lines))
            self.assertEqual(lines[-1], self.line_of(len(lines) - 1))

    def line_of(self, number):
        path = self.save("one.log", [record(number, "TEST", bytes([number % 251]) * 40)])
        return self.log_command("cat", path)[0].strip().encode()

    def test_a_log_that_grows_while_it_is_read_is_read_as_it_was(self):
        log = self.save("run.log", log_of(50_000))
        cat, first = self.reading(log)
        with open(log, "ab") as file:
            file.write(b"".join(record(i, "NEW", b"x") for i in range(50_000, 60_000)))
        out, err = cat.communicate(timeout=120)
        self.assertEqual((cat.returncode, err), (0, b""))
        self.assertEqual([json.loads(line)["number"] for line in [first, *out.splitlines()]], list(range(50_000)))

    def test_what_is_wrong_is_said(self):
        text = self.save("text.log", b"this is no log\n" * 100)
        for command in (["info"], ["verify"], ["cat"], ["repair"]):
            self.assertIn("is it a log?", self.log_command(*command, text, code=1)[1])
            self.assertIn("No such file", self.log_command(*command, self.folder / "none", code=1)[1])
            self.assertIn("is a folder", self.log_command(*command, self.folder, code=1)[1])
            self.log_command(*command, self.save("empty.log", b""))
        self.log_command("filter", text, self.folder / "out.log", code=1)
        self.assertFalse((self.folder / "out.log").exists())
        good = self.save("good.log", log_of(3))
        self.log_command("merge", good, text, self.folder / "out.log", code=1)
        self.assertIn("regular expression", self.log_command("cat", good, "--channel", "a(b", code=2)[1])
        self.assertIn("does not contain machine", self.log_command("info", good, "--show", "machine", code=1)[1])
        self.assertEqual([path.name for path in self.folder.glob("*.log*")].count("out.log"), 0)

    def test_a_full_disk_leaves_the_damaged_log_as_it_was(self):
        mount = self.folder / "small"
        mount.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "none", mount], check=False).returncode != 0:
            self.skipTest("mounting is not allowed here")
        self.addCleanup(subprocess.run, ["umount", mount], check=True)
        log = mount / "run.log"
        log.write_bytes(b"".join(self.damaged(2000)))
        before = log.read_bytes()
        self.assertGreater(len(before), 128 << 10)
        _, error = self.log_command("repair", log, code=4)
        self.assertIn("No space left", error)
        self.assertEqual(log.read_bytes(), before)
        self.assertEqual(os.listdir(mount), ["run.log"])


if __name__ == "__main__":
    unittest.main()
