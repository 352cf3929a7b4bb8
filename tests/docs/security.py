"""docs/security.md promises nothing that no test shows: every row of "What holds" names tests that exist.

Usage: security.py SOURCE"""

import pathlib
import re
import sys


def rows(text):
    """(property, shown by) of the table."""
    part = re.search(r"^## What holds\n(.*?)^## ", text, re.MULTILINE | re.DOTALL)[1]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in part.splitlines() if line.startswith("|")]
    return [(row[0], row[-1]) for row in cells[2:]]


def exists(name, source, unit_tests, campaign):
    """`name` is a pattern of ctest, e2e.keys.*, or a part of tools/campaign."""
    if "." not in name:
        return name in campaign
    room, suite = name.split(".")[:2]
    if room == "e2e":
        return (source / f"tests/e2e/test_{suite}.py").exists()
    if room == "package":
        places = (f"test_{suite}.py", f"guest/test_{suite}.py", f"{suite}.py")
        return any((source / "tests/package" / place).exists() for place in places)
    return suite in unit_tests


def main(folder):
    source = pathlib.Path(folder)
    unit_tests = set()
    for room in ("bridge", "client", "core", "drivers", "platform", "tools"):
        for file in (source / room).rglob("*_test.cpp"):
            unit_tests |= set(re.findall(r"^TEST(?:_F|_P)?\((\w+),", file.read_text(), re.MULTILINE))
    campaign = set(re.search(r'^all="(.*)"$', (source / "tools/campaign").read_text(), re.MULTILINE)[1].split())
    table = rows((source / "docs/security.md").read_text())
    problems = [] if table else ["the table of what holds is gone"]
    for what, shown_by in table:
        names = re.findall(r"`([a-z0-9_]+(?:\.[\w.*]+)?)`", shown_by)
        problems += [f"{what}: {name} does not exist" for name in names if not exists(name, source, unit_tests, campaign)]
        if not names:
            problems.append(f"{what}: no test shows it")
    for problem in problems:
        print(f"docs/security.md: {problem}")
    print(f"{len(table)} promises, {len(problems)} without a test")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
