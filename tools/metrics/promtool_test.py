#!/usr/bin/env python3
"""Prometheus' own tools judge the metrics and the alert rules, and docs/metrics.md names what there is.

usage: promtool_test.py METRICS_PRINT
"""
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import yaml

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
DOCUMENT = ROOT / "docs" / "metrics.md"
FLEET_QUERIES = ROOT / "packaging" / "prometheus" / "axlecast-fleet-queries.yaml"

METRIC = re.compile(r"\baxlecast_[a-z_]*[a-z]\b")
ALERT = re.compile(r"^ *- alert: (\w+)$", re.MULTILINE)


def promtool(*arguments, text=None):
    return subprocess.run(["promtool", *arguments], input=text, capture_output=True, text=True, check=False)


def base_name(metric):
    """Of a histogram's series, the family's name."""
    return re.sub(r"_seconds_(bucket|sum|count)$", "_seconds", metric)


class RulesTest:
    """Checks a file of alert rules. A class that uses it sets `path`, `tests`, `document` and `families`: the metrics that exist."""

    def setUp(self):
        self.rules = self.path.read_text(encoding="utf-8")

    def test_rules(self):
        result = promtool("check", "rules", str(self.path))
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_rules_use_metrics_that_exist(self):
        used = {base_name(name) for name in METRIC.findall(self.rules)}
        self.assertGreater(len(used), 5)
        self.assertEqual(used - self.families, set())

    def test_alerts_fire_on_what_they_are_for(self):
        with tempfile.TemporaryDirectory() as folder:
            for file in (self.path, self.tests):
                shutil.copy(file, folder)
            result = promtool("test", "rules", str(Path(folder) / self.tests.name))
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_every_alert_is_tested_explained_and_documented(self):
        tested = set(re.findall(r"Axlecast\w+", self.tests.read_text(encoding="utf-8")))
        document = self.document.read_text(encoding="utf-8")
        alerts = ALERT.findall(self.rules)
        self.assertEqual(len(alerts), len(set(alerts)))
        self.assertEqual(set(alerts), tested)
        for alert, text in zip(alerts, re.split(r"^ *- alert: ", self.rules, flags=re.MULTILINE)[1:]):
            for key in ("severity: ", "summary: ", "description: ", "runbook: "):
                self.assertIn(key, text, alert)
            self.assertIn(f"| `{alert}` |", document)


class PromtoolTest(RulesTest, unittest.TestCase):
    path = ROOT / "config" / "prometheus" / "axlecast.rules.yml"
    tests = HERE / "rules_test.yml"
    document = DOCUMENT

    @classmethod
    def setUpClass(cls):
        cls.metrics = subprocess.run([METRICS_PRINT], capture_output=True, check=True).stdout.decode()
        cls.families = set(re.findall(r"^# TYPE (\w+) ", cls.metrics, re.MULTILINE))

    def test_metrics(self):
        self.assertGreater(len(self.families), 40)
        result = promtool("check", "metrics", text=self.metrics)
        self.assertEqual((result.returncode, result.stdout + result.stderr), (0, ""))

    def test_promtool_finds_a_mistake(self):
        self.assertNotEqual(promtool("check", "metrics", text=self.metrics + "axlecast_build_info 1 2 3\n").returncode, 0)

    def test_the_document_names_every_metric_and_no_other(self):
        rows = re.findall(r"^\| `(axlecast_\w+)`", DOCUMENT.read_text(encoding="utf-8"), re.MULTILINE)
        self.assertEqual(sorted(rows), sorted(self.families))


class FleetRulesTest(RulesTest, unittest.TestCase):
    path = ROOT / "packaging" / "prometheus" / "axlecast-fleet.rules.yml"
    tests = HERE / "fleet_rules_test.yml"
    document = ROOT / "docs" / "fleet.md"

    @classmethod
    def setUpClass(cls):
        queries = yaml.safe_load(FLEET_QUERIES.read_text(encoding="utf-8"))
        of_database = {f"{query}_{column}" for query, part in queries.items() for metric in part["metrics"] for column in metric}
        of_shipper = re.findall(r"^\| `(axlecast_ship_\w+)`", cls.document.read_text(encoding="utf-8"), re.MULTILINE)
        cls.families = of_database | set(of_shipper)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    METRICS_PRINT = sys.argv.pop()
    unittest.main()
