"""The list of known vulnerabilities, and the job that compares our dependencies with it."""

import contextlib
import importlib.util
import io
import json
import pathlib
import re
import unittest

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "packaging/security"
SPEC = importlib.util.spec_from_file_location("vulnerabilities", FOLDER / "vulnerabilities.py")
job = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(job)
KNOWN = json.loads((FOLDER / "vulnerabilities.json").read_text())


def sbom(**versions):
    packages = [{"SPDXID": f"SPDXRef-{name}", "comment": f"source package {name} {version}"} for name, version in versions.items()]
    relations = [{"relationshipType": "DYNAMIC_LINK", "relatedSpdxElement": package["SPDXID"]} for package in packages]
    return job.of_sbom({"packages": packages, "relationships": relations})


def report(entries, versions, linked=frozenset(), reviewed=()):
    known = {"date": "2026-01-01", "distribution": "a test", "entries": entries, "reviewed": list(reviewed)}
    with contextlib.redirect_stdout(io.StringIO()) as text:
        todo = job.report(known, versions, set(linked))
    return todo, text.getvalue()


def entry(decision, fixed=None):
    return {"package": "libx", "ids": ["X-1"], "fixed": fixed, "decision": decision, "reason": "because"}


class TheList(unittest.TestCase):
    def test_every_entry_has_a_decision_with_its_reason_and_evidence(self):
        self.assertRegex(KNOWN["date"], r"^\d{4}-\d\d-\d\d$")
        for one in KNOWN["entries"]:
            self.assertIn(one["decision"], job.DECISIONS, one)
            self.assertTrue(one["ids"] and one["reason"] and one["evidence"], one)
            self.assertEqual(one["decision"] == "update", one["fixed"] is not None and one["reason"].startswith("Debian"), one)
            for name in one["ids"]:
                self.assertRegex(name, r"^(CVE-\d{4}-\d{4,}|https://\S+|axlecast-[a-z0-9-]+)$")

    def test_no_vulnerability_stands_twice(self):
        ids = [(one["package"], name) for one in KNOWN["entries"] for name in one["ids"]]
        self.assertEqual(sorted(ids), sorted(set(ids)))

    def test_what_is_not_reachable_is_not_called(self):
        """The functions that the reasons state are not used."""
        source = "".join(path.read_text() for room in ("platform/net", "drivers/hal")
                         for path in (FOLDER.parents[1] / room).glob("*.cpp"))
        self.assertNotRegex(source, r"modbus_(mapping|read_bits|read_input_bits|reply|receive)\b")
        for path in ("drivers/runtime/process/driver_main.cpp", "bridge/program/bridge_main.cpp"):
            pattern = re.search(r'set_pattern\("(.*?)"', (FOLDER.parents[1] / path).read_text())[1]
            self.assertNotRegex(pattern, r"%[-=]?\d", path)


class TheJob(unittest.TestCase):
    def test_a_version_that_is_repaired_is_not_reported(self):
        versions, _ = sbom(libx="1.0-2+deb12u2")
        self.assertEqual(report([entry("update", "1.0-2+deb12u2")], versions)[0], 0)
        self.assertEqual(report([entry("update", "1.0-2+deb12u3")], versions)[0], 1)

    def test_a_decision_is_shown_and_nothing_is_left_to_do(self):
        versions, _ = sbom(libx="1.0-2")
        todo, text = report([entry("mitigated")], versions)
        self.assertEqual(todo, 0)
        self.assertIn("decided: libx 1.0-2: X-1\n    mitigated: because", text)

    def test_what_is_undecided_fails(self):
        self.assertEqual(report([entry("open")], sbom(libx="1")[0])[0], 1)

    def test_what_we_do_not_use_is_not_reported(self):
        self.assertEqual(report([entry("open")], sbom(liby="1")[0])[0], 0)

    def test_a_library_that_nobody_reviewed_fails(self):
        versions, linked = sbom(liby="1")
        self.assertEqual(linked, {"liby"})
        todo, text = report([], versions, linked)
        self.assertEqual(todo, 1)
        self.assertIn("liby: nobody has looked", text)
        self.assertEqual(report([], versions, linked, ["liby"])[0], 0)


if __name__ == "__main__":
    unittest.main()
