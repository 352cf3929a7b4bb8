#!/usr/bin/env python3
"""A pair of a primary and a standby: the primary is killed under a writer, and nothing is lost or doubled (docs/fleet.md, "A pair")."""
import sys
import threading
import time
import unittest

from cluster import Pair
from fleet_schema import install_schema
from ledger_writer import SETUP, LedgerWriter

LIMIT_S = 120
ROWS_OF_A_BATCH = 10


class PairTest(unittest.TestCase):
    def start(self, **settings):
        self.pair = self.enterContext(Pair(**settings))
        install_schema(self.pair.primary)
        self.pair.primary.sql(SETUP)
        self.stopped = threading.Event()
        self.writer = LedgerWriter(self.pair.connection())
        self.thread = threading.Thread(target=self.writer.run, args=(self.stopped.is_set,))
        self.thread.start()
        self.addCleanup(self.stop_writer)

    def stop_writer(self):
        self.stopped.set()
        self.thread.join()
        self.writer.close()

    def wait_until(self, reached, what):
        deadline = time.monotonic() + LIMIT_S
        while not reached():
            self.assertLess(time.monotonic(), deadline, what)
            self.assertTrue(self.thread.is_alive(), what)
            time.sleep(0.01)

    def wait_for_batches(self, number):
        wanted = self.writer.batches + number
        self.wait_until(lambda: self.writer.batches >= wanted, "the writer gets no acknowledgements")

    def fail_over(self):
        """Kills the primary and promotes the standby. Returns what was acknowledged, and the ledger of the new primary."""
        restarts = len(self.writer.restarts)
        self.pair.primary.kill()
        self.pair.set_standby_frozen(False)
        self.pair.promote()
        self.wait_until(lambda: len(self.writer.restarts) > restarts, "the writer does not find the new primary")
        behind, ledger = self.writer.restarts[restarts]
        self.wait_for_batches(50)
        self.stop_writer()
        print(f"\n{self.id()}: {behind} batches acknowledged at the kill, {ledger} on the new primary; "
              f"longest time without an acknowledgement {self.writer.longest_gap_s:.2f} s", file=sys.stderr)
        return behind, ledger

    def check_each_once(self):
        ledger, rows, distinct, least, greatest = map(int, self.pair.standby.sql(
            "SELECT (SELECT upto FROM axlecast.log), count(*), count(DISTINCT (seq0, stream)), min(seq0), max(seq0) "
            "FROM axlecast.position_chunk")[0])
        self.assertEqual(ledger, self.writer.behind)
        self.assertEqual((rows, distinct, least, greatest), (ledger * ROWS_OF_A_BATCH, ledger * ROWS_OF_A_BATCH, 0, ledger - 1))

    def test_a_killed_primary_loses_nothing(self):
        self.start()
        self.wait_for_batches(100)
        behind, ledger = self.fail_over()
        self.assertGreaterEqual(ledger, behind)
        self.check_each_once()

    def test_a_commit_that_waits_for_the_standby_is_no_acknowledgement(self):
        self.start()
        self.wait_for_batches(100)
        self.pair.set_standby_frozen(True)
        self.pair.primary.wait_for("SELECT EXISTS (SELECT FROM pg_stat_activity WHERE wait_event = 'SyncRep')", database="postgres")
        behind, ledger = self.fail_over()
        self.assertGreaterEqual(ledger, behind)
        self.check_each_once()

    def test_a_cancelled_wait_is_no_acknowledgement(self):
        self.start()
        self.wait_for_batches(100)
        self.pair.set_standby_frozen(True)
        waiting = "SELECT EXISTS (SELECT FROM pg_stat_activity WHERE wait_event = 'SyncRep')"
        self.pair.primary.wait_for(waiting, database="postgres")
        behind = self.writer.behind
        self.pair.primary.sql("SELECT pg_cancel_backend(pid) FROM pg_stat_activity WHERE wait_event = 'SyncRep'", database="postgres")
        # The primary has the batch, the writer regards it as open, reads the ledger and waits with the next batch.
        self.wait_until(lambda: self.writer.restarts[:1] == [(behind, behind + 1)], "the writer has not read the ledger again")
        self.pair.primary.wait_for(waiting, database="postgres")
        self.assertEqual(self.writer.behind, behind)
        self.fail_over()
        self.check_each_once()

    def test_without_synchronous_commit_what_was_lost_is_sent_again(self):
        self.start()
        self.pair.primary.set(synchronous_standby_names="")
        self.wait_for_batches(50)
        self.pair.set_standby_frozen(True)
        self.wait_for_batches(500)  # more than what the sockets between the two hold
        behind, ledger = self.fail_over()
        self.assertLess(ledger, behind)
        self.check_each_once()


if __name__ == "__main__":
    unittest.main()
