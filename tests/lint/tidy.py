#!/usr/bin/env python3
"""Runs clang-tidy over every source that is not a test or a fuzzer.

Usage: tidy.py CLANG_TIDY BUILD_FOLDER

Takes the compile commands of the build. Where that compiles files in groups, the groups are checked, which reads every
header once for all of them. Prints what clang-tidy objects to; exits 1 on any, and where a source has no command.
Everything else on the machine goes first: tests run beside it."""

import json
import os
import pathlib
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ("core", "platform", "drivers", "bridge", "tools", "client", "bench", "tests")
INCLUDED = re.compile(r'#include "(.*)"')
PRECOMPILED = re.compile(r" -Winvalid-pch| -include \S*cmake_pch\.hxx")


def sources_of(path):
    """The files of the project that a translation unit is made of."""
    files = INCLUDED.findall(path.read_text()) if "Unity" in path.parts else [path]
    return [os.path.relpath(file, ROOT) for file in files]


def is_checked(source):
    return source.startswith(tuple(folder + "/" for folder in FOLDERS)) and not re.search(r"_(test|fuzz)\.cpp$", source)


def units_of(build):
    """The translation units to check: compile commands, and the sources that they hold."""
    units = {}
    for command in json.loads((build / "compile_commands.json").read_text()):
        sources = [source for source in sources_of(pathlib.Path(command["file"])) if is_checked(source)]
        if sources:
            units[command["file"]] = {**command, "command": PRECOMPILED.sub("", command["command"])}, sources
    return units


def missing(units):
    """Sources of the project that no unit holds."""
    listed = subprocess.run(["git", "ls-files", "*.cpp"], cwd=ROOT, check=True, capture_output=True, text=True)
    held = {source for _, sources in units.values() for source in sources}
    return [file for file in listed.stdout.split() if is_checked(file) and file not in held]


def check(clang_tidy, folder, file):
    done = subprocess.run([clang_tidy, "--quiet", "-p", folder, file], capture_output=True, text=True)
    if done.returncode == 0:
        return True
    print(f"{done.stdout}{done.stderr}", flush=True)
    return False


def main(clang_tidy, build):
    os.nice(19)
    units = units_of(build)
    lost = missing(units)
    for file in lost:
        print(f"{file}: not compiled by this build, so not checked")
    folder = build / "tidy"
    folder.mkdir(exist_ok=True)
    (folder / "compile_commands.json").write_text(json.dumps([command for command, _ in units.values()]))
    longest_first = sorted(units, key=lambda file: -len(units[file][1]))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        clean = list(pool.map(lambda file: check(clang_tidy, folder, file), longest_first))
    print(f"{len(units)} units, {sum(len(sources) for _, sources in units.values())} sources, {clean.count(False)} refused")
    return 0 if all(clean) and not lost and clean else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], pathlib.Path(sys.argv[2])))
