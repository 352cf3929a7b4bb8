"""Programs of other people against the installed development files, below a folder that is not /usr."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

PACKAGES = pathlib.Path(os.environ["AXLECAST_PACKAGES"])
HERE = pathlib.Path(__file__).resolve().parent


def out(*command, **options):
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    if result.returncode != 0:
        raise AssertionError(f"{command[0]}: exit code {result.returncode}\n{result.stdout}\n{result.stderr}")
    return result.stdout


class Consumer(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        for package in ("libaxlecast-dev_*.deb", "python3-axlecast_*.deb"):
            deb, = PACKAGES.glob("debs/" + package)
            out("dpkg-deb", "--extract", deb, self.folder / "root")
        self.usr = self.folder / "root/usr"
        self.examples = self.usr / "share/doc/libaxlecast-dev/examples"

    def assert_usable(self, folder):
        """The programs run as far as they come without a machine: they ask for what they miss."""
        for program in ("print_position", "send_command", "control_process"):
            result = subprocess.run([folder / program], capture_output=True, text=True)
            self.assertIn("usage", (result.stdout + result.stderr).lower(), program)

    def test_cmake_finds_the_package(self):
        build = self.folder / "build"
        out("cmake", "-S", HERE / "consumer", "-B", build, f"-DCMAKE_PREFIX_PATH={self.usr}",
            f"-DEXAMPLES={self.examples}")
        out("cmake", "--build", build)
        self.assert_usable(build)

    def test_pkg_config_finds_the_libraries(self):
        found, = self.usr.glob("lib/*/pkgconfig")
        environment = dict(os.environ, PKG_CONFIG_PATH=str(found))
        for module, example in (("axlecast", "print_position"), ("axlecast-machine", "send_command")):
            flags = out("pkg-config", "--cflags", "--libs", module, env=environment).split()
            out("c++", "-std=c++17", self.examples / f"{example}.cpp", *flags, "-o", self.folder / example)
        flags = out("pkg-config", "--cflags", "--libs", "axlecast-c", env=environment).split()
        out("gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-pedantic", self.examples / "control_process.c", *flags, "-o",
            self.folder / "control_process")
        self.assert_usable(self.folder)

    def test_a_control_process_links_neither_drivers_nor_the_machine_file(self):
        library, = self.usr.glob("lib/*/libaxlecast_client.a")
        symbols = out("nm", "--demangle", "--undefined-only", library)
        for foreign in ("YAML::", "modbus_", "gpiod_"):
            self.assertNotIn(foreign, symbols)
        build = self.folder / "build"
        out("cmake", "-S", HERE / "consumer", "-B", build, f"-DCMAKE_PREFIX_PATH={self.usr}", f"-DEXAMPLES={self.examples}")
        out("cmake", "--build", build, "--target", "print_position", "control_process")
        for program in ("print_position", "control_process"):
            needed = out("ldd", build / program)
            for foreign in ("yaml-cpp", "libmodbus", "libgpiod"):
                self.assertNotIn(foreign, needed, program)

    def test_examples_that_need_no_library_of_ours(self):
        """The commands of docs/consumers.md, in C and in Go."""
        types = self.folder / "types"
        types.mkdir()
        out("lcm-gen", "-c", "--c-cpath", types, "--c-hpath", types, self.usr / "share/axlecast/lcmtypes/position_t.lcm")
        out("gcc", "-std=c11", f"-I{types}", self.examples / "print_position.c", types / "axlecast_position_t.c", "-llcm", "-o",
            self.folder / "print_position_c")
        monitor = self.folder / "monitor"
        monitor.mkdir()
        offline = dict(os.environ, GOPROXY="off", GOENV="off", CGO_ENABLED="0", GOCACHE=str(self.folder / "cache"), GOPATH=str(self.folder / "path"))
        out("go", "mod", "init", "monitor", cwd=monitor, env=offline)
        out("go", "mod", "edit", "-require=axlecast@v0.0.0", f"-replace=axlecast={self.usr}/share/axlecast/go", cwd=monitor, env=offline)
        (monitor / "main.go").write_text('package main\n\nimport "axlecast"\n\nfunc main() {\n\tprintln(new(axlecast.Position).TypeName())\n}\n')
        out("go", "build", ".", cwd=monitor, env=offline)
        self.assertEqual(subprocess.run([monitor / "monitor"], stderr=subprocess.PIPE, text=True, check=True).stderr, "position_t\n")
        out("go", "build", "-o", self.folder, "axlecast/cmd/print_position", cwd=monitor, env=offline)
        for program in ("print_position_c", "print_position"):
            self.assertNotEqual(subprocess.run([self.folder / program, "udpm://no.group"], capture_output=True).returncode, 0)
        self.assertEqual(list(self.usr.glob("share/axlecast/go/**/*_test.go")), [])

    def test_python_types_need_no_binding_of_lcm(self):
        script = ("import axlecast\n"
                  "from axlecast.receiver import Receiver\n"
                  "sent = axlecast.alarm_entry_t()\n"
                  "sent.name = 'battery'\n"
                  "print(axlecast.alarm_entry_t.decode(sent.encode()).name)\n")
        modules = self.usr / "lib/python3/dist-packages"
        self.assertEqual(out(sys.executable, "-B", "-c", script, env={"PYTHONPATH": str(modules)}), "battery\n")


if __name__ == "__main__":
    unittest.main()
