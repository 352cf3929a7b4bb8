#!/usr/bin/env python3
"""The queries that prometheus-postgres-exporter runs for us: each returns, as a reader, the labels and numbers that its file declares."""
import datetime
import unittest
from pathlib import Path

import yaml

from cluster import Cluster, Pair
from fleet_schema import install_schema
from synthetic_machine import fill

FILE = Path(__file__).resolve().parents[2] / "packaging" / "prometheus" / "axlecast-fleet-queries.yaml"
QUERIES = yaml.safe_load(FILE.read_text(encoding="utf-8"))
NUMBERS = {"integer", "bigint", "double precision"}


def read(cluster, name):
    """Rows of a query, by column; None of NULL."""
    query = QUERIES[name]["query"]
    columns = [row[0] for row in cluster.sql(query + "\\gdesc", user="exporter")]
    return [dict(zip(columns, row)) for row in cluster.sql(query, user="exporter")]


class Exporter(unittest.TestCase):
    def test_columns_are_the_declared_labels_and_numbers(self):
        with Cluster() as cluster:
            install_schema(cluster, reader="exporter")
            for name, part in QUERIES.items():
                types = dict(cluster.sql(part["query"] + "\\gdesc", user="exporter"))
                declared = {column: what["usage"] for metric in part["metrics"] for column, what in metric.items()}
                self.assertEqual(set(types), set(declared), name)
                for column, usage in declared.items():
                    self.assertIn(types[column], {"text"} if usage == "LABEL" else NUMBERS, f"{name}.{column}")
                    self.assertIn(usage, ("LABEL", "GAUGE", "COUNTER"))
            self.assertEqual(read(cluster, "axlecast_fleet_machine"), [])

            end = datetime.datetime.now(datetime.timezone.utc).replace(microsecond=0) - datetime.timedelta(minutes=20)
            fill(cluster, "press3", end, hours=1)
            machine, = read(cluster, "axlecast_fleet_machine")
            self.assertEqual((machine["machine"], machine["lag_bytes"], machine["holes_total"], machine["odd_total"]), ("press3", "123456", "1", "1"))
            for age in ("batch_age_seconds", "data_age_seconds"):
                self.assertAlmostEqual(float(machine[age]), 1200, delta=300)

            cluster.sql("INSERT INTO axlecast.machine (name, installation) VALUES ('never', gen_random_uuid())")
            never = next(row for row in read(cluster, "axlecast_fleet_machine") if row["machine"] == "never")
            self.assertIsNone(never["data_age_seconds"])
            self.assertLess(float(never["batch_age_seconds"]), 300)

    def test_a_missing_standby_is_seen(self):
        with Pair() as pair:
            install_schema(pair.primary, reader="exporter")
            database, = read(pair.primary, "axlecast_fleet_database")
            self.assertEqual((database["standby_missing"], database["partition_days_ahead"]), ("0", "8"))
            self.assertGreater(float(database["size_bytes"]), 1e6)
            pair.standby.kill()
            pair.primary.wait_for("SELECT count(*) FROM pg_stat_replication", "0", database="postgres")
            self.assertEqual(read(pair.primary, "axlecast_fleet_database")[0]["standby_missing"], "1")


if __name__ == "__main__":
    unittest.main()
