"""axlecast record on a disk that reports errors (EIO, from disk_faults.so in front of the C library): what was written
stays, what waits is written when the disk is well again, and nothing is passed over."""

import unittest

import lcm_log
from machine import BIN, wait_for
from recording import OWN, Recorder, numbers

ERROR = 3  # recorder_health_t


class RecordErrors(Recorder):
    def faulty(self):
        """A recorder on a disk that is well yet, and a function that gives it a fault."""
        fault = self.write("", "fault")
        health = self.watch_health()
        process = self.record(self.log_path, env={"LD_PRELOAD": str(BIN.parent / "campaign/axlecast_disk_faults.so"),
                                                  "AXLECAST_DISK_FAULT": str(fault)})
        self.sender.send(100)
        wait_for(lambda: self.readable() == 100, "100 messages in the file")
        return process, fault.write_text, health

    def test_what_a_failed_write_left_out_is_written_later(self):
        process, fail, health = self.faulty()
        fail("write")
        self.sender.send(100)
        wait_for(lambda: health() and health().state == ERROR, "the health to tell of it")
        self.assertIn("Input/output error", health().last_error)
        self.assertEqual(numbers(lcm_log.events(self.log_path))[:100], list(range(100)), "whole records only")
        self.sender.send(100)
        fail("")
        wait_for(lambda: "accepts events again" in self.log("record"), "the disk to be used again")
        self.sender.send(100)
        wait_for(lambda: health().state == 0, "the health to be well")
        code, summary = self.end(process)
        self.assertEqual((code, summary["whole"], summary["lost"]), (0, True, 0), summary)
        self.assertEqual(self.recorded(), list(range(400)))
        self.assertEqual(numbers(lcm_log.stock_events(self.log_path)), list(range(400)))
        self.assertEqual(self.axlecast("log", "verify", self.log_path)[0], 0, "every seal holds")

    def test_what_a_failing_disk_never_took_is_counted(self):
        process, fail, health = self.faulty()
        fail("write")
        self.sender.send(500)
        wait_for(lambda: health() and health().state == ERROR, "the health to tell of it")
        code, summary = self.end(process)
        self.assertEqual(code, 4, summary)
        self.assertIn("Input/output error", summary["error"])
        kept = self.recorded()
        self.assertGreaterEqual(len(kept), 100)
        self.assertEqual(kept, list(range(len(kept))))
        self.assertGreaterEqual(summary["lost_at_disk"], 600 - len(kept))
        own = sum(channel in OWN for channel, _ in lcm_log.events(self.log_path))
        self.assertEqual(summary["messages"], len(kept) + own)

    def test_a_failed_sync_is_not_forgotten(self):
        process, fail, health = self.faulty()
        fail("sync")
        self.sender.send(100)
        wait_for(lambda: health() and health().state == ERROR, "the health to tell of it")
        self.assertIn("may not be on the disk", health().last_error)
        alarms = self.watch_alarms()
        wait_for(lambda: alarms() and [entry.name for entry in alarms().entries] == ["disk_fails"], "the alarm")
        fail("")
        self.sender.send(100)
        wait_for(lambda: self.readable() == 300, "recording goes on")
        code, summary = self.end(process)
        self.assertEqual((code, summary["whole"]), (4, False), summary)
        self.assertIn("may not be on the disk", summary["error"])
        self.assertEqual(self.recorded(), list(range(300)))


if __name__ == "__main__":
    unittest.main(verbosity=2)
