#!/usr/bin/env python3
"""Changes the product in small ways, one at a time, and expects a test to fail: conditions negated, bounds shifted by one, other
values returned, statements dropped. Prints a line for each folder, and each mutant that survives without a reason in
survivors.txt. Exits 1 on one, on a reason for a mutant that is killed, and if less than 95 % of a folder's mutants are killed.

    run.py BUILD [FOLDER...]     BUILD: a build of the tests by g++, as build/gcc; FOLDER: those of folders.py, default all"""

import argparse
import pathlib
import subprocess
import sys
import time

import judge
from folders import FOLDERS
from program import HERE, Program

LEAST = 95.0


def explained(path, files):
    """The survivors with a reason, of these files."""
    reasons = {}
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if not line or line.startswith("#"):
            continue
        parts = line.split(" // ")
        if len(parts) != 4 or not parts[3].strip():
            raise SystemExit(f"{path}:{number}: expected `file // function // change // reason`")
        if parts[0] in files:
            reasons[" // ".join(parts[:3])] = parts[3]
    return reasons


def judged(name, build, list_path, only=None, every=1):
    """Prints the figures of a folder. True if it holds."""
    sources, targets = FOLDERS[name]
    reasons = explained(list_path, sources)
    began = time.monotonic()
    program = Program(build, name, sources, targets)
    programs, excluded = program.build_all()
    mutants = [m for m in program.mutants if only is None or m.key in only][::every]
    alive = []
    for mutant in judge.survivors(programs, mutants):
        alive.append(mutant.key)
        if mutant.key not in reasons:
            print(f"  survives: {mutant.key}", flush=True)
    if every == 1:
        (program.folder / "survivors").write_text("".join(key + "\n" for key in alive), encoding="utf-8")
    total = len(mutants if every > 1 else program.mutants)  # with --again, the others were killed the last time
    killed = 100 * (total - len(alive)) / max(1, total)
    unexplained = [key for key in alive if key not in reasons]
    stale = [key for key in reasons if key not in alive] if only is None and every == 1 else []
    print(f"{name:12} {total:5} mutants {total - len(alive):5} killed {killed:6.1f} % {len(alive):4} survive "
          f"{excluded:4} not applicable {time.monotonic() - began:5.0f} s", flush=True)
    for key in stale:
        print(f"  does not survive any more: {key}")
    return total > 0 and killed >= LEAST and not unexplained and not stale


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("build", type=pathlib.Path)
    arguments.add_argument("folder", nargs="*")
    everything = [name for name in FOLDERS if not name.startswith("sample")]
    arguments.add_argument("--again", action="store_true", help="only the mutants that survived the last run")
    arguments.add_argument("--every", type=int, default=1, metavar="N", help="only every Nth mutant")
    arguments.add_argument("--built", action="store_true", help="the programs of the tests are up to date")
    arguments.add_argument("--survivors", type=pathlib.Path, default=HERE / "survivors.txt", help="the list of reasons")
    given = arguments.parse_args()
    given.folder = given.folder or everything
    unknown = [name for name in given.folder if name not in FOLDERS]
    if unknown:
        raise SystemExit(f"unknown folder {', '.join(unknown)}; known: {', '.join(FOLDERS)}")
    build = given.build.resolve()
    targets = sorted({target for name in given.folder for target in FOLDERS[name][1]})
    if not given.built:
        subprocess.run(["ninja", "-C", build, "-j2", *targets], check=True, stdout=subprocess.DEVNULL)
    good = True
    for name in given.folder:
        last = build / "mutation" / name / "survivors"
        only = set(last.read_text(encoding="utf-8").splitlines()) if given.again else None
        good = judged(name, build, given.survivors, only, given.every) and good
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
