#!/usr/bin/python3
"""Boots the minimal Debian of base.py, its own systemd first, and runs guest/test_SUITE.py in it: guest.py BUILD FOLDER SUITE

The packages are in the guest's /packages and not installed. FOLDER/SUITE-results/results.json says what came of each case."""

import os
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
RUN = HERE.parent / "vm/run"
LIMIT = 2700  # s: six times of what it takes on an idle machine


def main():
    build, folder = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    suite = sys.argv[3]
    root = folder / f"{suite}-root"
    shutil.rmtree(root, ignore_errors=True)
    (root / "packages/newer").mkdir(parents=True)
    subprocess.run(["tar", "--extract", "--numeric-owner", "--directory", root, "--file", folder / "base.tar"], check=True)
    shutil.copy(next(folder.glob("debs/axlecast_*.deb")), root / "packages")
    shutil.copy(folder / "newer/axlecast.deb", root / "packages/newer")
    result = subprocess.run([RUN, "--build", build, "--root", root, "--results", folder / f"{suite}-results", "--limit", str(LIMIT),
                             "--no-verdict", HERE / f"guest/test_{suite}.py"],
                            env={**os.environ, "AXLECAST_VM_CASE_LIMIT": "900"})
    shutil.rmtree(root)
    sys.exit(result.returncode)


if __name__ == "__main__":
    main()
