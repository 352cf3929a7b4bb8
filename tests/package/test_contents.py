"""What is in the packages: complete, documented, and nothing that lintian, mandoc or systemd objects to."""

import gzip
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

PACKAGES = pathlib.Path(os.environ["AXLECAST_PACKAGES"])
DEBS = sorted((PACKAGES / "debs").glob("*.deb"))
MOST_EXPOSURE = 2.0
SOURCE = pathlib.Path(__file__).resolve().parents[2]
# Of what tools/packages.sh installs for a build: every Debian builds with the first three; the rest is for tests.
NOT_FOR_PACKAGES = {"g++", "libc6-dev", "linux-libc-dev", "libgtest-dev", "libgmock-dev", "libbenchmark-dev",
                    "libjchart2d-java"}
SHELL = r"""
. /usr/share/bash-completion/bash_completion
. "$1"
shift
COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMP_LINE="$*" COMP_POINT=${#COMP_LINE}
_axlecast
printf '%s\n' "${COMPREPLY[@]}"
"""


def run(*command, **options):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)


class Contents(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.root = pathlib.Path(folder.name)
        for deb in DEBS:
            run("dpkg-deb", "--extract", deb, cls.root).check_returncode()
        cls.bin = cls.root / "usr/bin"
        cls.units = cls.root / "lib/systemd/system"
        cls.tree = json.loads(run(cls.bin / "axlecast", "--cli-tree").stdout)

    def commands(self, tree=None, words=("axlecast",)):
        tree = tree or self.tree
        yield " ".join(words), tree
        for child in tree["commands"]:
            yield from self.commands(child, (*words, child["name"]))

    def test_the_list_of_known_vulnerabilities_is_shipped_with_its_date(self):
        shipped = self.root / "usr/share/doc/axlecast/vulnerabilities.json"
        if not shipped.exists():  # dh_compress packs what is long
            shipped = shipped.with_suffix(".json.gz")
        text = gzip.decompress(shipped.read_bytes()) if shipped.suffix == ".gz" else shipped.read_bytes()
        self.assertRegex(json.loads(text)["date"], r"^20\d\d-\d\d-\d\d$")

    def test_lintian_finds_no_error_and_no_warning(self):
        result = run("lintian", "--fail-on", "error,warning", *DEBS)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_the_build_depends_on_what_the_tools_install(self):
        shell = (SOURCE / "tools/packages.sh").read_text()
        installed = set(re.search(r'^packages_build="([^"]*)"', shell, re.MULTILINE)[1].split())
        control = (SOURCE / "debian/control").read_text()
        field = re.search(r"^Build-Depends:(.*?)^\S", control, re.MULTILINE | re.DOTALL)[1]
        named = {re.match(r"[a-z0-9.+-]+", item.strip())[0] for item in field.split(",")}
        self.assertEqual(installed - named - NOT_FOR_PACKAGES, set())

    def test_a_build_of_debhelper_installs_below_usr(self):
        with tempfile.TemporaryDirectory() as folder:
            words = ["-DCMAKE_INSTALL_PREFIX=/usr", "-DCMAKE_INSTALL_LIBDIR=lib/triplet", "-DAXLECAST_TESTS=OFF",
                     "-DAXLECAST_BENCH=OFF"]  # as dh_auto_configure and debian/rules have them
            result = run("cmake", "-G", "Ninja", "-S", SOURCE, "-B", folder, *words)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            script = pathlib.Path(folder, "packaging/client/cmake_install.cmake").read_text()
        self.assertIn('"${CMAKE_INSTALL_PREFIX}/lib/triplet/pkgconfig"', script)
        self.assertNotIn(f'DESTINATION "{folder}', script)

    def test_every_command_and_option_is_described(self):
        for name, command in self.commands():
            self.assertTrue(command["description"], name)
            for option in command["options"] + command["arguments"]:
                self.assertTrue(option["description"], f"{name} {option['names']}")

    def test_every_program_and_command_has_a_page(self):
        names = [program.name for program in self.bin.iterdir()]
        names += [f"axlecast-{command['name']}" for command in self.tree["commands"]]
        names += ["axlecast.yaml", "axlecast.units", "axlecast.target"]
        pages = {path.name.rsplit(".", 2)[0] for path in (self.root / "usr/share/man").glob("man*/*.gz")}
        self.assertEqual(sorted(set(names) - pages), [])

    def test_pages_are_sound(self):
        folder = self.root / "usr/share/man"
        for page in sorted(path for path in folder.glob("man*/*.gz") if not path.is_symlink()):
            plain = page.with_suffix("")
            plain.write_bytes(subprocess.run(["zcat", page], check=True, capture_output=True).stdout)
            with self.subTest(page=plain.name):
                self.assertEqual(run("mandoc", "-Tlint", "-W", "warning", plain).stdout, "")
                self.assertEqual(run("lexgrog", plain).returncode, 0)

    def test_pages_say_every_option(self):
        for command in self.tree["commands"]:
            page = run("man", "--local-file", self.root / f"usr/share/man/man1/axlecast-{command['name']}.1.gz",
                       env={**os.environ, "MANWIDTH": "200", "LC_ALL": "C.UTF-8"}).stdout
            for option in command["options"]:
                for name in option["names"]:
                    if name not in ("-h", "--help"):
                        self.assertIn(name, page, command["name"])

    def complete(self, *words):
        script = self.root / "usr/share/bash-completion/completions/axlecast"
        environment = dict(os.environ, PATH=f"{self.bin}:{os.environ['PATH']}", AXLECAST_CONFIG=str(
            self.root / "usr/share/doc/axlecast/examples/demo.yaml"))
        result = run("bash", "-c", SHELL, "bash", script, *words, env=environment)
        self.assertEqual(result.stderr, "")
        return result.stdout.split()

    def test_completion_knows_commands_options_choices_and_the_machine(self):
        self.assertEqual(self.complete("axlecast", "check"), ["check-config"])
        self.assertIn("convert", self.complete("axlecast", "log", ""))
        self.assertEqual(self.complete("axlecast", "check-config", "--js"), ["--json"])
        self.assertEqual(self.complete("axlecast", "check-config", "--list", ""), ["buses", "devices", "units"])
        self.assertEqual(self.complete("axlecast", "info", "convey"), ["conveyor"])
        self.assertEqual(self.complete("axlecast", "eeprom", "read", "axis"), ["axis1", "axis2", "axis3", "axis4"])

    def services(self):
        services = sorted(self.units.glob("*.service"))
        self.assertIn(self.units / "axlecast-driver@.service", services)
        return services

    def test_units_are_sandboxed(self):
        for service in self.services():
            text = run("systemd-analyze", "security", "--offline=true", "--no-pager", service).stdout
            exposure = float(re.search(r"exposure level for \S+: ([\d.]+)", text)[1])
            self.assertLessEqual(exposure, MOST_EXPOSURE, service.name)

    def test_units_are_sound(self):
        # systemd looks for programs and pages in the running system: this is where ours are.
        folder = self.root / "verify"
        folder.mkdir()
        for unit in [*self.services(), self.units / "axlecast.target"]:
            text = re.sub(r"^ExecStart=(\S+)", rf"ExecStart={self.bin}/\1", unit.read_text(), flags=re.MULTILINE)
            (folder / unit.name).write_text(re.sub(r"^Documentation=.*\n", "", text, flags=re.MULTILINE))
        for unit in sorted(folder.iterdir()):
            result = run("systemd-analyze", "verify", "--man=no", unit)
            self.assertEqual((result.returncode, result.stderr), (0, ""), unit.name)

    def test_units_run_commands_that_exist(self):
        names = {command["name"] for command in self.tree["commands"]}
        for service in self.services():
            program, *words = re.search(r"^ExecStart=(.*)$", service.read_text(), re.MULTILINE)[1].split()
            self.assertTrue((self.bin / program).exists(), service.name)
            if program == "axlecast":
                self.assertIn(words[0], names, service.name)

    def test_udev_rules_are_well_formed(self):
        rules = self.root / "lib/udev/rules.d/70-axlecast.rules"
        for line in rules.read_text().splitlines():
            self.assertRegex(line, r'^(#.*|([A-Z]+(\{\w+\})?(==|!=|=|\+=)"[^"]*"(, )?)+|)$')


if __name__ == "__main__":
    unittest.main()
