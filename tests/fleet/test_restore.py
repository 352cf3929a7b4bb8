#!/usr/bin/env python3
"""A shard is restored from a dump that is older than its newest data: the ledger goes back with the rows, and the writer fills the rest
(docs/fleet.md, "Backup and restore")."""
import shutil
import subprocess
import threading
import time
import unittest

from cluster import Cluster, binaries, new_folder
from fleet_schema import install_schema
from ledger_writer import SETUP, LedgerWriter

LIMIT_S = 120
ROWS_OF_A_BATCH = 10


def command(program, *words, **options):
    done = subprocess.run([binaries() / program, *words], capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        raise RuntimeError(f"{program}: {done.stderr}")
    return done.stdout


class RestoreTest(unittest.TestCase):
    def setUp(self):
        self.folder = new_folder()
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.old, self.new = Cluster(self.folder, 5432), Cluster(self.folder, 5433)
        for cluster in (self.old, self.new):
            self.enterContext(cluster)
        install_schema(self.old)
        self.old.sql(SETUP)
        self.writer = LedgerWriter(f"host={self.folder},{self.folder} port=5432,5433 dbname=axlecast user=postgres")
        self.stopped = threading.Event()
        self.thread = threading.Thread(target=self.writer.run, args=(self.stopped.is_set,))
        self.thread.start()
        self.addCleanup(self.stop_writer)

    def stop_writer(self):
        self.stopped.set()
        self.thread.join()
        self.writer.close()

    def wait_for_batches(self, number):
        wanted = self.writer.batches + number
        deadline = time.monotonic() + LIMIT_S
        while self.writer.batches < wanted:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)

    def test_a_dump_of_a_running_shard_is_filled_up_by_the_writer(self):
        dump = self.folder / "dump"
        self.wait_for_batches(20)
        roles = command("pg_dumpall", "--roles-only", "-d", self.old.connection("postgres"))
        command("pg_dump", "-Fd", "-j", "2", "-f", dump, "-d", self.old.connection())
        self.wait_for_batches(50)
        self.old.kill()
        behind = self.writer.behind
        self.new.sql("\n".join(line for line in roles.splitlines() if " postgres" not in line), database="postgres")
        # The restored database gets its name last: a writer that came earlier would find a part of it.
        self.new.create_database("restored")
        command("pg_restore", "-j", "2", "--exit-on-error", "-d", self.new.connection("restored"), dump)
        restored = int(self.new.value("SELECT upto FROM axlecast.log", database="restored"))
        self.assertLess(restored, behind)
        self.new.sql("ALTER DATABASE restored RENAME TO axlecast", database="postgres")
        self.wait_for_batches(behind - restored + 50)
        self.stop_writer()
        self.assertIn((behind, restored), self.writer.restarts)
        ledger, rows, distinct = map(int, self.new.sql(
            "SELECT (SELECT upto FROM axlecast.log), count(*), count(DISTINCT (seq0, stream)) FROM axlecast.position_chunk")[0])
        self.assertEqual((rows, distinct), (ledger * ROWS_OF_A_BATCH, ledger * ROWS_OF_A_BATCH))
        self.assertGreater(ledger, behind)


if __name__ == "__main__":
    unittest.main()
