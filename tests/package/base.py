#!/usr/bin/python3
"""A minimal Debian with systemd and what our packages depend on, as FOLDER/base.tar: base.py FOLDER

Made once, by debootstrap from the archive that apt uses here; again when what the packages depend on changes."""

import pathlib
import re
import shutil
import subprocess
import sys

SUITE = "bookworm"
HOST = {"systemd-sysv", "udev", "kmod", "iproute2"}  # what a Debian that boots has


def out(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def archive():
    """Where apt here gets Debian's packages from."""
    for line in out("apt-get", "indextargets", "--format", "$(SITE) $(CODENAME) $(COMPONENT)").splitlines():
        site, *what = line.split()
        if what == [SUITE, "main"]:
            return site
    sys.exit(f"apt knows no archive of {SUITE}: apt-get update")


def real(name):
    """debootstrap knows no virtual packages: the one that provides `name`."""
    found = [line.split()[0] for line in out("apt-cache", "search", "--names-only", f"^{re.escape(name)}$").splitlines()]
    if not found:
        sys.exit(f"apt knows no package {name}: apt-get update")
    return name if name in found else found[0]


def wanted(debs):
    """The packages that ours depend on; of alternatives the first."""
    names = set(HOST)
    for deb in debs:
        if deb.name.startswith(("axlecast_", "python3-")):
            depends = out("dpkg-deb", "--field", str(deb), "Depends")
            names |= {re.match(r"[a-z0-9.+-]+", item.strip())[0] for item in depends.split(",")}
    return sorted(names)


def main():
    folder = pathlib.Path(sys.argv[1])
    names = wanted((folder / "debs").glob("*.deb"))
    tar, root, recipe = folder / "base.tar", folder / "base", folder / "base.recipe"
    if tar.exists() and recipe.exists() and recipe.read_text().split() == names:
        return
    shutil.rmtree(root, ignore_errors=True)
    log = folder / "base.log"
    include = ",".join(map(real, names))
    with open(log, "w") as stream:
        result = subprocess.run(["debootstrap", "--variant=minbase", f"--include={include}", SUITE, str(root), archive()],
                                stdout=stream, stderr=subprocess.STDOUT)
    if result.returncode != 0:
        sys.exit(f"debootstrap failed:\n{log.read_text()[-2000:]}")
    shutil.rmtree(root / "var/cache/apt")
    out("tar", "--create", "--numeric-owner", "--one-file-system", "--directory", str(root), "--file", str(tar), ".")
    shutil.rmtree(root)
    recipe.write_text(" ".join(names))


if __name__ == "__main__":
    main()
