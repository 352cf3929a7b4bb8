"""What the tests of `axlecast doctor` share: hosts that are as they should be, until a test spoils one thing."""

import json
import pathlib
import shutil
import subprocess

from machine import BIN, Machine

ENCODER = "{model: ts5669n127, unit: deg, publish_hz: 100}"
# FT232H at full speed behind a hub, as sysfs shows a USB serial port.
USB_FOLDER = "sys/devices/pci0/usb1/1-2"
NULL = "1:3"  # /dev/null replaces the port's device: it exists without any permission


class DoctorMachine(Machine):
    """`found` returns the result of one check."""

    def setUp(self):
        super().setUp()
        self.folder.chmod(0o755)  # other users run the doctor too
        self.root = self.folder / "root"
        self.root.mkdir()
        self.program = BIN / "axlecast"

    def doctor(self, *words, before=()):
        """(exit code, the JSON); `before` begins the command line: another user, another mount."""
        done = subprocess.run([*map(str, before), self.program, "doctor", *map(str, words), "--json"],
                              capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL, check=False)
        self.assertIn(done.returncode, (0, 1), done.stderr + done.stdout)
        return done.returncode, json.loads(done.stdout)

    def found(self, name, config, *words, before=()):
        code, told = self.doctor(config, "--only", name, *words, before=before)
        faults = [finding for finding in told["findings"] if finding["severity"] != "advice"]
        self.assertEqual(code, 1 if faults else 0, told)
        self.assertEqual(told["ok"], code == 0)
        for finding in told["findings"]:
            self.assertEqual(finding["name"], name)
            self.assertTrue(finding["found"] and finding["effect"] and finding["mend"], finding)
        return told["findings"]

    def assert_found(self, name, config, text, *words, before=()):
        """One finding whose text has this in it; returns the lines that fix it."""
        findings = self.found(name, config, *words, before=before)
        self.assertEqual(len(findings), 1, findings)
        self.assertIn(text, findings[0]["found"])
        return findings[0]

    def assert_quiet(self, name, config, *words, before=()):
        self.assertEqual(self.found(name, config, *words, before=before), [])

    def assert_mended(self, name, config, *words):
        """--fix does the very lines that were shown, and a second run finds nothing."""
        shown = [line for finding in self.found(name, config, *words) for line in finding["mend"]]
        code, told = self.doctor(config, "--only", name, "--fix", "--yes", *words)
        self.assertEqual((code, told["findings"]), (0, []), told)
        self.assertTrue(told["mended"])
        self.assertEqual([line for line in shown if line in told["mended"]], told["mended"])
        self.assert_quiet(name, config, *words)

    # -- machines

    def machine(self, link="", bus="", rest="", name="machine.yaml", device=ENCODER):
        """One T-format axis on a port of this host, or simulated."""
        place = f"link: {{{link}}}" if link else "simulate: true"
        return self.write(f"machine: test\n{rest}\nbuses:\n  rs485-0:\n    family: tformat\n    {place}\n    {bus}\n"
                          f"    devices: {{axis1: {device}}}\n", name)

    def on_port(self, port="/dev/ttyUSB0", bus="poll_hz: 500"):
        pty = ", pty: true" if str(port).startswith("/dev/pts/") else ""
        return self.machine(f"port: {port}, baud: 2500000{pty}", bus)

    # -- a host below self.root

    def put(self, path, text):
        file = self.root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"{text}\n")
        return file

    def text(self, path):
        return (self.root / path).read_text()

    def plug_in(self, latency_ms=1, release="0900", name="ttyUSB0"):
        """A USB adapter with its lasting name. Release 0900: FT232H."""
        self.put(f"{USB_FOLDER}/idVendor", "0403")
        self.put(f"{USB_FOLDER}/idProduct", "6014")
        self.put(f"{USB_FOLDER}/bcdDevice", release)
        port = f"{USB_FOLDER}/1-2:1.0/{name}"
        self.put(f"{port}/latency_timer", latency_ms)
        (self.root / port / "tty" / name).mkdir(parents=True, exist_ok=True)
        for link, target in ((f"sys/dev/char/{NULL}", self.root / port / "tty" / name), (f"dev/{name}", "/dev/null"),
                             ("dev/serial/by-id/usb-FTDI_C232HM_FT1-if00-port0", f"../../{name}")):
            place = self.root / link
            place.parent.mkdir(parents=True, exist_ok=True)
            if not place.is_symlink():
                place.symlink_to(target)
        return f"{port}/latency_timer"

    # -- ways to run it

    def need_users(self):
        """Skips without other users; from now on the program is where these can reach it: a checkout may be closed."""
        if int(pathlib.Path("/proc/self/uid_map").read_text().split()[2]) == 1:
            self.skipTest("only root has other users")
        self.program = shutil.copy(BIN / "axlecast", self.folder)

    def as_nobody(self, *limits):
        """As a user without any group; `limits` of prlimit(1)."""
        self.need_users()
        prlimit = ["prlimit", *limits] if limits else []
        return [*prlimit, "setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups", "env",
                f"XDG_STATE_HOME={self.folder}/nobody"]

    def with_small_disk(self, place, size="1m"):
        """With a file system of this size at `place`, which nobody else sees."""
        place.mkdir(parents=True, exist_ok=True)
        mount = f'mount -t tmpfs -o size={size} small "$0" && exec "$@"'
        return ["unshare", "--mount", "--propagation", "unchanged", "sh", "-c", f"mount --make-rprivate / 2>&- ; {mount}", place]
