#!/usr/bin/env python3
"""Runs clang-tidy over every source that is not a test or a fuzzer.

Usage: tidy.py CLANG_TIDY BUILD_FOLDER [--alone]

Most of its time goes to the headers. It therefore reads about twenty sources of a room as one, so that it reads each header once
for all of them (cmake/unity_groups.py chooses what can be read together), with the flags of the compile commands of the build. Where
names collide nevertheless, it prints that, and reads each half of them, until they do not. With --alone, it reads all of them alone, which takes
ten times as long, and also finds an include that is missing.

Prints what clang-tidy objects to; exits 1 on any, and where a source has no command. Everything else on the machine goes first: tests
run beside it."""

import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "cmake"))
import unity_groups  # noqa: E402

# Rooms that are read together: others give one name two meanings.
ROOMS = (("core", "platform", "bridge", "tools"), ("drivers",), ("client", "bench"), ("tests",))
GROUP_LINES = 4000
INCLUDED = re.compile(r'#include "(.*)"')
FLAG = re.compile(r"-isystem \S+|-I\S+|-D\S+")
REPLACES = re.compile(r'extern "C"|no_instrument_function')
MAIN = re.compile(r"^(int main\(|BENCHMARK_MAIN\()", re.MULTILINE)


def sources_of(path):
    """The files of the project that a translation unit is made of."""
    files = INCLUDED.findall(path.read_text()) if "Unity" in path.parts else [path]
    return [os.path.relpath(file, ROOT) for file in files]


def is_checked(source):
    return any(source.split("/")[0] in rooms for rooms in ROOMS) and not re.search(r"_(test|fuzz)\.cpp$", source)


def flags_of(build):
    """The flags of every source to check, by its path, in the order of the paths."""
    flags = {}
    for command in json.loads((build / "compile_commands.json").read_text()):
        for source in sources_of(pathlib.Path(command["file"])):
            if is_checked(source):
                flags[source] = [flag for flag in FLAG.findall(command["command"]) if not flag.endswith("_EXPORTS")]
    return dict(sorted(flags.items()))


def missing(flags):
    """Sources of the project that no command compiles."""
    listed = subprocess.run(["git", "ls-files", "*.cpp"], cwd=ROOT, check=True, capture_output=True, text=True)
    return [file for file in listed.stdout.split() if is_checked(file) and file not in flags]


def grouped(sources):
    """The sources in groups that can be read as one. What replaces functions of the C library is read alone."""
    unity_groups.GROUP_LINES = GROUP_LINES
    groups = [[source] for source in sources if REPLACES.search((ROOT / source).read_text())]
    for rooms in ROOMS:
        together = [source for source in sources if source.split("/")[0] in rooms and [source] not in groups]
        numbers = unity_groups.groups_of([unity_groups.Source(ROOT / source) for source in together])
        groups += [[source for source, its in zip(together, numbers) if its == number] for number in sorted(set(numbers))]
    return groups


def text_of(group):
    """Programs are read together too: each gets a main of its own."""
    lines = []
    for number, source in enumerate(group):
        has_main = MAIN.search((ROOT / source).read_text())
        lines += [f"#define main main_{number}"] if has_main else []
        lines += [f'#include "{ROOT / source}"']
        lines += ["#undef main"] if has_main else []
    return "\n".join(lines) + "\n"


class Checker:
    def __init__(self, clang_tidy, folder, flags):
        self.clang_tidy = clang_tidy
        self.folder = folder
        self.flags = flags
        folder.mkdir(exist_ok=True)

    def check(self, group):
        """The sources that clang-tidy objects to."""
        done = self._run(group)
        if len(group) > 1 and "clang-diagnostic-error" in done.stdout:
            errors = [line for line in done.stdout.splitlines() if "clang-diagnostic-error" in line]
            print(f"{len(group)} sources cannot be read together, so each half is. Rename one of the two names: {errors[0]}", flush=True)
            half = len(group) // 2
            return self.check(group[:half]) + self.check(group[half:])
        if done.returncode == 0:
            return []
        print(f"{done.stdout}{done.stderr}", flush=True)
        return group

    def _run(self, group):
        file = self.folder / (group[0].replace("/", "+") + ("" if len(group) == 1 else f"+{len(group)}.cpp"))
        file.write_text(text_of(group))
        flags = list(dict.fromkeys(flag for source in group for flag in self.flags[source]))
        command = [self.clang_tidy, "--quiet", f"--config-file={ROOT / '.clang-tidy'}", str(file), "--", "-std=c++20"]
        return subprocess.run(command + " ".join(flags).replace('\\"', '"').split(), cwd=ROOT, capture_output=True, text=True)


def main():
    options = argparse.ArgumentParser(description="Runs clang-tidy over every source that is not a test or a fuzzer.")
    options.add_argument("clang_tidy")
    options.add_argument("build", type=pathlib.Path)
    options.add_argument("--alone", action="store_true", help="read each source alone")
    given = options.parse_args()
    os.nice(19)
    flags = flags_of(given.build)
    lost = missing(flags)
    for file in lost:
        print(f"{file}: not compiled by this build, so not checked")
    groups = [[source] for source in flags] if given.alone else grouped(list(flags))
    checker = Checker(given.clang_tidy, given.build.resolve() / "tidy", flags)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        refused = [source for group in pool.map(checker.check, sorted(groups, key=len, reverse=True)) for source in group]
    print(f"{len(groups)} groups, {len(flags)} sources, {len(refused)} refused")
    return 0 if flags and not refused and not lost else 1


if __name__ == "__main__":
    sys.exit(main())
