"""The SBOM of each package: SPDX 2.3 (https://spdx.github.io/spdx-spec/v2.3/), complete, and true of the programs."""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

PACKAGES = pathlib.Path(os.environ["AXLECAST_PACKAGES"])
DEBS = sorted((PACKAGES / "debs").glob("*.deb"))
JOB = pathlib.Path(__file__).resolve().parents[2] / "packaging/security/vulnerabilities.py"
# Clauses 6 (creation), 7 (package) and 11 (relationships) of the specification: what must be there, and its form.
DOCUMENT = {"spdxVersion": r"SPDX-2\.3", "dataLicense": r"CC0-1\.0", "SPDXID": r"SPDXRef-DOCUMENT", "name": r".+",
            "documentNamespace": r"https?://[^#\s]+"}
PACKAGE = {"SPDXID": r"SPDXRef-[A-Za-z0-9.-]+", "name": r".+", "versionInfo": r".+", "downloadLocation": r"NOASSERTION|NONE|\w+://\S+",
           "licenseConcluded": r".+", "licenseDeclared": r".+", "copyrightText": r".+",
           "supplier": r"NOASSERTION|(Person|Organization): .+"}
KINDS = {"DESCRIBES", "DYNAMIC_LINK", "STATIC_LINK", "DEPENDS_ON", "CONTAINS"}


class Sbom(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.root = pathlib.Path(folder.name)
        cls.files = {}
        for deb in DEBS:
            name = deb.name.split("_")[0]
            subprocess.run(["dpkg-deb", "--extract", deb, cls.root / name], check=True)
            cls.files[name] = cls.root / name / f"usr/share/doc/{name}/{name}.spdx.json"
        cls.documents = {name: json.loads(file.read_text()) for name, file in cls.files.items()}

    def linked(self, name, *kinds):
        return {relation["relatedSpdxElement"].removeprefix("SPDXRef-") for relation in self.documents[name]["relationships"]
                if relation["relationshipType"] in kinds}

    def test_each_package_has_one_of_the_form_that_spdx_asks_for(self):
        self.assertEqual(len(self.documents), 5)
        for name, document in self.documents.items():
            with self.subTest(package=name):
                for key, form in DOCUMENT.items():
                    self.assertRegex(document[key], rf"^(?:{form})$", key)
                self.assertRegex(document["creationInfo"]["created"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
                for creator in document["creationInfo"]["creators"]:
                    self.assertRegex(creator, r"^(Person|Organization|Tool): \S")
                for package in document["packages"]:
                    for key, form in PACKAGE.items():
                        self.assertRegex(package[key], rf"^(?:{form})$", f"{package['name']}: {key}")
                    self.assertIs(package["filesAnalyzed"], False)

    def test_relations_are_between_things_that_are_there(self):
        for name, document in self.documents.items():
            ids = [package["SPDXID"] for package in document["packages"]]
            self.assertEqual(len(ids), len(set(ids)), name)
            described = [relation for relation in document["relationships"] if relation["relationshipType"] == "DESCRIBES"]
            self.assertEqual([relation["relatedSpdxElement"] for relation in described], [f"SPDXRef-{name}"])
            related = {relation["relatedSpdxElement"] for relation in document["relationships"]}
            self.assertEqual(related, set(ids), f"{name}: each is related to the package")
            self.assertLessEqual({relation["relationshipType"] for relation in document["relationships"]}, KINDS)

    def test_it_names_the_package_and_its_version(self):
        for deb in DEBS:
            name, version, _ = deb.name.split("_")
            own = self.documents[name]["packages"][0]
            self.assertEqual((own["name"], own["versionInfo"], own["licenseDeclared"]), (name, version, "Apache-2.0"))

    def test_every_library_that_a_program_loads_is_there(self):
        sources = self.documents["axlecast"]["packages"]
        self.assertGreater(len(sources), 15)
        known = {package["name"] for package in sources}
        programs = sorted((self.root / "axlecast/usr/bin").iterdir())
        text = subprocess.run(["ldd", *programs], check=True, capture_output=True, text=True).stdout
        names = {library: {library, str(pathlib.Path(library).resolve()), "/usr" + library, library.removeprefix("/usr")}
                 for library in re.findall(r"=> (/\S+)", text)}
        # Some of these names belong to no package, of which dpkg-query complains.
        found = subprocess.run(["dpkg-query", "--search", *set().union(*names.values())], capture_output=True, text=True).stdout
        owners = {line.rsplit(": ", 1)[1]: line.split(":")[0] for line in found.splitlines()}
        for library, candidates in names.items():
            self.assertTrue(known & {owners.get(name) for name in candidates}, library)

    def test_it_tells_how_they_are_linked(self):
        direct = self.linked("axlecast", "DYNAMIC_LINK")
        self.assertLessEqual({"liblcm1", "libsodium23", "libsqlite3-0", "libmosquitto1", "libc6"}, direct)
        self.assertIn("libglib2.0-0", self.linked("axlecast", "DEPENDS_ON"), "liblcm's, not ours")
        self.assertLessEqual({"libcli11-dev", "nlohmann-json3-dev"}, self.linked("axlecast", "STATIC_LINK"))
        self.assertEqual(self.linked("axlecast-doc", "DYNAMIC_LINK", "STATIC_LINK"), set())

    def test_no_vulnerability_that_is_known_is_left_undecided(self):
        result = subprocess.run([sys.executable, "-B", JOB, self.files["axlecast"]], capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)


if __name__ == "__main__":
    unittest.main()
