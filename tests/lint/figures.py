#!/usr/bin/env python3
"""Prints the figures of the structure, one a line: includes across rooms, pairs of libraries that need each other, sizes of
files, lines of C++. Exits 1 if a figure is beyond its limit.

    figures.py [--list FIGURE]      --list: the places that the figure counts"""

import argparse
import collections
import pathlib
import re
import statistics
import sys

import english
import structure

ROOT = structure.ROOT
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)


def text_of(path):
    return (ROOT / path).read_text(encoding="utf-8")


def product(paths):
    """What is no test, benchmark or campaign."""
    return [path for path in paths if not structure.is_test(path) and not path.startswith(("tests/", "bench/"))]


def includes(paths):
    """(file, included file of ours)"""
    return [(path, name) for path in paths for name in INCLUDE.findall(text_of(path)) if (ROOT / name).exists()]


def library(path):
    """The folder whose CMakeLists.txt names the file's library."""
    folder = pathlib.PurePosixPath(path).parent
    while not (ROOT / folder / "CMakeLists.txt").exists():
        folder = folder.parent
    return str(folder)


def two_way_pairs(edges):
    found = collections.defaultdict(list)
    for path, name in edges:
        if library(path) != library(name):
            found[library(path), library(name)].append(path)
    return [f"{one} <-> {other}: {found[one, other][0]}, {found[other, one][0]}"
            for one, other in sorted(found) if one < other and (other, one) in found]


# Ways to report an error that are not Result<T> (core/base/result.h).
EMPTY_IS_GOOD = re.compile(r"((?:^ *//[^\n]*\n)+) *\[\[nodiscard\]\](?: virtual| static)? std::string (\w+)\(", re.MULTILINE)
PROBLEM_AS_TEXT = re.compile(r"std::(?:string|optional<std::string>) (\w*(?:[Pp]roblem|Why|Mistake))\(")
PROBLEM_AS_ARGUMENT = re.compile(r"std::string\*? ?[&*]? ?(problem|error|why)\b\s*[,)]")


def string_errors(paths):
    """Declarations that report an error as a plain string: as the result, "empty" in the comment above, or as an out parameter."""
    found = []
    for path in paths:
        if path.endswith(".h"):
            text = text_of(path)
            found += [f"{path}: {name}" for comment, name in EMPTY_IS_GOOD.findall(text)
                      if re.search(r"\b[Ee]mpty (?:if|when|where|:)|\b[Ee]mpty\.|else empty", comment)]
            found += [f"{path}: {name}" for name in PROBLEM_AS_TEXT.findall(text)]
            found += [f"{path}: {match[1]} is an out parameter" for match in PROBLEM_AS_ARGUMENT.finditer(text)
                      if "*" in match[0] or ("&" in match[0] and not re.search(r"const\s+$", text[:match.start()]))]
    return sorted(set(found))


def figures():
    """(name, the places that it counts or its value, limit or None)"""
    everything = structure.tracked_sources()
    ours = product(everything)
    lines = {path: text_of(path).count("\n") for path in ours}
    edges = includes(ours)
    families = structure.families()
    breaches = [f"{path}:{line}: {rule}" for path in everything
                for line, rule in structure.breaches(path, text_of(path), families)]
    short = [path for path in ours if lines[path] < 60]
    return [
        ("includes of drivers/ in bridge/ and client/",
         [path for path, name in edges if path.startswith(("bridge/", "client/")) and name.startswith("drivers/")], 0),
        ("breaches of structure.py", breaches, 0),
        ("two-way pairs of libraries", two_way_pairs(edges), 0),
        ("flat files in tools/axlecast", [path for path in everything if re.fullmatch(r"tools/axlecast/[^/]+", path)], 12),
        ("functions that return an error as a plain string", string_errors(ours), 0),
        ("words that have a plainer one (english.py)", english.hits(), 0),
        ("C++ files below 60 lines, %", round(100 * len(short) / len(ours)), 35),
        ("median lines of a C++ file", round(statistics.median(lines.values())), None),
        ("C++ files that are no test", len(ours), None),
        ("lines of C++ that is no test", sum(lines.values()), None),
    ]


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--list", metavar="FIGURE")
    listed = arguments.parse_args().list
    beyond = 0
    for name, counted, limit in figures():
        value = len(counted) if isinstance(counted, list) else counted
        too_many = limit is not None and value > limit
        beyond += too_many
        print(f"{value:6d}  {name}" + (f" (at most {limit})" if limit is not None else ""))
        if isinstance(counted, list) and (too_many or listed == name):
            print("\n".join(f"        {place}" for place in counted))
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())
