"""Signed commands through real processes: keygen, roles, permits, two steps, restarts."""

import json
import os
import subprocess
import unittest

from machine import BIN, LIMIT, Machine, one_axis, wait_for

DONE, BAD, REJECTED, NO_ANSWER, UNVERIFIED = 0, 1, 3, 6, 7


class Keys(Machine):
    def make_keys(self, **roles):
        """The machine's keys and one for each role; the file's block below `bridge:`."""
        os.environ.pop("AXLECAST_KEY", None)
        code, out, err = self.axlecast("keygen", "--machine", "test", "--directory", self.folder / "keys", "--json")
        self.assertEqual(code, DONE, err)
        self.block = json.loads(out)["yaml"]
        for name, role in roles.items():
            file = self.key(name)
            code, out, err = self.axlecast("keygen", file, "--role", role, "--json")
            self.assertEqual(code, DONE, err)
            self.block += f"    {name}: {{public: {json.loads(out)['keys'][0]['public']}, role: {role}}}\n"

    def key(self, name):
        return self.folder / f"{name}.key"

    def run_machine(self, permit="not_required", **roles):
        self.make_keys(**roles)
        self.permit = permit
        self.write_machine()
        self.data = self.watch(self.config, "--commands")
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")
        self.serving = self.bridge(self.config)
        self.wait_online(self.data)

    def write_machine(self):
        text = one_axis("{start_deg: 100}", "eeprom_writable: [10, 11]", bridge=self.block)
        self.config = self.write(text.replace("permit: not_required", f"permit: {self.permit}"))
        without = [line.split(", file:")[0] + "}" if "    local:" in line else line for line in self.block.splitlines()]
        self.elsewhere = self.write(text.replace(self.block, "\n".join(without) + "\n"), "elsewhere.yaml")

    def encoder(self):
        return self.simulated(self.config, "rs485-0")["devices"]["axis1"]

    def command(self, *words, key=None, config=None):
        """Exit code and outcome, with local's key by default."""
        code, out, err = self.axlecast(*words, "--config", config or self.config, "--json",
                                       *(["--key", self.key(key)] if key else []))
        self.assertTrue(out, err)
        return code, json.loads(out)

    def refused(self, reason, *words, **options):
        code, outcome = self.command(*words, **options)
        self.assertEqual((code, outcome["outcome"], outcome["reason"]), (REJECTED, "rejected", reason), outcome)
        return outcome["text"]

    def done(self, *words, **options):
        code, outcome = self.command(*words, **options)
        self.assertIn(code, (DONE, UNVERIFIED), outcome)
        return outcome

    def restart_bridge(self):
        self.kill(self.serving)
        self.serving = self.bridge(self.config)

    # -- who may command

    def test_what_keygen_makes_runs_signed(self):
        self.run_machine()
        outcome = self.done("zero", "axis1", "--yes")
        self.assertEqual(self.encoder()["zeroings"], 1)
        self.assertNotEqual(outcome["sig"], "00" * 64)
        code, out, err = self.axlecast("check-config", self.config)
        self.assertEqual(code, DONE, err)
        code, out, err = self.axlecast("history", outcome["id"], "--config", self.config, "--json")
        self.assertEqual(json.loads(out.splitlines()[0])["who"], "local", out + err)
        code, out, err = self.axlecast("status", self.config, "--json")
        status = json.loads(out)
        self.assertEqual((status["warnings"], status["bridge"]), ([], {"serves": True, "alarms": []}))
        self.kill(self.serving)
        code, out, err = self.axlecast("status", self.config)
        self.assertEqual(code, DONE, out + err)
        self.assertRegex(out, "bridge +SILENT")

    def test_without_a_key_it_is_refused_as_unsigned(self):
        self.run_machine()
        text = self.refused("unsigned", "do", "axis1", "read_all", config=self.elsewhere)
        self.assertIn("--key", text)
        self.refused("unsigned", "zero", "axis1", "--yes", config=self.elsewhere)
        self.assertEqual(self.encoder()["zeroings"], 0)

    def test_a_key_that_is_not_in_the_file_is_refused(self):
        self.run_machine()
        code, _, err = self.axlecast("keygen", self.key("mallory"), "--role", "maintainer")
        self.assertEqual(code, DONE, err)
        self.refused("bad_signature", "zero", "axis1", "--yes", key="mallory")
        self.assertEqual(self.encoder()["zeroings"], 0)

    def test_each_role_may_what_it_may_and_no_more(self):
        self.run_machine(looker="observer", anna="operator", plc="control", chief="maintainer")
        reads = ("eeprom", "read", "axis1", "0", "2")
        harmless = ("home", "axis1", "--value", "5", "--yes")
        destructive = ("eeprom", "write", "axis1", "10", "5A", "--yes")
        for key, allowed in (("looker", 1), ("anna", 2), ("plc", 2), ("chief", 3)):
            for number, words in enumerate((reads, harmless, destructive), 1):
                with self.subTest(key=key, operation=words[0]):
                    if number <= allowed:
                        self.done(*words, key=key)
                    else:
                        self.assertIn(key, self.refused("denied", *words, key=key))
        self.assertEqual(self.encoder()["eeprom_writes"], 1)

    def test_a_key_taken_out_of_the_file_is_refused_after_a_restart(self):
        self.run_machine(anna="operator")
        self.done("do", "axis1", "read_all", key="anna")
        self.block = "".join(line + "\n" for line in self.block.splitlines() if "    anna:" not in line)
        self.write_machine()
        self.restart_bridge()
        self.refused("bad_signature", "do", "axis1", "read_all", key="anna")
        self.done("do", "axis1", "read_all")

    # -- permits

    def test_a_permit_of_a_control_key_lets_a_zero_through(self):
        self.run_machine(permit="required", plc="control")
        self.assertIn("permit", self.refused("no_permit", "zero", "axis1", "--yes"))
        code, _, err = self.axlecast("permit", "axis1", "zero_single_turn", "--for", "1s", "--config", self.config, "--key",
                                     self.folder / "keys" / "local.key")
        self.assertEqual(code, BAD)
        self.assertIn("role maintainer", err)
        permits = self.start("permit", BIN / "axlecast", "permit", "axis1", "zero_single_turn", "--for", "60s", "--config",
                             self.config, "--key", self.key("plc"))
        wait_for(lambda: self.data.last("PERMIT/axis1"), "a permit")
        self.done("zero", "axis1", "--yes")
        permits.terminate()
        self.assertEqual(permits.wait(LIMIT), 0)
        self.assertRegex(self.refused("no_permit", "zero", "axis1", "--yes"), r"\d")
        self.assertEqual(self.encoder()["zeroings"], 1)

    # -- two steps

    def test_a_token_works_once_and_for_what_was_prepared(self):
        self.run_machine(chief="maintainer")
        words = ("eeprom", "write", "axis1", "10", "5A")
        code, shown = self.command(*words, "--prepare")
        self.assertEqual((code, shown["outcome"]), (DONE, "prepared"), shown)
        self.assertTrue(shown["text"] or shown["changes"], shown)
        self.assertEqual(self.encoder()["eeprom_writes"], 0)
        self.done(*words, "--commit", shown["token"])
        self.refused("token", *words, "--commit", shown["token"])
        self.assertEqual(self.encoder()["eeprom_writes"], 1)
        for other, key in ((("eeprom", "write", "axis1", "10", "77"), None), (("eeprom", "write", "axis1", "11", "5A"), None),
                           (("zero", "axis1"), None), (words, "chief")):
            _, shown = self.command(*words, "--prepare")
            self.refused("token", *other, "--commit", shown["token"], key=key)
        encoder = self.encoder()
        self.assertEqual((encoder["eeprom_writes"], encoder["zeroings"]), (1, 0))
        self.set_simulated(self.config, "rs485-0", speed_rpm=30)
        wait_for(lambda: (self.data.last("POSITION/axis1")["speed_rad_s"] or 0) > 1, "turning")
        self.assertIn("rpm", self.refused("not_standing_still", "zero", "axis1", "--prepare"))

    # -- restarts

    def test_outcomes_are_known_after_the_bridge_was_killed(self):
        self.run_machine()
        outcome = self.done("zero", "axis1", "--yes", "--reason", "shift change")
        self.restart_bridge()
        code, again = self.command("outcome", outcome["id"], config=self.elsewhere)
        self.assertEqual((code, again["outcome"], again["finished_utime"]),
                         (DONE, "succeeded", outcome["finished_utime"]), again)
        code, out, err = self.axlecast("history", outcome["id"], "--config", self.config, "--json")
        row = json.loads(out.splitlines()[0])
        self.assertEqual((code, row["outcome"], row["client_reason"]), (DONE, "succeeded", "shift change"), err)
        code, again = self.command("outcome", "ab" * 16)
        self.assertEqual((code, again["outcome"]), (NO_ANSWER, "unknown"), again)
        self.assertIn("does not know this id", again["problem"])

    def test_a_client_that_waits_gets_the_outcome_of_a_restarted_bridge(self):
        self.run_machine()
        running = subprocess.Popen([BIN / "axlecast", "zero", "axis1", "--yes", "--json", "--config", self.config],
                                   stdout=subprocess.PIPE, text=True, stdin=subprocess.DEVNULL)
        wait_for(lambda: self.encoder()["resets_counted"] >= 2, "the sequence under way")
        self.restart_bridge()
        out, _ = running.communicate(timeout=2 * LIMIT)
        outcome = json.loads(out)
        self.assertEqual((running.returncode, outcome["outcome"], outcome["verified"]), (DONE, "succeeded", 1), outcome)
        self.assertEqual(self.encoder()["zeroings"], 1)
        code, again = self.command("outcome", outcome["id"])
        self.assertEqual((code, again["outcome"]), (DONE, "succeeded"), again)


if __name__ == "__main__":
    unittest.main()
