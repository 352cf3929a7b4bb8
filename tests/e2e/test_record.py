"""axlecast record: stock tools read what it writes; bursts, kills, full disks and kernel drops lose nothing that is not
told, exactly."""

import signal
import socket
import struct
import subprocess
import unittest

import lcm_log
from machine import BIN, wait_for
from recording import GROUP, OWN, URL, Recorder, Sender, numbers

DISK_FULL = 2  # recorder_health_t


class Record(Recorder):
    # -- what stock tools see

    def test_bursts_are_recorded_whole_and_stock_tools_read_them(self):
        process = self.record(self.log_path)
        self.sender.send(1_000)
        self.sender.send(10_000)
        code, summary = self.end(process)
        self.assertEqual(code, 0, summary)
        self.assertTrue(summary["whole"])
        self.assertEqual(self.recorded(), list(range(11_000)))
        events = list(lcm_log.stock_events(self.log_path))
        self.assertEqual(numbers(events), list(range(11_000)))
        self.assertEqual(events[0][0], "AXLECAST/recorder")
        self.assertIn(b"struct position_t", dict(events)["AXLECAST/schema"])
        self.assertEqual(events, list(lcm_log.events(self.log_path)))

        listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(listener.close)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 64 << 20)
        listener.bind((GROUP, 7700))
        listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + bytes(4))
        played = subprocess.run(["lcm-logplayer", "-l", f"udpm://{GROUP}:7700?ttl=0", "-e", "AXLECAST/schema|T",
                                 self.log_path], capture_output=True, text=True, timeout=120)
        self.assertEqual(played.returncode, 0, played.stderr)
        self.assertIn(b"AXLECAST/schema\0", listener.recv(65536))

    def test_command_port_channels_and_filters(self):
        other = Sender(port=7668)
        self.addCleanup(other.socket.close)
        both = self.start("both", BIN / "axlecast", "record", self.log_path, "--json", "--name", "both", "--channel", "^T$")
        rest = self.record(self.folder / "rest.lcm", "--channel", "^T$", "--invert")
        wait_for(lambda: self.lines("both", "start"), "the other recorder")
        self.sender.send(3)
        other.send(2)
        self.sender.send(1, channel="TT")
        self.assertEqual(self.end(rest)[0], 0)
        self.assertEqual(self.end(both, "both")[0], 0)
        self.assertEqual(sorted(self.recorded()), [0, 0, 1, 1, 2])
        channels = [channel for channel, _ in lcm_log.events(self.folder / "rest.lcm")]
        self.assertIn("TT", channels)
        self.assertNotIn("T", channels)

    # -- endings

    def test_sigterm_writes_what_has_arrived(self):
        process = self.record(self.log_path)
        self.stand_still(process)
        self.sender.send(300)
        process.send_signal(signal.SIGTERM)
        process.send_signal(signal.SIGCONT)
        self.assertEqual(process.wait(30), 0, self.log("record"))
        self.assertEqual(self.recorded(), list(range(300)))

    def test_a_killed_recording_is_continued(self):
        process = self.record(self.log_path)
        self.sender.send(100)
        wait_for(lambda: self.readable() == 100, "100 messages in the file")
        self.kill(process)
        with open(self.log_path, "ab") as log:
            log.write(struct.pack(">IqqII", lcm_log.SYNC, 1, 1, 1, 1000) + b"Tcut")
        process = self.record(self.log_path, "--append", name="again")
        self.assertIn("removes a torn end of 32 bytes", self.log("again"))
        self.sender.send(100)
        self.assertEqual(self.end(process, "again")[0], 0)
        self.assertEqual(self.recorded(), list(range(200)))
        self.assertEqual(numbers(lcm_log.stock_events(self.log_path)), list(range(200)))

    def test_an_existing_file_is_never_replaced(self):
        self.log_path.write_bytes(b"precious")
        for options in ((), ("--append",)):
            code, _, err = self.axlecast("record", self.log_path, "--url", URL, *options)
            self.assertEqual(code, 4, err)
            self.assertIn("choose another name", err)
        self.assertEqual(self.log_path.read_bytes(), b"precious")
        self.assertEqual(self.axlecast("record", "--channel", "a(", "--url", URL)[0], 2)

    def test_a_log_that_is_being_written_is_not_continued(self):
        process = self.record(self.log_path)
        self.sender.send(100)
        wait_for(lambda: self.readable() == 100, "100 messages in the file")
        code, _, err = self.axlecast("record", self.log_path, "--append", "--url", URL)
        self.assertEqual(code, 4, err)
        self.assertIn("another recorder writes it", err)
        self.sender.send(100)
        self.assertEqual(self.end(process)[0], 0)
        self.assertEqual(self.recorded(), list(range(200)))

    # -- splitting

    def test_split_logs_within_a_quota(self):
        folder = self.folder / "logs"
        folder.mkdir()
        (folder / "mine.lcm").write_bytes(b"x" * 5_000_000)
        process = self.record(f"{folder}/", "--split-size", "1MB", "--quota", "3MB")
        for _ in range(20):
            self.sender.send(1_000, size=400)
            wait_for(lambda: self.recorded_in(folder)[-1:] == [self.sender.sent - 1], "them to be written")
        code, summary = self.end(process)
        self.assertEqual(code, 0, summary)
        logs = sorted(folder.glob("test_*.lcm"))
        self.assertGreater(len(logs), 1)
        self.assertLessEqual(sum(log.stat().st_size for log in logs), 4 << 20)
        self.assertTrue((folder / "mine.lcm").exists())
        kept = []
        for log in logs:
            events = list(lcm_log.events(log))
            self.assertEqual(events[0][0], "AXLECAST/recorder")
            self.assertLessEqual(log.stat().st_size, 1 << 20)
            kept += numbers(events)
        self.assertEqual(kept, list(range(kept[0], 20_000)))

    def recorded_in(self, folder):
        """Of the newest log."""
        logs = sorted(folder.glob("test_*.lcm"), key=lambda log: (log.name[:21], len(log.name), log.name))
        try:
            return self.recorded(logs[-1]) if logs else []
        except (ValueError, struct.error):
            return []

    def test_only_what_surrounds_a_trigger(self):
        process = self.record(f"{self.folder}/", "--trigger", "^ESTOP$", "--pre-trigger", "60", "--post-trigger", "60")
        self.sender.send(10)
        self.assertEqual(list(self.folder.glob("test_*.lcm")), [])
        self.sender.send(1, channel="ESTOP")
        self.sender.send(5)
        code, summary = self.end(process)
        self.assertEqual(code, 0, summary)
        log, = self.folder.glob("test_*.lcm")
        self.assertEqual(self.recorded(log), [*range(10), *range(11, 16)])

    # -- disks

    def small_disk(self):
        disk = self.folder / "disk"
        disk.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", disk], check=True)
        self.addCleanup(subprocess.run, ["umount", disk], check=True)
        return disk

    def fill(self, health):
        """Sends until the disk is full, and some more."""
        def full():
            if health() and health().state == DISK_FULL:
                return True
            if self.sender.sent < 2_500:
                self.sender.send(20, size=1_000)
            return False

        wait_for(full, lambda: f"a full disk, {self.sender.sent} sent")
        self.assertIn("No space left", health().last_error)
        self.sender.send(50, size=1_000)

    def test_a_full_disk_is_told_and_keeps_what_it_took(self):
        path = self.small_disk() / "a.lcm"
        alarms = self.watch_alarms()
        process = self.record(path)
        self.fill(self.watch_health())
        wait_for(lambda: [entry.name for entry in alarms().entries] == ["disk_full"], "the alarm")
        code, summary = self.end(process)
        self.assertEqual(code, 4, summary)
        self.assertIn("No space left", summary["error"])
        self.assertIn("No space left", self.log("record"))
        kept = self.recorded(path)
        self.assertGreater(len(kept), 1_000)
        self.assertEqual(kept, list(range(len(kept))))
        own = sum(channel in OWN for channel, _ in lcm_log.events(path))
        self.assertEqual(summary["messages"], len(kept) + own)
        self.assertGreaterEqual(summary["lost_at_disk"], self.sender.sent - len(kept))

    def test_what_waits_for_a_full_disk_is_bounded_and_counted(self):
        path = self.small_disk() / "a.lcm"
        process = self.record(path, "--buffer", "20kB")
        self.fill(self.watch_health())
        self.sender.send(200, size=1_000)
        code, summary = self.end(process)
        self.assertEqual(code, 4, summary)
        self.assertGreater(summary["lost_in_memory"], 100)
        received = sum(sender["received"] for sender in summary["senders"])
        self.assertEqual(summary["messages"] + summary["lost_in_memory"] + summary["lost_at_disk"], received)
        own, = (sender for sender in summary["senders"] if sender["sender"].endswith(f":{self.sender.own_port()}"))
        self.assertEqual(own["received"], self.sender.sent)

    def test_a_disk_with_room_again_loses_nothing(self):
        disk = self.small_disk()
        (disk / "ballast").write_bytes(b"x" * 1_200_000)
        process = self.record(disk / "a.lcm")
        self.fill(self.watch_health())
        (disk / "ballast").unlink()
        wait_for(lambda: "accepts events again" in self.log("record"), "the disk to be used again")
        code, summary = self.end(process)
        self.assertEqual(code, 0, summary)
        self.assertEqual(self.recorded(disk / "a.lcm"), list(range(self.sender.sent)))

    # -- the kernel's drops

    HEALTH_URL = f"udpm://{GROUP}:7668?ttl=0"  # the first one given: its own messages are not among those dropped

    def test_kernel_drops_are_counted_exactly(self):
        process = self.record(self.log_path, "--url", self.HEALTH_URL, url=URL + "&recv_buf_size=8192")
        self.sender.send(10)
        wait_for(lambda: self.readable() == 10, "the first ones in the file")
        self.stand_still(process)
        self.sender.send(2_000)
        process.send_signal(signal.SIGCONT)
        wait_for(lambda: self.readable() > 10, "the next ones in the file")
        self.sender.send(1)
        code, summary = self.end(process)
        self.assertEqual(code, 3, summary)
        kept = self.recorded()
        self.assertEqual(kept[-1], 2_010)
        missing = self.sender.sent - len(kept)
        self.assertGreater(missing, 1_000)
        own, = (sender for sender in summary["senders"] if sender["sender"].endswith(f":{self.sender.own_port()}"))
        self.assertEqual(own["lost"], missing)
        self.assertEqual(own["received"], len(kept))
        self.assertEqual(summary["lost_by_number"], missing)
        self.assertEqual(summary["kernel_dropped"], missing)

    def test_drops_at_the_end_are_counted_though_no_number_tells_them(self):
        process = self.record(self.log_path, "--url", self.HEALTH_URL, url=URL + "&recv_buf_size=8192")
        self.sender.send(10)
        wait_for(lambda: self.readable() == 10, "the first ones in the file")
        self.stand_still(process)
        self.sender.send(2_000)
        process.send_signal(signal.SIGCONT)
        wait_for(lambda: self.readable() > 10, "the next ones in the file")
        self.stand_still(process)
        self.sender.send(2_000)
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGCONT)
        code = process.wait(30)
        summary = self.lines("record", "end")[-1]
        self.assertEqual(code, 3, summary)
        kept = self.recorded()
        behind_the_last = self.sender.sent - 1 - kept[-1]
        self.assertGreater(behind_the_last, 1_000)
        shown_by_gaps = kept[-1] + 1 - len(kept)
        self.assertGreater(shown_by_gaps, 1_000)
        self.assertEqual(summary["lost_by_number"], shown_by_gaps)
        self.assertEqual(summary["kernel_dropped"] - summary["lost_by_number"], behind_the_last)


if __name__ == "__main__":
    unittest.main(verbosity=2)
