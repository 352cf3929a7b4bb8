#!/usr/bin/python3
"""Compares what we depend on with the known vulnerabilities of vulnerabilities.json: vulnerabilities.py [SBOM...]

Without an SBOM (*.spdx.json of our packages) it looks at this host: the installed packages of each source that the list
names. Prints each vulnerability that is there with the decision on it. Exit code 1 where there is something to do: an update
that is not installed, a vulnerability without a decision, or a library in the SBOM that nobody reviewed.

The list is as old as its date: it says nothing about what became known later."""

import json
import pathlib
import re
import subprocess
import sys

LIST = pathlib.Path(__file__).with_name("vulnerabilities.json")
DECISIONS = {"update": "to do", "open": "to do", "mitigated": "decided", "not reachable": "decided", "accepted": "decided"}
LINKED = ("DYNAMIC_LINK", "STATIC_LINK")


def older(version, than):
    return subprocess.run(["dpkg", "--compare-versions", version, "lt", than], check=False).returncode == 0


def of_host(sources):
    """Source -> version, of the binary packages that are installed here."""
    form = "${source:Package} ${source:Version} ${db:Status-Status}\n"
    text = subprocess.run(["dpkg-query", "--show", f"--showformat={form}"], check=True, capture_output=True, text=True).stdout
    rows = [line.split() for line in text.splitlines()]
    return {row[0]: row[1] for row in rows if len(row) == 3 and row[2] == "installed" and row[0] in sources}


def of_sbom(document):
    """(source -> version, sources that are linked directly)."""
    versions, names = {}, {}
    for package in document["packages"]:
        source = re.match(r"source package (\S+) (\S+)$", package.get("comment", ""))
        if source:
            versions[source[1]] = source[2]
            names[package["SPDXID"]] = source[1]
    linked = {names.get(relation["relatedSpdxElement"]) for relation in document["relationships"]
              if relation["relationshipType"] in LINKED}
    return versions, linked - {None}


def judged(entries, versions):
    """(entry, installed version) of each vulnerability that is there."""
    for entry in entries:
        version = versions.get(entry["package"])
        if version and (entry["fixed"] is None or older(version, entry["fixed"])):
            yield entry, version


def report(known, versions, linked):
    """Prints it; returns how much there is to do."""
    todo = 0
    print(f"known vulnerabilities of {known['date']}, {known['distribution']}; {len(versions)} sources compared")
    for entry, version in judged(known["entries"], versions):
        open_point = DECISIONS[entry["decision"]] == "to do"
        todo += open_point
        print(f"{'TO DO' if open_point else 'decided'}: {entry['package']} {version}: {', '.join(entry['ids'])}")
        remedy = f"update to {entry['fixed']} or later" if entry["decision"] == "update" else entry["decision"]
        print(f"    {remedy}: {entry['reason']}")
    for source in sorted(linked - set(known["reviewed"])):
        todo += 1
        print(f"TO DO: {source}: nobody has looked for its vulnerabilities; do so and add it to `reviewed`")
    return todo


def main(*files):
    known = json.loads(LIST.read_text())
    versions, linked = {}, set()
    for file in files:
        more, direct = of_sbom(json.loads(pathlib.Path(file).read_text()))
        versions |= more
        linked |= direct
    if not files:
        versions = of_host({entry["package"] for entry in known["entries"]})
    return 1 if report(known, versions, linked) else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
