"""The programs as they are built: position independent, with everything bound and read-only before main, checked stacks, and
checked calls of the C library. Read by readelf."""

import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

BUILD = pathlib.Path(os.environ["AXLECAST_BUILD"])
SOURCE = pathlib.Path(__file__).resolve().parents[2]
CACHE = (BUILD / "CMakeCache.txt").read_text()


def readelf(program, *words):
    return subprocess.run(["readelf", "--wide", *words, program], check=True, capture_output=True, text=True).stdout


def programs():
    """What is installed."""
    found = [path for path in sorted((BUILD / "bin").glob("axlecast*")) if os.access(path, os.X_OK) and path.is_file()]
    assert "axlecast-bridge" in [path.name for path in found], found
    return [path for path in found if path.read_bytes()[:4] == b"\x7fELF"]


class Hardening(unittest.TestCase):
    def each(self, check):
        for program in programs():
            with self.subTest(program=program.name):
                check(program)

    def test_programs_are_position_independent(self):
        def check(program):
            self.assertRegex(readelf(program, "--file-header"), r"Type:\s+DYN ")
            self.assertRegex(readelf(program, "--dynamic"), r"FLAGS_1\).*\bPIE\b")
        self.each(check)

    def test_relocations_are_read_only_and_bound_at_start(self):
        def check(program):
            self.assertIn("GNU_RELRO", readelf(program, "--program-headers"))
            self.assertRegex(readelf(program, "--dynamic"), r"FLAGS_1\).*\bNOW\b")
        self.each(check)

    def test_no_stack_is_executable(self):
        def check(program):
            self.assertRegex(readelf(program, "--program-headers"), r"GNU_STACK\s.*\sRW\s")
        self.each(check)

    def test_stacks_are_protected(self):
        self.each(lambda program: self.assertRegex(readelf(program, "--dyn-syms"), r"__stack_chk_fail\b"))

    def test_calls_of_the_c_library_are_checked(self):
        if re.search(r"^CMAKE_BUILD_TYPE:\w+=Debug$", CACHE, re.MULTILINE):
            return  # not optimised: no such checks exist
        self.each(lambda program: self.assertRegex(readelf(program, "--dyn-syms"), r"\b__(?!stack)\w+_chk\b"))

    def test_every_build_type_has_the_flags(self):
        for kind in ("Release", "RelWithDebInfo", "MinSizeRel", "Debug"):
            with self.subTest(kind), tempfile.TemporaryDirectory() as folder:
                subprocess.run(["cmake", "-S", SOURCE, "-B", folder, "-G", "Ninja", f"-DCMAKE_BUILD_TYPE={kind}",
                                "-DAXLECAST_UNIT_TESTS=OFF", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"],
                               check=True, capture_output=True)
                commands = json.loads((pathlib.Path(folder) / "compile_commands.json").read_text())
                own = [entry["command"] for entry in commands if "-Woverloaded-virtual" in entry["command"]]
                self.assertGreater(len(own), 100)
                fortified = [] if kind == "Debug" else ["-D_FORTIFY_SOURCE=2"]  # needs optimisation
                for flag in ["-fstack-protector-strong", "-fstack-clash-protection", "-fPIE", *fortified]:
                    self.assertEqual([line for line in own if flag not in line][:1], [], flag)
                ninja = (pathlib.Path(folder) / "build.ninja").read_text()
                links = re.findall(r"^  LINK_FLAGS = (.*)$", ninja, re.MULTILINE)
                hardened = [line for line in links if "-z,relro,-z,now,-z,noexecstack" in line and "-pie" in line]
                self.assertGreaterEqual(len(hardened), len(list(programs())), links)

    def test_every_file_is_compiled_with_the_flags(self):
        commands = (BUILD / "compile_commands.json").read_text()
        compiled = re.findall(r'"command": "(.*?)",?$', commands, re.MULTILINE)
        own = [line for line in compiled if "-Woverloaded-virtual" in line]
        self.assertGreater(len(own), 100)
        flags = ["-fstack-protector-strong", "-fstack-clash-protection", "-fPIE"]
        if os.uname().machine == "x86_64":
            flags.append("-fcf-protection=full")
        for flag in flags:
            self.assertEqual([line for line in own if flag not in line][:1], [], flag)


if __name__ == "__main__":
    unittest.main()
