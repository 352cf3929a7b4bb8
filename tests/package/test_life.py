"""A package's whole life in a clean Debian: installed, run, upgraded, removed, purged, and nothing is left.

No systemd runs in the chroot: the units' commands are started here as the units say, with their user and environment."""

import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

PACKAGES = pathlib.Path(os.environ["AXLECAST_PACKAGES"])
LIMIT = float(os.environ.get("AXLECAST_LIMIT", 60))  # s, generous: a slow, shared machine must pass
CONFIG = "/etc/axlecast/machine.yaml"
ACCOUNTS = [f"axlecast-{name}" for name in ("bridge", "drivers", "record", "ship", "web", "mqtt", "multicast")]
# What dpkg and its helpers keep of their own: their database, logs and caches.
OTHERS = re.compile(r"var/lib/(dpkg|apt|systemd|ucf)/|var/log/(dpkg\.log|alternatives\.log)$|var/cache/|etc/\.pwd\.lock$|"
                    r"etc/(passwd|group|shadow|gshadow)-$|(tmp|proc|dev|sys|root)/|packages/")


class Life(unittest.TestCase):
    def setUp(self):
        folder = tempfile.mkdtemp(dir=PACKAGES)
        self.addCleanup(shutil.rmtree, folder)
        self.root = pathlib.Path(folder)
        self.processes = []
        self.host("tar", "--extract", "--numeric-owner", "--directory", folder, "--file", PACKAGES / "base.tar")
        (self.root / "packages").mkdir()
        for deb in [*PACKAGES.glob("debs/*.deb"), PACKAGES / "newer/axlecast.deb"]:
            shutil.copy(deb, self.root / "packages")
        self.mount("-t", "proc", "proc", "proc")
        self.mount("-t", "devpts", "-o", "newinstance,ptmxmode=0666", "devpts", "dev/pts")

    def mount(self, *words):
        *options, place = words
        self.host("mount", *options, self.root / place)
        self.addCleanup(self.host, "umount", "--lazy", self.root / place)

    def host(self, *command):
        subprocess.run([str(word) for word in command], check=True)

    def inside(self, *command, code=0):
        """The output of the command; fails the test when its exit code is another one. `code` None: any."""
        result = subprocess.run(["chroot", self.root, *command], capture_output=True, text=True, timeout=300,
                                env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive"})
        if code is not None:
            self.assertEqual(result.returncode, code, f"{command}\n{result.stdout}\n{result.stderr}")
        return result.stdout

    def files(self):
        """Every path below the chroot but those of dpkg itself."""
        found = set()
        for folder, folders, files in os.walk(self.root):
            for name in folders + files:
                path = os.path.relpath(os.path.join(folder, name), self.root)
                if not OTHERS.match(path + ("/" if name in folders else "")):
                    found.add(path)
        return found

    def install(self, *names):
        debs = [f"/packages/{deb.name}" for name in names for deb in (self.root / "packages").glob(name)]
        self.assertEqual(len(debs), len(names))
        self.inside("dpkg", "--install", *debs)

    def status(self):
        return self.inside("dpkg-query", "--show", "--showformat=${Version} ${db:Status-Status}", "axlecast", code=None)

    def start_units(self):
        """What systemd would start with axlecast.target, as the generator lists it."""
        self.inside("/lib/systemd/system-generators/axlecast-generator", "/tmp/units", "/tmp/units", "/tmp/units")
        wanted = sorted((self.root / "tmp/units/axlecast.target.wants").iterdir())
        for link in wanted:
            unit = self.root / os.readlink(link).lstrip("/")
            self.assertTrue(unit.exists(), unit)
            instance = re.search(r"@(.*)\.service", link.name)
            self.start(unit.read_text(), instance[1] if instance else "", link.name)
        return [link.name for link in wanted]

    def start(self, unit, instance, name):
        command = re.search(r"^ExecStart=(.*)$", unit, re.MULTILINE)[1].replace("%i", instance).split()
        environment = re.search(r"^Environment=(.*)$", unit, re.MULTILINE)[1].split()
        account = re.search(r"^User=(.*)$", unit, re.MULTILINE)[1]
        log = open(self.root / f"tmp/{name}.log", "w")
        self.addCleanup(log.close)
        words = ["chroot", self.root, *self.as_account(account), "env", "-i", "PATH=/usr/bin:/bin"]
        self.processes.append(subprocess.Popen([*words, *environment, *command], stdout=log, stderr=log))

    def as_account(self, name):
        group = "nogroup" if name == "nobody" else name
        return ["setpriv", f"--reuid={name}", f"--regid={group}", "--init-groups"]

    def stop_units(self):
        for process in self.processes:
            process.send_signal(signal.SIGTERM)
        codes = [process.wait(LIMIT) for process in self.processes]
        self.processes = []
        self.assertEqual(set(codes), {0}, "a clean stop")

    def await_online(self):
        deadline = time.monotonic() + LIMIT
        while True:
            result = subprocess.run(["chroot", self.root, "axlecast", "status"], capture_output=True, text=True)
            if result.returncode == 0:
                return
            self.assertLess(time.monotonic(), deadline, result.stdout + result.stderr)

    def use_demo(self):
        shutil.copy(self.root / "usr/share/doc/axlecast/examples/demo.yaml", self.root / CONFIG[1:])

    def run_machine(self):
        started = self.start_units()
        self.addCleanup(lambda: [process.kill() for process in self.processes])
        self.assertIn("axlecast-bridge.service", started)
        self.assertIn("axlecast-simulate.service", started)
        self.assertGreaterEqual(sum(name.startswith("axlecast-driver@") for name in started), 10)
        self.await_online()
        answer = json.loads(self.inside("axlecast", "eeprom", "read", "axis1", "0", "2", "--json"))
        self.assertEqual(answer["outcome"], "succeeded")
        self.stop_units()

    def test_installed_run_upgraded_removed_and_purged(self):
        before = self.files()
        self.install("axlecast_*.deb")
        for account in ACCOUNTS:
            self.assertRegex((self.root / "etc/passwd").read_text(), f"(?m)^{account}:")
        self.assertFalse((self.root / CONFIG[1:]).exists(), "no machine is shipped live")
        self.use_demo()
        self.run_machine()
        journals = list((self.root / "var/lib/axlecast").rglob("journal.db"))
        self.assertEqual(len(journals), 1)

        self.inside("dpkg", "--install", "/packages/axlecast.deb")
        self.assertRegex(self.status(), r"\+newer installed")
        self.run_machine()
        self.assertTrue(journals[0].exists())

        self.inside("dpkg", "--remove", "axlecast")
        self.assertFalse((self.root / "usr/bin/axlecast").exists())
        self.assertTrue(journals[0].exists(), "what was recorded outlives a removal")
        self.inside("dpkg", "--purge", "axlecast")
        self.assertEqual(self.status(), "")
        self.assertEqual(sorted(self.files() - before), ["etc/axlecast", CONFIG[1:]], "the operator's file only")
        self.assertEqual(sorted(before - self.files()), [])

    def may_read(self, account, path):
        result = subprocess.run(["chroot", self.root, *self.as_account(account), "cat", path], capture_output=True)
        return result.returncode == 0

    def readers(self, path):
        return {account for account in [*ACCOUNTS, "nobody"] if self.may_read(account, path)}

    def test_each_account_reads_its_own_key_only(self):
        self.install("axlecast_*.deb")
        self.inside("axlecast", "keygen", "--machine", "press3", "--group", "axlecast")
        keys = "/etc/axlecast/press3"
        self.assertEqual(self.readers(f"{keys}/bridge.key"), {"axlecast-bridge"})
        self.assertEqual(self.readers(f"{keys}/drivers.key"), {"axlecast-drivers"})
        self.assertEqual(self.readers(f"{keys}/local.key"), set(), "operators are persons")
        (self.root / CONFIG[1:]).write_text("machine: press3\n")
        self.assertEqual(len(self.readers(CONFIG)), len(ACCOUNTS) + 1, "the machine's file is no secret")
        self.inside("useradd", "--groups", "axlecast", "anna")
        self.assertTrue(self.may_read("anna", f"{keys}/local.key"))
        self.assertFalse(self.may_read("anna", f"{keys}/bridge.key"))

    def test_an_upgrade_hands_over_what_the_former_account_had(self):
        """One account, axlecast, ran everything before each process had its own."""
        self.install("axlecast_*.deb")
        self.inside("useradd", "--system", "--gid", "axlecast", "axlecast")
        self.inside("axlecast", "keygen", "--machine", "press3", "--group", "axlecast")
        for command in ("chgrp axlecast /etc/axlecast/press3/bridge.key /etc/axlecast/press3/drivers.key",
                        "mkdir -p /var/lib/axlecast/press3 /var/log/axlecast/press3", "touch /var/lib/axlecast/press3/journal.db",
                        "chown -R axlecast:axlecast /var/lib/axlecast /var/log/axlecast",
                        "chmod 0640 /var/lib/axlecast/press3/journal.db", "chmod 0750 /var/lib/axlecast /var/lib/axlecast/press3"):
            self.inside(*command.split())
        self.inside("dpkg", "--install", "/packages/axlecast.deb")
        self.assertEqual(self.readers("/etc/axlecast/press3/bridge.key"), {"axlecast-bridge"})
        self.assertEqual(self.readers("/etc/axlecast/press3/drivers.key"), {"axlecast-drivers"})
        self.assertEqual(self.readers("/var/lib/axlecast/press3/journal.db"), {"axlecast-bridge"})
        self.inside("useradd", "--groups", "axlecast", "anna")
        self.assertTrue(self.may_read("anna", "/var/lib/axlecast/press3/journal.db"), "operators read the journal")
        owner = self.inside("stat", "--format", "%U:%G", "/var/log/axlecast/press3").strip()
        self.assertEqual(owner, "axlecast-record:axlecast")

    def test_nothing_is_left_of_one_that_was_never_used(self):
        before = self.files()
        self.install("axlecast_*.deb", "axlecast-doc_*.deb", "axlecast-java_*.deb", "python3-axlecast_*.deb")
        self.inside("python3", "-c", "import axlecast")
        self.inside("dpkg", "--purge", "axlecast-doc", "axlecast-java", "python3-axlecast", "axlecast")
        self.assertEqual(sorted(self.files() ^ before), [])

    def test_a_file_with_mistakes_starts_nothing_and_says_why(self):
        self.install("axlecast_*.deb")
        (self.root / CONFIG[1:]).write_text("machine: m\nbusses: {}\n")
        result = subprocess.run(["chroot", self.root, "/lib/systemd/system-generators/axlecast-generator", "/tmp/units"],
                                capture_output=True, text=True)
        self.assertEqual(result.returncode, 1)
        self.assertIn("machine.yaml:2", result.stderr)
        self.assertFalse((self.root / "tmp/units").exists())


if __name__ == "__main__":
    unittest.main()
