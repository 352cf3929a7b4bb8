"""The abbreviations of a machine file: the example of docs/configuration.md is a machine of a hundred axes that runs."""

import json
import os
import pathlib
import re
import unittest

from machine import Machine

PAGE = pathlib.Path(os.environ["AXLECAST_SOURCE"], "docs/configuration.md")


class Abbreviations(Machine):
    def setUp(self):
        super().setUp()
        chapter = PAGE.read_text().split("## Many axes")[1].split("## Families")[0]
        self.text = re.search(r"```yaml\n(.*?)```", chapter, re.DOTALL)[1]
        self.config = self.write(self.text)

    def checked(self, config, *options):
        code, out, err = self.axlecast("check-config", config, *options)
        self.assertEqual(code, 0, out + err)
        return out

    def test_a_hundred_axes_need_few_lines(self):
        self.assertLessEqual(len(self.text.splitlines()), 60)
        names = self.checked(self.config, "--list", "devices").split()
        self.assertEqual(names, [f"axis{number:03}" for number in range(100)])

    def test_the_expanded_file_is_the_same_machine(self):
        expanded = self.write(self.checked(self.config, "--expand"), "expanded.yaml")
        self.assertNotIn("defaults", expanded.read_text())
        reports = [json.loads(self.checked(config, "--json")) for config in (self.config, expanded)]
        for report in reports:
            del report["file"]
        self.assertEqual(*reports)

    def test_one_of_the_axes_runs(self):
        data = self.watch(self.config)
        self.simulator(self.config, "line042")
        self.driver(self.config, "line042")
        self.wait_online(data, "axis042")
        self.assertEqual(data.last("DEVICE/axis042")["bus"], "line042")


if __name__ == "__main__":
    unittest.main(verbosity=2)
