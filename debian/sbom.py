#!/usr/bin/python3
"""Writes what a package holds and needs as SPDX 2.3 JSON: sbom.py FOLDER PACKAGE... , after dh_gencontrol.

FOLDER/PACKAGE is the package's tree. Its libraries are those that its programs are linked with, as the dynamic linker finds
them, each with the Debian package that it is from; its other dependencies are those of its control file. Versions are those
of the host that builds. The same tree and host give the same bytes: the time is SOURCE_DATE_EPOCH."""

import datetime
import functools
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys

# Header-only libraries: compiled into our programs, without a trace in the program file.
HEADER_ONLY = ["libcli11-dev", "libexpected-dev", "nlohmann-json3-dev"]
# Data embedded in programs: a pattern that identifies the data, and its version if it has one.
EMBEDDED = {"uPlot": rb"leeoniya/uPlot \(v([\d.]+)\)", "Inter": rb"wOF2()"}


def out(*command):
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True).stdout


def is_elf(path):
    with open(path, "rb") as file:
        return file.read(4) == b"\x7fELF"


def programs(root):
    """Dynamically linked files."""
    files = sorted(path for path in root.rglob("*") if path.is_file() and not path.is_symlink() and is_elf(path))
    return [path for path in files if "(NEEDED)" in out("readelf", "--dynamic", path)]


def needed(path):
    return set(re.findall(r"\(NEEDED\)\s+Shared library: \[(.*?)\]", out("readelf", "--dynamic", path)))


def closure(path):
    """Name -> file of each library that is loaded with it."""
    return dict(re.findall(r"^\s*(\S+) => (/\S+)", out("ldd", path), re.MULTILINE))


@functools.cache
def owner(file):
    """The Debian package of a library. dpkg knows files by the name under which they were installed."""
    for name in (file, file.removeprefix("/usr"), "/usr" + file):
        real = str(pathlib.Path(name).parent.resolve() / pathlib.Path(name).name)
        for place in dict.fromkeys((name, real, str(pathlib.Path(name).resolve()))):
            result = subprocess.run(["dpkg-query", "--search", place], capture_output=True, text=True)
            if result.returncode == 0:
                return result.stdout.split(":")[0]
    sys.exit(f"sbom.py: {file} is of no Debian package: link with Debian's libraries")


def installed(package):
    """(version, source package, its version, architecture), or nothing."""
    form = "${Version} ${source:Package} ${source:Version} ${Architecture} ${db:Status-Status}\n"
    result = subprocess.run(["dpkg-query", "--show", f"--showformat={form}", package], capture_output=True, text=True)
    words = result.stdout.split("\n")[0].split()
    return words[:4] if result.returncode == 0 and words[-1] == "installed" else None


def distribution():
    values = dict(re.findall(r'^(\w+)="?(.*?)"?$', pathlib.Path("/etc/os-release").read_text(), re.MULTILINE))
    return f"{values['ID']}-{values.get('VERSION_ID', 'unstable')}"


def spdx_id(name):
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name)


def component(name, version, purl="", supplier="NOASSERTION", comment=""):
    entry = {"SPDXID": spdx_id(name), "name": name, "versionInfo": version, "downloadLocation": "NOASSERTION",
             "filesAnalyzed": False, "licenseConcluded": "NOASSERTION", "licenseDeclared": "NOASSERTION",
             "copyrightText": "NOASSERTION", "supplier": supplier}
    if purl:
        entry["externalRefs"] = [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": purl}]
    if comment:
        entry["comment"] = comment
    return entry


def debian_component(package):
    version, source, source_version, architecture = installed(package) or sys.exit(f"sbom.py: {package} is not installed")
    quoted = version.replace("+", "%2B").replace(":", "%3A")
    return component(package, version, f"pkg:deb/debian/{package}@{quoted}?arch={architecture}&distro={distribution()}",
                     "Organization: Debian", f"source package {source} {source_version}")


def control(folder, package):
    text = (folder / package / "DEBIAN/control").read_text()
    return {name: " ".join(value.split()) for name, value in re.findall(r"^(\S+): (.*(?:\n .*)*)", text, re.MULTILINE)}


def dependencies(fields):
    """Of each the first alternative, where it is installed here."""
    names = [re.match(r"\s*([a-z0-9.+-]+)", item)[1] for item in fields.get("Depends", "").split(",") if item.strip()]
    return [name for name in names if installed(name)]


def embedded(files):
    """Version of each piece of data that the programs carry; empty if it has none."""
    found = {}
    for path in files:
        content = path.read_bytes()
        for name, pattern in EMBEDDED.items():
            match = re.search(pattern, content)
            if match:
                found[name] = match[1].decode()
    return found


def document(folder, package):
    fields = control(folder, package)
    own = component(package, fields["Version"],
                    f"pkg:deb/axlecast/{package}@{fields['Version'].replace('+', '%2B')}?arch={fields['Architecture']}")
    own["licenseDeclared"] = "Apache-2.0"
    files = programs(folder / package)
    direct, indirect = set(), set()
    for path in files:
        libraries = closure(path)
        direct |= {owner(libraries[name]) for name in needed(path) if name in libraries}
        indirect |= {owner(file) for file in libraries.values()}
    relations = {name: "DYNAMIC_LINK" for name in direct}
    relations |= {name: "DEPENDS_ON" for name in sorted(indirect - direct) + dependencies(fields) if name not in relations}
    if files:
        relations |= {name: "STATIC_LINK" for name in HEADER_ONLY if installed(name)}
    # Our own packages of the same build are not installed here.
    packages = [debian_component(name) for name in sorted(relations)]
    for name, version in sorted(embedded(files).items()):
        packages.append(component(name, version or "NOASSERTION", comment="carried by the page of axlecast web"))
        relations[name] = "CONTAINS"
    content = {
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"{package}-{fields['Version']}",
        "packages": [own, *packages],
        "relationships": [
            {"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": own["SPDXID"]},
            *({"spdxElementId": own["SPDXID"], "relationshipType": kind, "relatedSpdxElement": spdx_id(name)}
              for name, kind in sorted(relations.items()))]}
    tag = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]
    time = datetime.datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), datetime.timezone.utc)
    return content | {"documentNamespace": f"https://axlecast.example.com/spdx/{content['name']}-{tag}",
                      "creationInfo": {"created": time.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: axlecast-sbom"]}}


def main(folder, *packages):
    for package in packages:
        place = pathlib.Path(folder, package, "usr/share/doc", package)
        place.mkdir(parents=True, exist_ok=True)
        file = place / f"{package}.spdx.json"
        file.write_text(json.dumps(document(pathlib.Path(folder), package), indent=1) + "\n")
        file.chmod(0o644)


if __name__ == "__main__":
    main(*sys.argv[1:])
