#!/usr/bin/env python3
"""Two shards and a coordinator that reads across them (docs/fleet.md, "Shards")."""
import datetime
import os
import signal
import unittest
from pathlib import Path

from cluster import Cluster, SqlError, children_of
from dashboards import DASHBOARDS, opened, targets
from fleet_schema import install_schema
from synthetic_machine import fill

COORDINATOR = Path(__file__).resolve().parents[2] / "packaging" / "fleet" / "coordinator.sql"
END = datetime.datetime.now(datetime.timezone.utc).replace(microsecond=0)
START = END - datetime.timedelta(hours=1)
MACHINES = {"left": ["press3", "o'brien"], "right": ["press4"]}
ROLLUPS = f"""SELECT machine, date_bin('1 min', t, '2000-01-01Z') AS minute, min(value_min), max(value_max), avg(value_mean), sum(n)
                FROM fleet.position_1s WHERE t BETWEEN '{START}' AND '{END}' GROUP BY machine, 2 ORDER BY 1, 2"""


def quoted(text):
    return "'" + text.replace("'", "''") + "'"


class Shards(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.coordinator = cls.enterClassContext(Cluster())
        cls.shards = {name: cls.enterClassContext(Cluster()) for name in MACHINES}
        for cluster in (cls.coordinator, *cls.shards.values()):
            install_schema(cluster, reader="grafana")
        for name, machines in MACHINES.items():
            for machine in machines:
                fill(cls.shards[name], machine, END, hours=1)
            cls.shards[name].sql("ANALYZE")
        cls.coordinator.sql(COORDINATOR.read_text(encoding="utf-8"))
        cls.coordinator.sql("INSERT INTO axlecast.shard (machine, connection) VALUES " + ", ".join(
            f"({quoted(machine)}, {quoted(cls.shards[name].connection(user='axlecast_writer'))})"
            for name, machines in MACHINES.items() for machine in machines))
        cls.attach()

    @classmethod
    def attach(cls):
        cls.coordinator.sql("SELECT axlecast.attach_shards('grafana')")

    def sql(self, text):
        return self.coordinator.sql(text, user="grafana")

    def plan(self, query):
        return "\n".join(row[0] for row in self.sql(f"EXPLAIN (VERBOSE, COSTS OFF) {query}"))

    def test_shards_aggregate_and_only_those_that_are_named_are_asked(self):
        plan = self.plan(ROLLUPS)
        remote = [line for line in plan.splitlines() if "Remote SQL" in line]
        self.assertEqual(len(remote), 2, plan)
        for line in remote:
            self.assertIn("min(value_min)", line)
            self.assertRegex(line, r"GROUP BY 1, 2")
        self.assertIn("Async Foreign Scan", plan)

        expected = [row for cluster in self.shards.values() for row in cluster.sql(ROLLUPS.replace("fleet.", "axlecast."), user="grafana")]
        self.assertGreater(len(expected), 150)
        self.assertEqual(sorted(self.sql(ROLLUPS)), sorted(expected))

        plan = self.plan("SELECT * FROM fleet.alarms WHERE machine = 'press4' AND t > now() - interval '1 h'")
        self.assertEqual(plan.count("Foreign Scan"), 1, plan)
        self.assertRegex(plan, r"Remote SQL: .*machine = 'press4'")

    def test_every_view_and_function_with_machines_is_there(self):
        views = {row[0] for row in self.sql("""SELECT table_name FROM information_schema.columns
            WHERE table_schema = 'axlecast' AND column_name = 'machine' AND data_type = 'text' AND table_name <> 'shard'""")}
        there = {row[0] for row in self.sql("SELECT table_name FROM information_schema.tables WHERE table_schema = 'fleet'")}
        self.assertGreater(len(views), 12)
        self.assertEqual(views - there, set())

        call = f"""samples('o''brien', 'axis2', '{END - datetime.timedelta(seconds=10)}', '{END}')"""
        samples = self.sql(f"SELECT * FROM fleet.{call}")
        self.assertEqual(len(samples), 2500)
        self.assertEqual(samples, self.shards["left"].sql(f"SELECT * FROM axlecast.{call}"))
        with self.assertRaisesRegex(SqlError, 'axlecast.shard has no row for the machine "press9"'):
            self.sql("SELECT * FROM fleet." + call.replace("o''brien", "press9"))

    def test_dashboards_read_all_shards(self):
        for name, dashboard in DASHBOARDS.items():
            states = [opened(dashboard, self.sql, "fleet", END - length, END, interval)
                      for length, interval in ((datetime.timedelta(minutes=2), 100), (datetime.timedelta(days=1), 300_000))]
            for where, _, query in targets(dashboard):
                with self.subTest(f"{name}: {where}"):
                    self.assertTrue(any([self.sql(state.query(query["rawSql"])) for state in states]))

    def test_a_dead_shard_costs_its_machines_only(self):
        self.shards["right"].kill()
        self.assertEqual(sorted(self.sql("SELECT machine FROM fleet.fleet_status")), [["o'brien"], ["press3"]])
        problems = {row[0]: row[1] for row in self.sql("SELECT machines::text, problem FROM axlecast.shards()")}
        self.assertIsNone(problems["{o'brien,press3}"])
        self.assertRegex(problems["{press4}"], "could not connect to server")
        with self.assertRaisesRegex(SqlError, "could not connect to server"):
            self.sql("SELECT count(*) FROM fleet.alarms")
        fleet = DASHBOARDS["axlecast-fleet.json"]
        state = opened(fleet, self.sql, "fleet", START, END, 5_000)
        for where, _, query in targets(fleet):
            with self.subTest(where):
                self.sql(state.query(query["rawSql"]))  # raises no error
        self.attach()  # does not need the dead one
        self.assertEqual(len(self.sql("SELECT machine FROM fleet.fleet_status")), 2)
        self.shards["right"].start()
        self.assertEqual(len(self.sql("SELECT machine FROM fleet.fleet_status")), 3)
        self.freeze("right")  # it accepts connections, and answers nothing
        self.assertEqual(len(self.sql("SELECT machine FROM fleet.fleet_status")), 2)

    def freeze(self, name):
        for pid in [self.shards[name].process.pid, *children_of(self.shards[name].process.pid)]:
            os.kill(pid, signal.SIGSTOP)

    def test_mistakes_are_named(self):
        self.shards["left"].sql("INSERT INTO axlecast.schema_version (version, axlecast) VALUES (9999, 'test')")
        problems = [row[0] for row in self.sql("SELECT problem FROM axlecast.shards() WHERE problem IS NOT NULL")]
        self.assertEqual(len(problems), 1)
        self.assertRegex(problems[0], "schema version 9999, the coordinator has .*axlecast fleet init")

        for connection in ("postgresql://db1/axlecast", "host=db1 nonsense"):
            with self.assertRaisesRegex(SqlError, "is not a list of name=value"):
                self.coordinator.sql(f"SELECT * FROM axlecast.connection_settings('{connection}')")
        self.assertEqual(self.coordinator.sql(r"SELECT * FROM axlecast.connection_settings($$host = 'a b\' c' dbname=d$$)"),
                         [["host", "a b' c"], ["dbname", "d"]])

        for text in ("SELECT axlecast.attach_shards('grafana')", "INSERT INTO fleet.trips (machine) VALUES ('press4')",
                     "INSERT INTO axlecast.shard VALUES ('x', 'host=y')"):
            with self.assertRaisesRegex(SqlError, "permission denied"):
                self.sql(text)


if __name__ == "__main__":
    unittest.main()
