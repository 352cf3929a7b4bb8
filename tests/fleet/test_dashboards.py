#!/usr/bin/env python3
"""Every query of every dashboard in packaging/grafana runs against a real PostgreSQL, as a reader, with what Grafana makes of its text, and
returns what its panel needs."""
import datetime
import unittest

from cluster import Cluster
from dashboards import DASHBOARDS, SOURCE_TYPE, opened, targets
from fleet_schema import install_schema
from synthetic_machine import fill

NUMBERS = {"smallint", "integer", "bigint", "numeric", "real", "double precision"}
TIMES = {"timestamp with time zone"}
TEXTS = {"text"}
UNSUITABLE = {"interval", "jsonb", "bytea"}  # Grafana shows them as text, or not at all


class Texts(unittest.TestCase):
    """What the files must have whatever the database holds."""

    def test_there_are_three(self):
        self.assertEqual(list(DASHBOARDS), ["axlecast-axis.json", "axlecast-fleet.json", "axlecast-machine.json"])

    def test_each_is_a_dashboard(self):
        for name, dashboard in DASHBOARDS.items():
            with self.subTest(name):
                self.assertEqual(dashboard["uid"], name.removesuffix(".json"))
                self.assertGreaterEqual(dashboard["schemaVersion"], 39)
                self.assertTrue(dashboard["title"])
                self.assertNotIn("id", dashboard)  # of the server from which it was exported
                identifiers = [panel["id"] for panel in dashboard["panels"]]
                self.assertEqual(len(identifiers), len(set(identifiers)))

    def test_each_panel_has_a_query_of_the_chosen_database(self):
        for name, dashboard in DASHBOARDS.items():
            for panel in dashboard["panels"]:
                self.assertTrue(panel["targets"] and panel["title"], f"{name}: {panel}")
            for where, _, query in targets(dashboard):
                with self.subTest(f"{name}: {where}"):
                    self.assertEqual(query["datasource"], {"type": SOURCE_TYPE, "uid": "${datasource}"})
                    self.assertTrue(query["rawSql"].strip())
                    self.assertTrue(query["rawQuery"])

    def test_panels_do_not_overlap(self):
        for name, dashboard in DASHBOARDS.items():
            taken = {}
            for panel in dashboard["panels"]:
                place = panel["gridPos"]
                self.assertLessEqual(place["x"] + place["w"], 24)
                for cell in ((x, y) for x in range(place["x"], place["x"] + place["w"]) for y in range(place["y"], place["y"] + place["h"])):
                    self.assertNotIn(cell, taken, f"{name}: {panel['title']} covers {taken.get(cell)}")
                    taken[cell] = panel["title"]


class Queries(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cluster = cls.enterClassContext(Cluster())
        install_schema(cls.cluster, reader="grafana")
        cls.end = datetime.datetime.now(datetime.timezone.utc).replace(microsecond=0)
        for machine in ("press3", "o'brien"):  # a quote, as in the names of people
            fill(cls.cluster, machine, cls.end)

    def sql(self, text):
        return self.cluster.sql(text, user="grafana")

    def columns(self, text):
        """(name, type) of each column."""
        return [tuple(row) for row in self.sql(text.rstrip().rstrip(";") + "\n\\gdesc")]

    def shown(self, dashboard, length, interval_ms):
        return opened(dashboard, self.sql, "axlecast", self.end - length, self.end, interval_ms)

    def short_and_long(self, dashboard):
        yield self.shown(dashboard, datetime.timedelta(minutes=2), 100)
        yield self.shown(dashboard, datetime.timedelta(hours=1), 5_000)
        yield self.shown(dashboard, datetime.timedelta(days=2), 300_000)

    def test_variables_choose_a_source_and_machines(self):
        for name, dashboard in DASHBOARDS.items():
            with self.subTest(name):
                variables = {variable["name"]: variable for variable in dashboard["templating"]["list"]}
                self.assertEqual((variables["datasource"]["type"], variables["datasource"]["query"]), ("datasource", SOURCE_TYPE))
                self.assertEqual(variables["source"]["query"], "axlecast,fleet")
                state = self.shown(dashboard, datetime.timedelta(hours=1), 5_000)
                self.assertIn("o'brien", state.variables["machine"])
                if "device" in variables:
                    self.assertIn("axis1", state.variables["device"])

    def test_each_query_returns_rows_with_the_columns_of_its_panel(self):
        for name, dashboard in DASHBOARDS.items():
            states = list(self.short_and_long(dashboard))
            for where, kind, query in targets(dashboard):
                with self.subTest(f"{name}: {where}"):
                    rows = 0
                    for state in states:
                        text = state.query(query["rawSql"])
                        self.check_columns(kind, query["format"], self.columns(text))
                        found = self.sql(text)
                        rows += len(found)
                        if query["format"] == "time_series":
                            self.check_order(self.columns(text), found)
                    self.assertGreater(rows, 0, text)

    def test_positions_are_shown_in_every_range(self):
        """Of samples, seconds and minutes one answers, whatever the range."""
        for name in ("axlecast-axis.json", "axlecast-machine.json"):
            for state in self.short_and_long(DASHBOARDS[name]):
                for panel in DASHBOARDS[name]["panels"]:
                    if any("position_1s" in query["rawSql"] for query in panel["targets"]):
                        with self.subTest(f"{name}: {panel['title']} from {state.start}"):
                            self.assertTrue(any([self.sql(state.query(query["rawSql"])) for query in panel["targets"]]))

    def check_columns(self, kind, form, columns):
        types = dict(columns)
        self.assertEqual(len(types), len(columns), "two columns with one name")
        self.assertFalse({name: given for name, given in columns if given in UNSUITABLE or given.endswith("[]")})
        numbers = [name for name, given in columns if given in NUMBERS]
        self.assertEqual(form, "time_series" if kind in ("timeseries", "state-timeline") else "table")
        if form == "time_series":
            self.assertIn(types.get("time"), TIMES)
            self.assertTrue(numbers)
            self.assertEqual(set(types.values()) - NUMBERS - TIMES - TEXTS, set())
            self.assertEqual(list(types.values()).count("timestamp with time zone"), 1)
        elif kind == "annotation":
            self.assertIn(types.get("time"), TIMES)
            self.assertIn(types.get("text"), TEXTS)
        elif kind == "stat":
            self.assertEqual(len(numbers), len(columns), "a stat panel shows numbers")
        elif kind == "barchart":
            self.assertIn(columns[0][1], TEXTS)
            self.assertEqual(len(numbers), len(columns) - 1)

    def check_order(self, columns, rows):
        """Grafana refuses a long table that is not in the order of time; a text column is the label of a series."""
        position = [name for name, _ in columns].index("time")
        labels = [index for index, (_, given) in enumerate(columns) if given in TEXTS]
        times = [datetime.datetime.fromisoformat(row[position] + ":00") for row in rows]
        self.assertEqual(times, sorted(times))
        points = [(row[position], *(row[index] for index in labels)) for row in rows]
        self.assertEqual(len(points), len(set(points)), "two values of one series at one time")

    def test_overrides_name_columns_that_exist(self):
        for name, dashboard in DASHBOARDS.items():
            state = self.shown(dashboard, datetime.timedelta(hours=1), 5_000)
            for panel in dashboard["panels"]:
                columns = {column for query in panel["targets"] for column, _ in self.columns(state.query(query["rawSql"]))}
                for override in panel["fieldConfig"]["overrides"]:
                    with self.subTest(f"{name}: {panel['title']}"):
                        self.assertIn(override["matcher"]["options"], columns)

    def test_values_of_variables_cannot_leave_their_quotes(self):
        state = self.shown(DASHBOARDS["axlecast-machine.json"], datetime.timedelta(hours=1), 5_000)
        state.variables["machine"] = "press3' OR 'a' = 'a"
        alarms = next(query for where, _, query in targets(DASHBOARDS["axlecast-machine.json"]) if where.startswith("Alarms"))
        self.assertEqual(self.sql(state.query(alarms["rawSql"])), [])


if __name__ == "__main__":
    unittest.main()
