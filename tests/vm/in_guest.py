"""Runs suites inside the guest and leaves what came of each case in /run/vm/results.json.

    in_guest.py SUITE_FILE..."""

import faulthandler
import importlib.util
import json
import os
import pathlib
import sys
import time
import traceback
import unittest

RESULTS = pathlib.Path("/run/vm/results.json")
CASE_LIMIT = float(os.environ.get("AXLECAST_VM_CASE_LIMIT", 300))  # s; then the stacks of all threads, and the end


class Record(unittest.TestResult):
    """Reports each case on the console as it ends."""

    def __init__(self):
        super().__init__()
        self.cases = {}

    def startTest(self, test):
        super().startTest(test)
        self.started = time.monotonic()
        faulthandler.dump_traceback_later(CASE_LIMIT, exit=True)

    def stopTest(self, test):
        super().stopTest(test)
        faulthandler.cancel_dump_traceback_later()

    def note(self, test, failure=""):
        name = test.id().removeprefix("test_")  # of test_x.py: x.Class.case
        seconds = time.monotonic() - getattr(self, "started", time.monotonic())
        before = self.cases.get(name, {"failure": ""})["failure"]
        self.cases[name] = {"seconds": round(seconds, 1), "failure": before + failure}
        print(f"{'FAILED' if failure else 'ok    '} {seconds:5.1f} s  {name}", flush=True)
        if failure:
            print(failure, flush=True)

    def addSuccess(self, test):
        self.note(test)

    def addFailure(self, test, error):
        self.note(test, "".join(traceback.format_exception(*error)))

    addError = addFailure

    def addSkip(self, test, reason):
        self.note(test, f"skipped, which nothing here may be: {reason}")

    def addExpectedFailure(self, test, error):
        self.addFailure(test, error)

    def addUnexpectedSuccess(self, test):
        self.note(test, "marked as an expected failure")

    def addSubTest(self, test, subtest, error):
        if error:
            self.note(test, f"{subtest}\n" + "".join(traceback.format_exception(*error)))


def load(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return unittest.defaultTestLoader.loadTestsFromModule(module)


def main():
    faulthandler.enable()
    record = Record()
    for path in map(pathlib.Path, sys.argv[1:]):
        sys.path.insert(0, str(path.parent))
        load(path).run(record)
    RESULTS.write_text(json.dumps(record.cases))
    print(f"{len(record.cases)} cases, {sum(1 for case in record.cases.values() if case['failure'])} failed")


if __name__ == "__main__":
    main()
