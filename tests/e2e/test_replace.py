"""`axlecast replace`: a simulated encoder is taken away and another one, with other contents, put in its place."""

import json
import os
import pty
import signal
import subprocess
import unittest

from machine import BIN, LIMIT, Machine, one_axis, wait_for

DONE, USAGE, REJECTED, NO_ANSWER = 0, 2, 3, 6
DEVICE = "eeprom_writable: [10, 11, 12]"
OLD = '{start_deg: 100, eeprom: "10=A1 05 07"}'
NEW = '{start_deg: 200, start_turns: 3, eeprom: "10=A1 77 78"}'


class Replace(Machine):
    def run_machine(self):
        self.config = self.write(one_axis(OLD, DEVICE))
        self.other = self.write(one_axis(NEW, DEVICE), "other.yaml")
        self.data = self.watch(self.config, "--commands")
        self.old = self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")
        self.bridge(self.config)
        self.wait_online(self.data)
        self.backup = self.folder / "axis1.txt"

    def encoder(self):
        return self.simulated(self.config, "rs485-0")["devices"]["axis1"]

    def command(self, *words):
        code, out, err = self.axlecast(*words, "--config", self.config, "--json")
        self.assertTrue(out, err)
        return code, json.loads(out)

    def replacing(self, *words):
        return self.guide(subprocess.DEVNULL, *words)

    def guide(self, stdin, *words):
        with open(self.folder / "replace.log", "ab") as log:
            return subprocess.Popen([BIN / "axlecast", "replace", "axis1", "--config", self.config, "--json",
                                     *map(str, words)], stdout=subprocess.PIPE, stderr=log, text=True, stdin=stdin)

    def finish(self, process):
        out, _ = process.communicate(timeout=LIMIT)
        self.assertTrue(out, self.log("replace"))
        return process.returncode, json.loads(out)

    def take_away(self):
        self.old.terminate()
        self.old.wait(LIMIT)
        self.wait_state(self.data, 3)

    def put_in(self):
        self.simulator(self.other, "rs485-0")

    def datum(self):
        code, out, err = self.axlecast("datum", "show", "axis1", "--config", self.config, "--json")
        self.assertEqual(code, DONE, err)
        return json.loads(out)

    def test_backup_exchange_accept_write_back_and_datum(self):
        self.run_machine()
        code, outcome = self.command("home", "axis1", "--value", 5, "--yes")
        self.assertIn(code, (DONE, 7), outcome)
        code, outcome = self.command("eeprom", "write", "axis1", "12", "08", "--yes")
        self.assertEqual(code, DONE, outcome)
        self.assertEqual(self.datum()["writes"], 1)
        guide = self.replacing("--yes", "--value", 12.5, "--backup", self.backup)
        wait_for(lambda: "Exchange axis1 now" in self.log("replace"), lambda: self.log("replace"))
        self.assertIn("A1 05 08", self.backup.read_text())
        self.take_away()
        self.put_in()
        code, report = self.finish(guide)
        self.assertIn(code, (DONE, 7), report)
        self.assertEqual((report["accepted"]["outcome"], report["stopped_at"], report["next"]), ("succeeded", None, None))
        self.assertEqual([w["outcome"] for w in report["written"]], ["succeeded"])
        self.assertEqual(report["datum"]["outcome"], "succeeded")
        encoder = self.encoder()
        self.assertIn("A1 05 08", encoder["eeprom"])
        self.assertEqual(encoder["eeprom_writes"], 2)
        wait_for(lambda: abs(self.data.last("POSITION/axis1")["value"] - 12.5) < 0.1, "12.5 deg")
        known = self.datum()
        self.assertEqual(known["writes"], 2, "only those of the new one")
        self.assertAlmostEqual(float(known["datum"]["value"].split()[0]), 12.5, places=2)
        # All of it again does nothing twice.
        code, report = self.finish(self.replacing("--yes", "--from", "write", "--backup", self.backup))
        self.assertEqual((code, report["written"]), (DONE, []), report)
        self.assertEqual(self.encoder()["eeprom_writes"], 2)

    def test_an_old_one_that_is_silent_needs_no_backup(self):
        self.run_machine()
        self.take_away()
        guide = self.replacing("--yes")
        wait_for(lambda: "Exchange axis1 now" in self.log("replace"), lambda: self.log("replace"))
        self.put_in()
        code, report = self.finish(guide)
        self.assertEqual(code, DONE, report)
        self.assertIn("does not answer", report["backup_problem"])
        self.assertEqual((report["backup"], report["written"], report["datum"]), (None, [], None))
        self.assertEqual(report["next"], "axlecast home axis1 --value V")
        self.assertEqual(self.encoder()["eeprom_writes"], 0)

    def test_interrupted_it_says_what_holds_and_goes_on_later(self):
        self.run_machine()
        guide = self.replacing("--yes", "--backup", self.backup)
        wait_for(lambda: "Exchange axis1 now" in self.log("replace"), lambda: self.log("replace"))
        guide.send_signal(signal.SIGINT)
        code, report = self.finish(guide)
        self.assertEqual((code, report["stopped_at"], report["accepted"]), (REJECTED, "exchange", None), report)
        self.assertEqual(report["next"], f"axlecast replace axis1 --from exchange --backup {self.backup}")
        self.take_away()
        self.put_in()
        self.wait_online(self.data)
        code, report = self.finish(self.replacing("--yes", "--already-exchanged", "--backup", self.backup))
        self.assertEqual((code, report["accepted"]["outcome"]), (DONE, "succeeded"), report)
        self.assertIn("A1 05 07", self.encoder()["eeprom"])

    def test_cells_that_the_file_does_not_list_are_told_and_left_alone(self):
        self.run_machine()
        self.backup.write_text("eeprom_10: A1\neeprom_40: 01 02\n")
        code, report = self.finish(self.replacing("--yes", "--from", "write", "--backup", self.backup))
        self.assertEqual((code, report["written"], report["not_permitted"]), (DONE, [], [40, 41]), report)
        self.assertEqual(self.encoder()["eeprom_writes"], 0)

    def test_it_asks_each_step_on_a_terminal(self):
        self.run_machine()
        self.backup.write_text("eeprom_10: A2\n")
        main, terminal = pty.openpty()
        self.addCleanup(os.close, main)
        guide = self.guide(terminal, "--already-exchanged", "--backup", self.backup)
        os.close(terminal)
        for asked, answer in ((1, "y"), (2, "n")):
            wait_for(lambda: self.log("replace").count("Do it?") == asked, lambda: self.log("replace"))
            os.write(main, answer.encode() + b"\n")
        for asked, answer in ((1, "x"), (2, "7.5")):
            wait_for(lambda: self.log("replace").count("What does the axis read") == asked, lambda: self.log("replace"))
            os.write(main, answer.encode() + b"\n")
        code, report = self.finish(guide)
        self.assertIn(code, (DONE, 7), report)
        self.assertEqual((report["accepted"]["outcome"], report["written"]), ("succeeded", []))
        wait_for(lambda: abs(self.data.last("POSITION/axis1")["value"] - 7.5) < 0.1, "7.5 deg")
        self.assertEqual(self.encoder()["eeprom_writes"], 0)

    def test_ctrl_c_at_a_question_is_a_no(self):
        self.run_machine()
        main, terminal = pty.openpty()
        self.addCleanup(os.close, main)
        guide = self.guide(terminal, "--already-exchanged")
        os.close(terminal)
        wait_for(lambda: "Do it?" in self.log("replace"), lambda: self.log("replace"))
        guide.send_signal(signal.SIGINT)
        code, report = self.finish(guide)
        self.assertEqual((code, report["stopped_at"], report["accepted"]), (REJECTED, "accept", None), report)
        self.assertEqual(report["next"], "axlecast replace axis1 --from accept")
        self.assertEqual([m for m in self.data.of("COMMAND_STATUS") if m["operation"] == "accept_exchange"], [])

    def test_what_cannot_be_done_is_refused_before_anything(self):
        self.run_machine()
        code, _, err = self.axlecast("replace", "axis1", "--config", self.config)
        self.assertEqual(code, USAGE)
        self.assertIn("--yes", err)
        code, _, err = self.axlecast("replace", "axis2", "--yes", "--config", self.config)
        self.assertEqual(code, USAGE)
        self.assertIn("axis1", err)
        self.backup.write_text("parameters: {}\n")
        code, report = self.finish(self.replacing("--yes", "--already-exchanged", "--backup", self.backup))
        self.assertEqual((code, report["accepted"]), (1, None))
        self.assertIn("line 1", self.log("replace"))
        self.take_away()
        code, report = self.finish(self.replacing("--yes", "--already-exchanged"))
        self.assertEqual((code, report["accepted"]), (NO_ANSWER, None), report)


if __name__ == "__main__":
    unittest.main()
