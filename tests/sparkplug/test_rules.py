"""docs/sparkplug.md names each rule of the specification once, and tests that exist."""

import os
import pathlib
import re
import unittest

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
ROW = re.compile(r"^\| (`[a-z][A-Za-z0-9-]+`(?:, `[A-Za-z0-9-]+`)*) \| (.+) \|$", re.MULTILINE)


class Rules(unittest.TestCase):
    def test_every_rule_once_with_a_test_that_exists(self):
        text = (SOURCE / "docs/sparkplug.md").read_text().split("## The rules of the specification")[1]
        rows = ROW.findall(text)
        rules = [rule for row, _ in rows for rule in re.findall(r"`([^`]+)`", row)]
        self.assertEqual(len(rules), len(set(rules)))
        self.assertEqual(str(len(rules)), re.search(r"(\d+) of them concern an edge node", text)[1])
        unit_tests = {f"{suite}.{name}"
                      for file in [*SOURCE.glob("tools/mqtt/sparkplug/*_test.cpp"), *SOURCE.glob("core/config/*mqtt_test.cpp")]
                      for suite, name in re.findall(r"^TEST(?:_F)?\((\w+),\s*(\w+)\)", file.read_text(), re.MULTILINE)}
        process_tests = set(re.findall(r"def (test_\w+)", (SOURCE / "tests/sparkplug/test_sparkplug.py").read_text()))
        for _, cover in rows:
            if cover.startswith("`"):
                self.assertIn(re.match(r"`([^`]+)`", cover)[1], unit_tests | process_tests)


if __name__ == "__main__":
    unittest.main()
