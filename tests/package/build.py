#!/usr/bin/python3
"""Builds the packages from a tree that is compiled already: build.py BUILD FOLDER

FOLDER/debs then holds them, and FOLDER/newer the program's package once more with a higher version, for an upgrade."""

import os
import pathlib
import shutil
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]


def run(*command, **options):
    subprocess.run([str(word) for word in command], check=True, **options)


def compiled(build):
    """Whatever of it is missing; nothing after `cmake --build`."""
    run("cmake", "--build", build, "--target", "axlecast_installed", stdout=subprocess.DEVNULL)


def packed(build, folder):
    shutil.rmtree(folder, ignore_errors=True)
    source = folder / "source"
    shutil.copytree(SOURCE / "debian", source / "debian", ignore=shutil.ignore_patterns("axlecast", "tmp", ".debhelper"))
    environment = dict(os.environ, AXLECAST_BUILD=str(build), DEB_BUILD_OPTIONS="noautodbgsym")
    with open(folder / "build.log", "w") as log:
        result = subprocess.run(["dpkg-buildpackage", "-us", "-uc", "-b"], cwd=source, env=environment, stdout=log,
                                stderr=subprocess.STDOUT)
    if result.returncode != 0:
        print((folder / "build.log").read_text()[-4000:])
        sys.exit("dpkg-buildpackage failed: see above")
    shutil.rmtree(source)


def made_newer(debs, folder):
    """An upgrade is a matter of the maintainer's scripts: the files may stay what they are."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    package, = debs.glob("axlecast_*.deb")
    run("dpkg-deb", "--raw-extract", package, folder / "root")
    control = folder / "root/DEBIAN/control"
    lines = control.read_text().splitlines(keepends=True)
    control.write_text("".join(line.strip() + "+newer\n" if line.startswith("Version:") else line for line in lines))
    run("dpkg-deb", "--root-owner-group", "-Zgzip", "-z1", "--build", folder / "root", folder / "axlecast.deb",
        stdout=subprocess.DEVNULL)
    shutil.rmtree(folder / "root")


def main():
    build, folder = (pathlib.Path(word).resolve() for word in sys.argv[1:])
    compiled(build)
    packed(build, folder / "debs")
    made_newer(folder / "debs", folder / "newer")


if __name__ == "__main__":
    main()
