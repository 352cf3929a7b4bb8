"""`axlecast backup` and `axlecast restore`: an encoder's memory and a monitor's parameters, over real processes."""

import hashlib
import json
import signal
import subprocess
import unittest

from machine import BIN, LIMIT, Machine, one_axis, wait_for

DONE, BAD, USAGE, REJECTED = 0, 1, 2, 3
OLD = '{start_deg: 100, eeprom: "10=A1 05 07"}'
PASSWORD = "Gm3!right-one"


class Backup(Machine):
    def run_axis(self, device="eeprom_writable: [10, 11]", simulate=OLD):
        self.config = self.write(one_axis(simulate, device))
        self.data = self.watch(self.config)
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")
        self.bridge(self.config)
        self.wait_online(self.data)
        self.file = self.folder / "axis1.json"

    def cli(self, *words):
        code, out, err = self.axlecast(*words, "--config", self.config, "--json")
        return code, json.loads(out) if out else err

    def take_backup(self, device="axis1"):
        code, outcome = self.cli("backup", device, "--out", self.file)
        self.assertEqual(code, DONE, outcome)
        return json.loads(self.file.read_text())

    def reseal(self, backup):
        """As a person who edits the file would have to."""
        backup.pop("sha256")
        text = json.dumps(backup, separators=(",", ":"), ensure_ascii=False)
        backup["sha256"] = hashlib.sha256(text.encode()).hexdigest()
        self.file.write_text(json.dumps(backup, indent=1))

    def encoder(self):
        return self.simulated(self.config, "rs485-0")["devices"]["axis1"]

    def test_what_was_changed_is_written_back_and_read_back(self):
        self.run_axis()
        backup = self.take_backup()
        sealed = dict(backup)
        self.reseal(sealed)
        self.assertEqual(sealed["sha256"], backup["sha256"], "the sum is of the compact text of all other members")
        self.assertEqual((backup["machine"], backup["device"], backup["model"]), ("test", "axis1", "ts5669n127"))
        self.assertIn("A1 05 07", backup["memory"]["eeprom_0"])
        self.assertEqual(self.cli("restore", "axis1", self.file, "--yes")[1]["differences"], [])
        self.assertEqual(self.cli("eeprom", "write", "axis1", "10", "FF EE", "--yes")[0], DONE)
        code, report = self.cli("restore", "axis1", self.file, "--dry-run")
        self.assertEqual(code, DONE, report)
        self.assertEqual([(line["what"], line["before"], line["after"], line["outcome"]) for line in report["differences"]],
                         [("eeprom 10-11", "FF EE", "A1 05", "not_written")])
        self.assertIn("FF EE 07", self.encoder()["eeprom"])
        self.assertEqual(self.axlecast("restore", "axis1", self.file, "--config", self.config)[0], USAGE)  # cannot ask
        code, report = self.cli("restore", "axis1", self.file, "--yes")
        self.assertEqual((code, report["reads_back"]), (DONE, True), report)
        self.assertIn("A1 05 07", self.encoder()["eeprom"])
        self.assertTrue(any("datum" in kept for kept in report["not_written_back"]), report)
        writes = self.encoder()["eeprom_writes"]
        self.assertEqual(self.cli("restore", "axis1", self.file, "--yes")[1]["differences"], [])
        self.assertEqual(self.encoder()["eeprom_writes"], writes, "nothing is written twice")

    def test_what_may_not_be_written_is_told_and_left_alone(self):
        self.run_axis()
        backup = self.take_backup()
        backup["memory"] = {"eeprom_10": "B2", "eeprom_12": "99"}
        self.reseal(backup)
        code, report = self.cli("restore", "axis1", self.file, "--yes")
        self.assertEqual((code, report["reads_back"]), (DONE, True), report)
        self.assertEqual([(line["what"], line["outcome"]) for line in report["differences"]],
                         [("eeprom 10", "written"), ("eeprom 12", "impossible")])
        self.assertIn("B2 05 07", self.encoder()["eeprom"])

    def test_a_damaged_file_and_one_of_another_unit_are_refused(self):
        self.run_axis()
        backup = self.take_backup()
        self.assertEqual(self.cli("backup", "axis1", "--out", self.file)[0], BAD, "no backup in the place of another")
        whole = self.file.read_text()
        self.file.write_text(whole.replace("A1 05 07", "A1 05 08"))
        code, error = self.cli("restore", "axis1", self.file, "--yes")
        self.assertEqual(code, BAD)
        self.assertIn("does not match its sha256", error)
        self.file.write_text(whole[:-40])
        self.assertEqual(self.cli("restore", "axis1", self.file, "--yes")[0], BAD)
        self.reseal({**backup, "model": "another"})
        self.assertEqual(self.cli("restore", "axis1", self.file, "--yes")[0], REJECTED)
        self.reseal({**backup, "identity": 18, "memory": {"eeprom_10": "C3"}})
        code, report = self.cli("restore", "axis1", self.file, "--yes")
        self.assertEqual((code, report["differences"]), (REJECTED, []), report)
        self.assertEqual(self.encoder()["eeprom_writes"], 0)
        code, report = self.cli("restore", "axis1", self.file, "--yes", "--to-another-unit")
        self.assertEqual(code, DONE, report)
        self.assertIn("the backup is of identity 18", report["other_unit"])
        self.assertIn("C3 05 07", self.encoder()["eeprom"])

    def test_interrupted_it_is_repeated(self):
        self.run_axis("eeprom_writable: [1, 3, 5, 7, 9, 11, 13, 15, 17, 19]")
        backup = self.take_backup()
        wanted = {f"eeprom_{address}": f"{address + 1:02X}" for address in range(1, 20, 2)}
        self.reseal({**backup, "memory": wanted})
        with open(self.folder / "restore.log", "wb") as log:
            process = subprocess.Popen([BIN / "axlecast", "restore", "axis1", self.file, "--yes", "--json", "--config",
                                        self.config], stdout=subprocess.PIPE, stderr=log, text=True)
        wait_for(lambda: self.encoder()["eeprom_writes"] > 0, "the first write")
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=LIMIT)
        report = json.loads(out)
        done = [line for line in report["differences"] if line["outcome"] == "written"]
        self.assertIn(process.returncode, (REJECTED, DONE), report)
        code, report = self.cli("restore", "axis1", self.file, "--yes")
        self.assertEqual((code, len(report["differences"])), (DONE, len(wanted) - len(done)), report)
        self.assertEqual(self.encoder()["eeprom_writes"], len(wanted), "each once")

    def test_a_monitors_parameters_and_never_its_password(self):
        secret = self.folder / "secret"
        secret.touch(mode=0o600)
        secret.write_text(PASSWORD + "\n")
        self.config = self.write(f"""machine: test
bridge: {{unsigned_commands: allow}}
buses:
  rs485-0:
    family: tsubaki_sc
    pacing: per_unit
    simulate:
      timing: {{reading: W, pace: unpaced}}
      gm1: {{password: "{PASSWORD}", voltage_v: 230, load_w: 150, parameters: "54=5"}}
    devices:
      gm1: {{address: 1, passwords: {{main: {{file: {secret}}}}}, password: main, permit: not_required}}
""")
        self.data = self.watch(self.config)
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0", family="tsubaki-sc")
        self.bridge(self.config)
        self.wait_online(self.data, "gm1")
        self.file = self.folder / "gm1.json"
        backup = self.take_backup("gm1")
        self.assertGreater(len(backup["parameters"]), 10)
        self.assertNotIn(PASSWORD, self.file.read_text())
        before = backup["parameters"]["log_interval"]
        code, outcome = self.cli("param", "set", "gm1", "log_interval=1.0", "--yes")
        self.assertEqual(code, DONE, outcome)
        code, report = self.cli("restore", "gm1", self.file, "--yes")
        self.assertEqual((code, report["reads_back"]), (DONE, True), report)
        self.assertEqual([line["what"] for line in report["differences"]], ["log_interval"])
        code, values = self.cli("param", "get", "gm1", "log_interval")
        self.assertIn(before.rstrip("0").rstrip("."), json.dumps(values))


if __name__ == "__main__":
    unittest.main()
