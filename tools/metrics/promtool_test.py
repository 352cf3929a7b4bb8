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

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
RULES = ROOT / "config" / "prometheus" / "axlecast.rules.yml"
RULES_TEST = HERE / "rules_test.yml"
DOCUMENT = ROOT / "docs" / "metrics.md"

METRIC = re.compile(r"\baxlecast_[a-z_]*[a-z]\b")
ALERT = re.compile(r"^ *- alert: (\w+)$", re.MULTILINE)


def promtool(*arguments, text=None):
    return subprocess.run(["promtool", *arguments], input=text, capture_output=True, text=True, check=False)


def base_name(metric):
    """Of a histogram's series, the family's name."""
    return re.sub(r"_seconds_(bucket|sum|count)$", "_seconds", metric)


class PromtoolTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.metrics = subprocess.run([METRICS_PRINT], capture_output=True, check=True).stdout.decode()
        cls.families = set(re.findall(r"^# TYPE (\w+) ", cls.metrics, re.MULTILINE))
        cls.rules = RULES.read_text(encoding="utf-8")

    def test_metrics(self):
        self.assertGreater(len(self.families), 40)
        result = promtool("check", "metrics", text=self.metrics)
        self.assertEqual((result.returncode, result.stdout + result.stderr), (0, ""))

    def test_promtool_finds_a_mistake(self):
        self.assertNotEqual(promtool("check", "metrics", text=self.metrics + "axlecast_build_info 1 2 3\n").returncode, 0)

    def test_the_document_names_every_metric_and_no_other(self):
        rows = re.findall(r"^\| `(axlecast_\w+)`", DOCUMENT.read_text(encoding="utf-8"), re.MULTILINE)
        self.assertEqual(sorted(rows), sorted(self.families))

    def test_rules(self):
        result = promtool("check", "rules", str(RULES))
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_rules_use_metrics_that_exist(self):
        used = {base_name(name) for name in METRIC.findall(self.rules)}
        self.assertEqual(used - self.families, set())

    def test_alerts_fire_on_what_they_are_for(self):
        with tempfile.TemporaryDirectory() as folder:
            for file in (RULES, RULES_TEST):
                shutil.copy(file, folder)
            result = promtool("test", "rules", str(Path(folder) / RULES_TEST.name))
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_every_alert_is_tested_explained_and_documented(self):
        tested = set(re.findall(r"Axlecast\w+", RULES_TEST.read_text(encoding="utf-8")))
        document = DOCUMENT.read_text(encoding="utf-8")
        alerts = ALERT.findall(self.rules)
        self.assertEqual(len(alerts), len(set(alerts)))
        self.assertEqual(set(alerts), tested)
        for alert, text in zip(alerts, re.split(r"^ *- alert: ", self.rules, flags=re.MULTILINE)[1:]):
            for key in ("severity: ", "summary: ", "description: ", "runbook: "):
                self.assertIn(key, text, alert)
            self.assertIn(f"| `{alert}` |", document)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    METRICS_PRINT = sys.argv.pop()
    unittest.main()
