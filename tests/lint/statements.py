#!/usr/bin/env python3
"""Checks that every test that a family's README.md names as the proof of a statement exists. Prints each that does not as
file:line: name; exits 1 on any.

In the tables under "## … statements" (of the maker, of the standards) a test is `Suite.Case`, or `.Case` of the suite that
was named last in its row; `Suite.*` is the whole suite (a bare `Suite` is refused), and `…` at the end stands for the rest
of a long name. A README introduces an abbreviation of a suite as "`M` = Suite in file", or of a single test as
"`D` = Suite.Case"."""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
TEST = re.compile(r"\bTEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\)")
HEADING = re.compile(r"^## .*[Ss]tatements", re.MULTILINE)
NAMED = re.compile(r"(?<![\w./(])(?:(\w*[A-Z]\w*)\.(\*|[A-Z]\w*)|\.([A-Z]\w*))(…?)")
BARE = re.compile(r"(?<![\w./])(\w+)(?![\w.])")
ABBREVIATION = re.compile(r"`(\w+)` = (\w+)(?:\.(\w+))?")


def tests():
    listing = subprocess.run(["git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard", "*_test.cpp"],
                             check=True, capture_output=True, text=True).stdout
    found = {}
    for path in listing.split():
        for suite, case in TEST.findall((ROOT / path).read_text(encoding="utf-8")):
            found.setdefault(suite, set()).add(case)
    return found


def exists(known, suite, case, cut):
    if suite not in known or case == "*":
        return suite in known
    return any(name.startswith(case) for name in known[suite]) if cut else case in known[suite]


def missing(text, known):
    short = {name: suite for name, suite, case in ABBREVIATION.findall(text) if not case}
    for name, suite, case in ABBREVIATION.findall(text):
        if not exists(known, suite, case or "*", False):
            yield 1, f"{name} = {suite}.{case}"
    within = False
    named = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("## "):
            within = HEADING.match(line) is not None
        if not within or not line.startswith("|"):
            continue
        suite = None
        proof = line.rsplit("|", 2)[1]
        for bare in set(BARE.findall(proof)) & set(known):
            yield number, f"that a bare {bare} names"
        for own, case, more, cut in NAMED.findall(proof):
            suite = short.get(own, own) if own else suite
            named.append(case or more)
            if suite is None or not exists(known, suite, case or more, bool(cut)):
                yield number, f"{suite}.{case or more}"
    if HEADING.search(text) and not named:
        yield 1, "that the table of statements names"


def main():
    known = tests()
    found = 0
    for path in sorted((ROOT / "drivers").glob("**/README.md")):
        for line, name in missing(path.read_text(encoding="utf-8"), known):
            print(f"{path.relative_to(ROOT)}:{line}: there is no test {name}")
            found += 1
    print(f"{found} statements name a test that does not exist")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
