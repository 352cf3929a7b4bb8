"""Views of a large database read by index what a query names: no plan has a scan of a whole table of readings or events."""

import json
import os
import pathlib
import unittest

from cluster import Cluster

SCHEMA = pathlib.Path(os.environ["AXLECAST_SOURCE"]) / "tools/fleet/schema"
MACHINES = 10
DAY = "timestamptz '2026-03-10 00:00+00'"
LARGE = ("position_minute", "bus_health", "command", "alarm")
FILL = f"""
SELECT axlecast.ensure_partitions(({DAY} - interval '6 days')::date, ({DAY} + interval '1 day')::date);
INSERT INTO axlecast.machine (name, installation) SELECT 'm' || i, gen_random_uuid() FROM generate_series(1, {MACHINES}) i;
INSERT INTO axlecast.device (machine, name) SELECT m.id, 'axis' || i FROM axlecast.machine m, generate_series(1, 3) i ORDER BY 1, 2;
INSERT INTO axlecast.stream (device, boot_id, datum_epoch, counts_per_turn, unit, unit_per_count, seen)
  SELECT d.id, b, 0, 4096, 4, 0.5, {DAY} - interval '5 days' FROM axlecast.device d, generate_series(1, 2) b;
INSERT INTO axlecast.position_minute (t, n, valid, missed, stream, flags_or, flags_and)
  SELECT {DAY} - i * interval '1 min' - interval '2 days' * (s.boot_id - 1), 15000, 14990, 10, s.id, 1, 1
  FROM generate_series(1, 2880) i, axlecast.stream s;
INSERT INTO axlecast.bus_health (t, boot_id, exchanges, good, late, rx_dropped, errors, machine, bus, family, port, state, message, log, seq)
  SELECT {DAY} - i * interval '30 s', 1, 1000000 - i * 100, 1000000 - i * 101, 0, 0, ARRAY[i, 0, 0, i], m.id, 'bus' || b, 'f', 'p' || b, 'up', '{{}}', 1, i
  FROM generate_series(1, 5000) i, axlecast.machine m, generate_series(1, 2) b;
INSERT INTO axlecast.command (t, machine, device, command_id, operation, state, finding, is_final, verified, outcome, reason_code, text, boot_id, seq,
                              message, log)
  SELECT {DAY} - i * interval '1 min' + interval '1 s' * n, m.id, 'axis' || 1 + i % 3, md5(m.id || ' ' || i)::uuid, 'zero', state, '', n = 2, n = 2,
         CASE n WHEN 2 THEN state END, 0, '', 1, 1, '{{}}', 1
  FROM generate_series(1, 5000) i, axlecast.machine m, unnest(ARRAY['issued', 'succeeded']) WITH ORDINALITY AS s (state, n);
INSERT INTO axlecast.alarm (t, machine, device, boot_id, code, source, name, severity, state, alarm_state, text, first_utime, last_utime, count, cause,
                            message, log)
  SELECT {DAY} - i * interval '1 min', m.id, 'axis' || a, 1, i % 4, 'device', 'alarm' || i % 4, 'error',
         CASE i / 4 % 2 WHEN 0 THEN (ARRAY['appeared', 'cleared'])[1 + (a + i % 4) % 2] ELSE 'appeared' END, 'live', '', i, 2, 1, '', '{{}}', 1
  FROM generate_series(1, 4000) i, axlecast.machine m, generate_series(1, 3) a;
ANALYZE;
"""


class Plans(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cluster = cls.enterClassContext(Cluster())
        cls.cluster.create_database()
        cls.sql, cls.value = cls.cluster.sql, cls.cluster.value
        cls.sql("BEGIN; SET client_min_messages = warning;" + "\n".join(path.read_text() for path in sorted(SCHEMA.glob("*.sql"))) + "COMMIT;" + FILL)

    def nodes(self, plan):
        yield plan
        for child in plan.get("Plans", []):
            yield from self.nodes(child)

    def assert_by_index(self, query, most):
        """No large table is scanned as a whole, and at most `most` rows are read of them."""
        plan = json.loads("\n".join(row[0] for row in self.sql(f"EXPLAIN (ANALYZE, TIMING OFF, FORMAT JSON) {query}")))[0]["Plan"]
        read = 0
        for node in self.nodes(plan):
            if node.get("Relation Name", "").startswith(LARGE):
                rows = (node["Actual Rows"] + node.get("Rows Removed by Filter", 0)) * node["Actual Loops"]
                if rows > 0:  # a scan of an empty partition costs nothing
                    self.assertNotEqual(node["Node Type"], "Seq Scan", f"{node['Relation Name']}: {query}")
                read += rows
        self.assertGreater(read, 0, query)
        self.assertLessEqual(read, most, query)

    def test_availability_reads_the_days_that_are_asked_for(self):
        day = f"{DAY} - interval '1 day'"
        self.assert_by_index(f"SELECT * FROM axlecast.availability WHERE machine = 'm3' AND device = 'axis2' AND day = {day}", 1500)
        self.assert_by_index(f"SELECT * FROM axlecast.availability WHERE machine = 'm3' AND day >= {day} AND day < {DAY}", 4500)
        self.assertEqual(self.sql(f"SELECT (extract(epoch FROM {DAY} - day) / 86400)::int, n, valid, missed, minutes FROM axlecast.availability "
                                  "WHERE machine = 'm3' AND device = 'axis2' ORDER BY 1"),
                         [[str(age), "21600000", "21585600", "14400", "1440"] for age in (1, 2, 3, 4)])

    def test_error_rates_read_the_hours_that_are_asked_for(self):
        hour = f"{DAY} - interval '5 h'"
        self.assert_by_index(f"SELECT * FROM axlecast.error_rates_by_cable WHERE machine = 'm3' AND hour >= {hour} AND hour < {DAY}", 1250)
        rows = self.sql(f"SELECT bus, port, exchanges, failed, timeouts, driver_starts FROM axlecast.error_rates_by_cable WHERE machine = 'm3' AND hour = {hour} "
                        "ORDER BY bus")
        self.assertEqual(rows, [["bus1", "p1", "11900", "-119", "119", "1"], ["bus2", "p2", "11900", "-119", "119", "1"]])

    def test_commands_are_found_by_machine_and_time(self):
        times = f"t BETWEEN {DAY} - interval '1 h' AND {DAY}"
        self.assert_by_index(f"SELECT * FROM axlecast.commands WHERE machine = 'm3' AND {times}", 4 * 60 * MACHINES)
        self.assert_by_index(f"SELECT * FROM axlecast.commands WHERE machine = 'm3' AND device = 'axis1' AND {times}", 4 * 60 * MACHINES)
        self.assertEqual(self.sql(f"SELECT count(*), min(outcome) FROM axlecast.commands WHERE machine = 'm3' AND {times}"), [["60", "succeeded"]])

    def test_alarms_are_found_by_machine_and_time(self):
        self.assert_by_index(f"SELECT * FROM axlecast.alarms WHERE machine = 'm3' AND t BETWEEN {DAY} - interval '1 h' AND {DAY}", 3 * 60 * MACHINES)

    def test_alarms_that_are_present_are_found_without_their_history(self):
        self.assert_by_index("SELECT * FROM axlecast.present_alarms WHERE machine = 'm3'", 13)
        self.assertEqual(self.sql("SELECT device, code, state FROM axlecast.present_alarms WHERE machine = 'm3' EXCEPT "
                                  "SELECT device, code, state FROM (SELECT DISTINCT ON (device, source, code) * FROM axlecast.alarms WHERE machine = 'm3' "
                                  "ORDER BY device, source, code, t DESC) a WHERE state <> 'cleared'"), [])
        self.assertEqual(self.value("SELECT count(*) FROM axlecast.present_alarms"),
                         self.value("SELECT count(*) FROM (SELECT DISTINCT ON (machine, device, source, code) * FROM axlecast.alarms "
                                    "ORDER BY machine, device, source, code, t DESC) a WHERE state <> 'cleared'"))


if __name__ == "__main__":
    unittest.main()
