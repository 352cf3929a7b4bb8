#!/usr/bin/env python3
"""chronyd for tests: Debian's package is fetched once and unpacked, never installed, because it would take over the clock of this host.

Usage: chrony_package.py FOLDER"""

import pathlib
import subprocess
import sys
import tempfile


def prepare(cache):
    """The folder of the unpacked package, below `cache`."""
    cache = pathlib.Path(cache)
    cache.mkdir(parents=True, exist_ok=True)
    folder = cache / "chrony"
    if not (folder / "usr/sbin/chronyd").exists():
        with tempfile.TemporaryDirectory(dir=cache) as place:
            subprocess.run(("apt-get", "-q", "download", "chrony"), cwd=place, check=True)
            subprocess.run(("dpkg", "-x", next(pathlib.Path(place).glob("chrony_*.deb")), folder), check=True)
    for program in ("usr/sbin/chronyd", "usr/bin/chronyc"):
        libraries = subprocess.run(("ldd", folder / program), capture_output=True, text=True, check=True).stdout
        missing = [line.split()[0] for line in libraries.splitlines() if "not found" in line]
        if missing:
            sys.exit(f"{program} needs {' '.join(missing)}: install these libraries")
    return folder


if __name__ == "__main__":
    print(prepare(sys.argv[1]))
