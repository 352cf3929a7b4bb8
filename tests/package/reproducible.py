#!/usr/bin/python3
"""Packs the compiled tree once more, elsewhere, later, in another time zone and with another mask: reproducible.py BUILD FOLDER

Fails where a package has other bytes than in FOLDER/debs, or holds the path of the tree that it was compiled in. That two
compilations give the same bytes is for `tools/campaign package`, which takes longer."""

import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import build as packages  # noqa: E402


def different(first, second):
    """Names of packages that are not the same, or missing on one side."""
    names = {deb.name for folder in (first, second) for deb in folder.glob("*.deb")}
    if not names:
        sys.exit(f"no packages in {first}")
    return [name for name in sorted(names)
            if not all((folder / name).exists() for folder in (first, second))
            or (first / name).read_bytes() != (second / name).read_bytes()]


def show_difference(first, second):
    """What lists and checksums show of it; diffoscope shows more."""
    lists = [subprocess.run(["dpkg-deb", "--contents", deb], capture_output=True, text=True, check=True).stdout.splitlines()
             for deb in (first, second)]
    for line in sorted(set(lists[0]) ^ set(lists[1])):
        print("   ", line)
    sums = []
    for deb in (first, second):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["dpkg-deb", "--control", deb, folder], check=True)
            sums.append(set((pathlib.Path(folder) / "md5sums").read_text().splitlines()))
    for line in sorted(sums[0] ^ sums[1]):
        print("   ", line)


def paths_within(debs, *paths):
    """Files of packages that name one of these paths."""
    found = []
    for deb in sorted(debs.glob("*.deb")):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["dpkg-deb", "--raw-extract", deb, folder], check=True)
            for file in sorted(path for path in pathlib.Path(folder).rglob("*") if path.is_file() and not path.is_symlink()):
                content = file.read_bytes()
                found += [f"{deb.name}: {file.relative_to(folder)} names {path}" for path in paths if os.fsencode(path) in content]
    return found


def main():
    build, folder = (pathlib.Path(word).resolve() for word in sys.argv[1:])
    again = folder / "other-place" / "debs"
    os.environ.update(TZ="Pacific/Kiritimati", LC_ALL="C.UTF-8")
    os.umask(0o002)
    packages.packed(build, again)
    changed = different(folder / "debs", again)
    for name in changed:
        print(f"{name} differs:")
        if (again / name).exists() and (folder / "debs" / name).exists():
            show_difference(folder / "debs" / name, again / name)
    named = paths_within(again, packages.SOURCE, build)
    print("\n".join(named))
    sys.exit(1 if changed or named else 0)


if __name__ == "__main__":
    main()
