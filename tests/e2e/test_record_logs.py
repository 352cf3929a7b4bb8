"""The logs of the machine's file (`recorder:`): what goes into each, how long each stays, and who writes them."""

import datetime
import json
import signal
import subprocess
import unittest

import lcm_log
from machine import BIN, one_axis, wait_for
from recording import Recorder, numbers

MINUTE = 60_000_000  # us


class RecordLogs(Recorder):
    def setUp(self):
        super().setUp()
        self.logs = self.folder / "logs"
        self.config = self.write(one_axis("{speed_rpm: 60}") + f"""
recorder:
  directory: {self.logs}
  logs:
    events: {{channels: '^POSITION|^T$', invert: true, keep: 5y}}
    positions: {{channels: '^POSITION|^T$', keep: 1h, quota: 20MB}}
""")

    def files(self, log):
        return sorted(self.logs.glob(f"test-{log}_*.lcm"))

    def store(self, log, begun, ended):
        """A log that began and ended so many minutes ago."""
        now = int(datetime.datetime.now(datetime.timezone.utc).timestamp()) * 1_000_000
        stamp = datetime.datetime.fromtimestamp((now - begun * MINUTE) / 1e6, datetime.timezone.utc)
        path = self.logs / f"test-{log}_{stamp:%Y%m%dT%H%M%SZ}.lcm"
        self.logs.mkdir(exist_ok=True)
        return lcm_log.write(path, [(0, "T", b"1234"), ((begun - ended) * MINUTE, "T", b"1234")], now - begun * MINUTE)

    def wait_listening(self, *names):
        wait_for(lambda: sorted(line["name"] for line in self.lines("record", "start")) == sorted(names), "all logs")

    def test_each_log_holds_its_channels(self):
        process = self.recorder("--config", self.config)
        self.wait_listening("events", "positions")
        self.sender.send(100)
        self.sender.send(10, channel="E")
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(30), 0, self.log("record"))
        positions, = self.files("positions")
        events, = self.files("events")
        self.assertEqual(self.recorded(positions), list(range(100)))
        self.assertEqual(numbers(lcm_log.events(events), "E"), list(range(100, 110)))
        self.assertEqual(self.recorded(events), [])
        self.assertEqual(sorted(line["name"] for line in self.lines("record", "end")), ["events", "positions"])

    def test_logs_go_when_their_last_event_is_too_old(self):
        gone = [self.store("positions", 300, 200), self.store("positions", 200, 61)]
        kept = [self.store("positions", 90, 30), self.store("events", 300, 200)]
        process = self.recorder("--config", self.config)
        wait_for(lambda: not any(path.exists() for path in gone), "the old logs to be gone")
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(30), 0, self.log("record"))
        for path in kept:
            self.assertTrue(path.exists(), path)
        self.assertEqual(len(self.files("positions")), 2, "the kept one and the new one")

    def test_only_one_recorder_writes_them(self):
        process = self.recorder("--config", self.config)
        code, _, err = self.axlecast("record", "--config", self.config)
        self.assertEqual(code, 4, err)
        self.assertIn(f"held by process {process.pid}", err)
        code, _, err = self.axlecast("record", "--config", self.config, "--channel", "x")
        self.assertEqual(code, 2, err)
        self.assertIn("--channel needs a FILE", err)

    def test_up_starts_the_recorder_and_ends_it_last(self):
        code, out, err = self.axlecast("up", self.config, "--seconds", "4", "--json", limit=120)
        self.assertEqual(code, 0, out + err)
        positions, = self.files("positions")
        events, = self.files("events")
        self.assertIn("POSITION/axis1", dict(lcm_log.events(positions)))
        channels = [channel for channel, _ in lcm_log.events(events)]
        self.assertIn("DEVICE/axis1", channels)
        self.assertIn("RECORDER/events", channels)
        self.assertNotIn("POSITION/axis1", channels)
        code, out, err = self.axlecast("log", "verify", events, "--json")
        self.assertEqual(code, 0, out + err)

    def test_a_folder_that_cannot_be_written_is_named(self):
        self.logs.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", "ro", "tmpfs", self.logs], check=True)
        self.addCleanup(subprocess.run, ["umount", self.logs], check=True)
        code, _, err = self.axlecast("record", "--config", self.config)
        self.assertEqual(code, 4, err)
        self.assertIn(f"{self.logs}: Read-only file system; choose a `directory`", err)

    def test_a_folder_that_cannot_be_made_is_named(self):
        self.logs.write_text("a file")
        done = subprocess.run([BIN / "axlecast", "record", "--config", self.config], capture_output=True, text=True,
                              timeout=60)
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn(f"{self.logs}: cannot be created", done.stderr)
        code, out, _ = self.axlecast("check-config", self.config, "--json")
        self.assertEqual((code, json.loads(out)["recorder"]["directory"]), (0, str(self.logs)))


if __name__ == "__main__":
    unittest.main(verbosity=2)
