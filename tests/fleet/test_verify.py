"""axlecast fleet verify: a log and what the database has of it."""

import json
import unittest

import lcm_log
from shipped_machine import MACHINE, SHIP, ShippedMachine, positions

DIFFERENT = 3


class Verify(ShippedMachine):
    def verify(self, *words):
        code, out, err = self.fleet("verify", "--json", *words, self.recorded)
        self.assertTrue(out, err)
        return code, json.loads(out)

    def different(self, *words):
        code, report = self.verify(*words)
        self.assertEqual((code, report["equal"]), (DIFFERENT, False), report)
        return "\n".join(report["differences"])

    def test_a_shipped_log_is_equal(self):
        for words in ((), ("--quick",), ("--complete",)):
            code, report = self.verify(*words)
            self.assertEqual((code, report["differences"]), (0, []))
        samples = len(list(positions(self.recorded)))
        self.assertEqual(report["devices"], [{"device": "axis1", "samples_in_log": samples, "samples_in_database": samples,
                                              "compared": True}])
        self.assertEqual(report["remaining"], 0)
        code, out, err = self.fleet("verify", self.recorded)
        self.assertEqual(code, 0, err)
        self.assertIn(": equal, ", out)

    def test_events_that_are_not_shipped_yet_are_counted(self):
        with open(self.recorded, "ab") as log:
            log.write(lcm_log.record(1_700_000_000_000_000, "POSITION/axis1", b"x" * 20, 10**6))
        code, report = self.verify()
        self.assertEqual((code, report["remaining"]), (0, 1), report)
        self.assertIn("1 events are not in the database yet", self.different("--complete"))

    def test_a_missing_chunk_is_a_difference(self):
        self.cluster.sql("DELETE FROM axlecast.position_chunk WHERE t0 = (SELECT t0 FROM axlecast.position_chunk ORDER BY t0 OFFSET 3 LIMIT 1)")
        self.assertIn("axis1, samples", self.different("--quick"))
        self.assertIn("axis1, minute", self.different())

    def test_a_chunk_that_is_there_twice_is_a_difference(self):
        self.cluster.sql("INSERT INTO axlecast.position_chunk SELECT * FROM axlecast.position_chunk ORDER BY t0 LIMIT 1")
        self.assertIn("axis1, samples", self.different())

    def test_other_values_are_a_difference_of_the_content_only(self):
        self.cluster.sql("""UPDATE axlecast.position_chunk SET t0 = t0 + interval '1 us', t1 = t1 + interval '1 us'
            WHERE t0 = (SELECT t0 FROM axlecast.position_chunk ORDER BY t0 OFFSET 3 LIMIT 1)""")
        self.assertEqual(self.verify("--quick")[0], 0)
        self.assertIn("with other values", self.different())

    def test_another_log_or_ledger_is_a_difference(self):
        self.cluster.sql("UPDATE axlecast.log SET chain = chain # 1")
        self.assertIn("CRC-32C of the seals", self.different())
        self.cluster.sql("UPDATE axlecast.log SET chain = chain # 1, bytes = bytes + 1")
        self.assertIn("bytes", self.different())
        self.cluster.sql("UPDATE axlecast.log SET bytes = bytes - 1, upto = upto + 1")
        self.assertIn("number of the last event", self.different())

    def test_a_changed_event_of_the_log_is_a_difference(self):
        data = bytearray(self.recorded.read_bytes())
        at = data.index(b"POSITION/axis1", len(data) // 2)
        data[at + len("POSITION/axis1") + 15] ^= 1  # the time of the position
        self.recorded.write_bytes(data)
        self.assertIn("with other values", self.different())

    def test_a_log_that_was_never_shipped_is_a_difference(self):
        self.cluster.sql("UPDATE axlecast.log SET host = 'other'")
        self.assertIn("nothing of this log", self.different())

    def test_a_renamed_machine_is_named(self):
        self.must("rename", MACHINE, "press3")
        self.fails(1, "verify", self.recorded)
        self.assertEqual(self.verify("--machine", "press3")[0], 0)

    def test_what_is_no_log_is_refused(self):
        other = self.folder / "other.lcm"
        other.write_bytes(b"no log")
        self.fails(1, "verify", other)
        self.fails(1, "verify", self.folder / "missing.lcm")
        self.fails(6, "verify", self.recorded, database="host=/nowhere dbname=a")


class VerifyDeadband(ShippedMachine):
    ship = SHIP.replace("detail: full", "detail: rollup")

    def test_reduced_positions_are_not_compared(self):
        code, out, err = self.fleet("verify", self.recorded)
        self.assertEqual(code, 0, out + err)
        self.assertIn("not compared", out)


if __name__ == "__main__":
    unittest.main()
