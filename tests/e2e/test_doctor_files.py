"""`axlecast doctor`: disks, the journal's folder, and the files of keys. Each test creates its condition for real."""

import json
import os
import pathlib
import tempfile
import unittest

from doctor_machine import DoctorMachine


class Disks(DoctorMachine):
    def recording(self, folder, keys):
        """A machine that records into this folder."""
        return self.machine(rest=f"recorder: {{directory: {folder}, logs: {{all: {{{keys}}}}}}}")

    def journalling(self, folder):
        return self.machine(rest=f"bridge: {{journal: {folder}/journal.db}}")

    def memory_folder(self):
        folder = tempfile.TemporaryDirectory(prefix="axlecast-doctor-", dir="/dev/shm")
        self.addCleanup(folder.cleanup)
        return pathlib.Path(folder.name)

    def test_log_folder(self):
        config = self.recording(self.folder / "logs", "quota: 2MB")
        self.assert_quiet("log_folder", config)
        self.assert_found("log_folder", config, "may not create it in", before=self.as_nobody())
        (self.folder / "logs").mkdir()
        self.assert_found("log_folder", config, "may not write into it", before=self.as_nobody())
        (self.folder / "logs").chmod(0o777)
        self.assert_quiet("log_folder", config, before=self.as_nobody())

    def test_log_folder_that_is_a_file(self):
        (self.folder / "logs").write_text("")
        self.assert_found("log_folder", self.recording(self.folder / "logs", "quota: 2MB"), "is not a folder")

    def test_log_space(self):
        disk = self.folder / "disk"
        small = self.with_small_disk(disk, "3m")
        self.assert_quiet("log_space", self.recording(disk, "quota: 2MB"), before=small)
        self.assert_found("log_space", self.recording(disk, "quota: 100MB"), "100 MB", before=small)
        # 100 POSITION a second, some 180 bytes each, and a little more: 70 MB in an hour.
        self.assert_found("log_space", self.recording(disk, "keep: 1h"), "MB", before=small)
        self.assert_quiet("log_space", self.recording(disk, "keep: 1m"), before=small)
        self.assert_found("log_space", self.recording(disk, ""), "in a week", before=small)

    def test_log_file_system(self):
        self.assert_found("log_file_system", self.recording(self.memory_folder(), "quota: 2MB"), "tmpfs")
        self.assert_quiet("log_file_system", self.recording("/var/log/axlecast-test", "quota: 2MB"))

    def test_journal_folder(self):
        config = self.journalling(self.folder / "journal")
        self.assert_quiet("journal_folder", config)
        self.assert_found("journal_folder", config, "may not create it in", before=self.as_nobody())

    def test_journal_space(self):
        disk = self.folder / "disk"
        config = self.journalling(disk)
        self.assert_found("journal_space", config, "1 MB free", before=self.with_small_disk(disk, "1m"))
        self.assert_quiet("journal_space", config, before=self.with_small_disk(disk, "200m"))

    def test_journal_file_system(self):
        self.assert_found("journal_file_system", self.journalling(self.memory_folder()), "tmpfs")
        self.assert_quiet("journal_file_system", self.journalling("/var/lib/axlecast-test"))


class Keys(DoctorMachine):
    def setUp(self):
        super().setUp()
        self.keys = self.folder / "etc"
        code, out, err = self.axlecast("keygen", "--machine", "test", "--directory", self.keys, "--json")
        self.assertEqual(code, 0, err)
        self.keys.chmod(0o755)
        self.config = self.machine(rest=json.loads(out)["yaml"])

    def test_key_missing(self):
        self.assert_quiet("key_missing", self.config)
        (self.keys / "drivers.key").unlink()
        self.assert_found("key_missing", self.config, "drivers.key does not exist")

    def test_key_mode(self):
        self.assert_quiet("key_mode", self.config)
        (self.keys / "bridge.key").chmod(0o604)
        self.assert_found("key_mode", self.config, "bridge.key has mode 0604")
        self.assert_mended("key_mode", self.config)
        self.assertEqual((self.keys / "bridge.key").stat().st_mode & 0o777, 0o600)

    def test_key_mode_of_a_group_that_may_read(self):
        self.need_users()
        os.chown(self.keys / "local.key", 0, 20)
        (self.keys / "local.key").chmod(0o664)
        self.assert_mended("key_mode", self.config)
        self.assertEqual((self.keys / "local.key").stat().st_mode & 0o777, 0o640)

    def test_key_owner(self):
        self.assert_quiet("key_owner", self.config)
        self.need_users()
        os.chown(self.keys / "bridge.key", 65534, 0)
        self.assert_found("key_owner", self.config, "belongs to nobody")
        self.assert_mended("key_owner", self.config)

    def test_key_access(self):
        self.assert_quiet("key_access", self.config, "--root", self.root)
        self.put("etc/group", "axlecast-bridge:x:990:\naxlecast-drivers:x:991:\naxlecast-web:x:992:")
        findings = self.found("key_access", self.config, "--root", self.root)
        self.assertEqual([finding["mend"][0].split()[:2] for finding in findings],
                         [["chgrp", "axlecast-bridge"], ["chgrp", "axlecast-drivers"]], findings)

    def test_group_members(self):
        self.put("etc/group", "axlecast:x:989:anna,bob\naxlecast-drivers:x:991:\ndialout:x:20:carol")
        self.assert_quiet("group_members", self.config, "--root", self.root)
        self.put("etc/group", "axlecast:x:989:anna,bob\naxlecast-drivers:x:991:\ndialout:x:20:carol,bob")
        finding = self.assert_found("group_members", self.config, "bob is in the group dialout", "--root", self.root)
        self.assertIn("gpasswd --delete bob dialout", finding["mend"][0])
        self.put("etc/group", "axlecast-drivers:x:991:anna")
        self.assert_found("group_members", self.config, "anna is in the group axlecast-drivers", "--root", self.root)

    def test_key_permission(self):
        self.assert_quiet("key_permission", self.config)
        self.need_users()
        os.chown(self.keys / "local.key", 0, 20)
        (self.keys / "local.key").chmod(0o640)
        finding = self.assert_found("key_permission", self.config, "the group dialout can read", before=self.as_nobody())
        self.assertIn("usermod -aG dialout USER", finding["mend"][0])

    def test_config_mode(self):
        self.config.chmod(0o644)
        self.assert_quiet("config_mode", self.config)
        self.config.chmod(0o666)
        self.assert_found("config_mode", self.config, "mode 0666")
        self.assert_mended("config_mode", self.config)
        self.assertEqual(self.config.stat().st_mode & 0o777, 0o644)


if __name__ == "__main__":
    unittest.main()
