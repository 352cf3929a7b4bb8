"""Commands end to end: client, bridge, driver, simulated encoder. Each ends in one outcome that agrees with what the
encoder really did, as it counts itself."""

import json
import os
import subprocess
import unittest

import lcm_log
from machine import BIN, Machine, one_axis, wait_for

DONE, REJECTED, FAILED, INDETERMINATE, NOT_VERIFIABLE = 0, 3, 4, 5, 7
COMMAND_PORT = 7668


class Commands(Machine):
    def run_machine(self, simulate, device=""):
        self.config = self.write(one_axis(simulate, device))
        self.data = self.watch(self.config, "--commands")
        self.simulator(self.config, "rs485-0")
        self.running_driver = self.driver(self.config, "rs485-0")
        self.bridge(self.config)
        self.wait_online(self.data)

    def encoder(self):
        return self.simulated(self.config, "rs485-0")["devices"]["axis1"]

    def set(self, **quantities):
        self.set_simulated(self.config, "rs485-0", **quantities)

    def command(self, *words):
        return self.outcome(*words)

    def in_background(self, *words):
        return subprocess.Popen([BIN / "axlecast", *words, "--config", self.config, "--json"], stdout=subprocess.PIPE,
                                text=True, stdin=subprocess.DEVNULL)

    def finish(self, process):
        out, _ = process.communicate(timeout=60)
        return process.returncode, json.loads(out)

    def position(self):
        return self.data.last("POSITION/axis1")

    # -- each destructive operation, verified

    def test_zero_is_verified_and_starts_a_new_epoch(self):
        self.run_machine("{start_deg: 100}")
        before = wait_for(self.position, "a position")
        code, outcome = self.command("zero", "axis1", "--yes")
        self.assertEqual((code, outcome["verified"], outcome["is_final"]), (DONE, 1, 1), outcome)
        after = wait_for(lambda: (lambda p: p if p["datum_epoch"] > before["datum_epoch"] else None)(self.position()),
                         "a position of the new epoch")
        angle = after["raw_counts"] / 131072 * 360
        self.assertLessEqual(min(angle, 360 - angle), 0.35)
        self.assertEqual(self.encoder()["zeroings"], 1)

    def test_turns_are_reset_and_the_angle_stays(self):
        self.run_machine("{start_turns: 10, start_deg: 100}")
        before = wait_for(self.position, "a position")
        self.assertEqual(before["raw_turns"], 10)
        code, outcome = self.command("reset-turns", "axis1", "--yes")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        after = wait_for(lambda: (lambda p: p if p["raw_turns"] == 0 else None)(self.position()), "turns 0")
        self.assertAlmostEqual(after["raw_counts"], before["raw_counts"], delta=16)
        self.assertEqual(self.encoder()["turn_resets"], 1)

    def test_clearing_errors_does_not_restore_trust_in_the_turns(self):
        self.run_machine("{start_deg: 10}")
        self.set(battery_v=2.4)
        wait_for(lambda: "battery_error" in self.alarms(self.data), "the battery error")
        self.set(battery_v=3.6)
        code, outcome = self.command("clear-errors", "axis1", "--yes")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        wait_for(lambda: "battery_error" not in self.alarms(self.data), "the battery error gone")
        self.assertEqual(self.encoder()["error_clears"], 1)
        self.assertEqual(self.data.last("DEVICE/axis1")["reference_lost"], 1)
        self.assertIn("reference_lost", self.alarms(self.data))
        # The turns are 0 already and nothing is latched: the effect cannot be seen.
        code, outcome = self.command("reset-turns", "axis1", "--yes")
        self.assertEqual((code, outcome["verified"]), (NOT_VERIFIABLE, 0), outcome)
        wait_for(lambda: self.data.last("DEVICE/axis1")["reference_lost"] == 0, "the reference restored")

    def test_a_datum_sets_the_value_without_touching_the_encoder(self):
        self.run_machine("{start_deg: 100}")
        code, outcome = self.command("do", "axis1", "set_datum", "value=12.5", "--yes")
        self.assertIn(code, (0, 7), outcome)
        wait_for(lambda: abs(self.position()["value"] - 12.5) < 0.1, lambda: f"12.5 deg, not {self.position()}")
        self.assertTrue(self.position()["flags"] & 0x8, "REFERENCED")
        encoder = self.encoder()
        self.assertEqual((encoder["zeroings"], encoder["turn_resets"], encoder["eeprom_writes"]), (0, 0, 0))

    def test_eeprom_is_written_read_back_and_backed_up(self):
        self.run_machine("{}", "eeprom_writable: [10, 11, 12]")
        code, outcome = self.command("eeprom", "write", "axis1", "10", "A1 05 FF", "--yes")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        code, outcome = self.command("eeprom", "read", "axis1", "10", "3")
        self.assertEqual(code, DONE, outcome)
        self.assertIn("A105FF", json.dumps(outcome).upper().replace(" ", ""))
        encoder = self.encoder()
        self.assertEqual(encoder["eeprom_writes"], 3)
        self.assertIn("A1 05 FF", encoder["eeprom"])
        backup = self.folder / "backup.txt"
        code, out, err = self.axlecast("eeprom", "backup", "axis1", "--out", backup, "--config", self.config)
        self.assertEqual(code, DONE, out + err)
        self.assertIn("A105FF", backup.read_text().upper().replace(" ", ""))

    def test_eeprom_cells_that_the_file_does_not_list_are_refused(self):
        self.run_machine("{}", "eeprom_writable: [10]")
        code, outcome = self.command("eeprom", "write", "axis1", "20", "55", "--yes")
        self.assertEqual((code, outcome["is_final"]), (REJECTED, 1), outcome)
        self.assertIn("eeprom_writable", outcome["text"])
        self.assertEqual(self.encoder()["eeprom_writes"], 0)

    # -- interlocks

    def test_refused_while_turning(self):
        self.run_machine("{speed_rpm: 30}")
        for operation in ("zero", "reset-turns"):
            code, outcome = self.command(operation, "axis1", "--yes")
            self.assertEqual(code, REJECTED, outcome)
            self.assertRegex(outcome["text"], r"rpm")
        encoder = self.encoder()
        self.assertEqual((encoder["zeroings"], encoder["turn_resets"], encoder["refused_zeroings"]), (0, 0, 0))

    def wait_resets(self, count):
        """A sequence of ten takes 0.4 s: a busy machine does not start a program for each look within it."""
        shown = lambda: self.ask_simulator("rs485-0", {"show": True})["devices"]["axis1"]
        wait_for(lambda: shown()["resets_counted"] >= count, "the sequence under way")

    def stopped_by_turning(self, operation, effects):
        self.run_machine("{start_deg: 100}")
        running = self.in_background(operation, "axis1", "--yes")
        self.wait_resets(2)
        self.ask_simulator("rs485-0", {"set": [["axis1", "speed_rpm", "20"]]})
        code, outcome = self.finish(running)
        self.assertIn(code, (REJECTED, FAILED), outcome)
        self.assertEqual(outcome["verified"], 0)
        self.assertRegex(outcome["text"], "moved|turn")
        self.assertEqual(self.encoder()[effects], 0, "nothing may have been reset")

    def test_turning_that_starts_within_a_zero_stops_it(self):
        self.stopped_by_turning("zero", "zeroings")

    def test_turning_that_starts_within_a_reset_of_turns_stops_it(self):
        self.stopped_by_turning("reset-turns", "turn_resets")

    def test_a_permit_is_required_unless_the_file_says_otherwise(self):
        self.config = self.write(one_axis("{start_deg: 10}").replace("permit: not_required", "permit: required"))
        self.data = self.watch(self.config)
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")
        self.bridge(self.config)
        self.wait_online(self.data)
        code, outcome = self.command("zero", "axis1", "--yes")
        self.assertEqual(code, REJECTED, outcome)
        self.assertIn("permit", outcome["text"])

    def test_unsigned_commands_are_refused_unless_the_file_allows_them(self):
        self.config = self.write(one_axis("{}", bridge=""))
        self.data = self.watch(self.config)
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")
        self.bridge(self.config)
        self.wait_online(self.data)
        code, outcome = self.command("do", "axis1", "read_all")
        self.assertEqual(code, REJECTED, outcome)
        self.assertIn("docs/keys.md", outcome["text"])

    def test_destructive_operations_ask_first(self):
        self.run_machine("{}")
        code, _, err = self.axlecast("zero", "axis1", "--config", self.config)
        self.assertEqual(code, 2)
        self.assertIn("--yes", err)

    # -- ids

    def test_the_same_request_again_does_nothing_twice(self):
        self.run_machine("{}", "eeprom_writable: [10]")
        types = lcm_log.generated_types()
        _, first = self.command("do", "axis1", "read_all")
        body = types.command_body_t()
        body.id = os.urandom(16)
        body.bridge_boot_id = int(first["boot_id"], 16)
        body.issued_mono_ns = first["mono_ns"]
        body.valid_ms = 60000
        body.device, body.operation = "axis1", "eeprom_write"
        body.token = bytes(16)
        body.expect_epoch = -1
        body.arguments = [types.argument_t(), types.argument_t()]
        body.arguments[0].key, body.arguments[0].value = "address", "10"
        body.arguments[1].key, body.arguments[1].value = "data", "5A"
        body.n_arguments = 2

        def send():
            command = types.command_t()
            command.body = body._get_packed_fingerprint() + self.encoded(body)
            command.body_size = len(command.body)
            command.sig = bytes(64)
            lcm_log.publish(COMMAND_PORT, "COMMAND", command._get_packed_fingerprint() + self.encoded(command))

        statuses = lambda: [m for m in self.data.of("COMMAND_STATUS") if m["id"] == body.id.hex()]
        for _ in range(5):
            send()
        wait_for(lambda: any(m["is_final"] for m in statuses()), "the outcome")
        answered = len(statuses())
        for _ in range(5):
            send()
        wait_for(lambda: len(statuses()) > answered, "an answer to the repeated request")
        self.assertEqual({m["state"] for m in statuses() if m["is_final"]}, {4})
        self.assertEqual(self.encoder()["eeprom_writes"], 1)

        body.arguments[1].value = "77"  # the same id with another body
        send()
        wait_for(lambda: any(m["reason_code"] == 4 for m in statuses()), "the other body refused")
        self.assertEqual(self.encoder()["eeprom_writes"], 1)

    @staticmethod
    def encoded(message):
        import io  # noqa: PLC0415
        buffer = io.BytesIO()
        message._encode_one(buffer)
        return buffer.getvalue()

    # -- a driver that dies

    def test_a_driver_killed_in_the_middle_is_indeterminate_and_then_what_was_found(self):
        self.run_machine("{start_deg: 100}")
        running = self.in_background("zero", "axis1", "--yes")
        self.wait_resets(3)
        self.kill(self.running_driver)
        self.driver(self.config, "rs485-0", name="driver-again")
        code, outcome = self.finish(running)
        self.assertEqual((code, outcome["state"]), (INDETERMINATE, 9), outcome)
        found = wait_for(lambda: next((m for m in self.data.of("COMMAND_STATUS")
                                       if m["id"] == outcome["id"] and m["finding"] != 0), None), "the finding")
        self.assertEqual(found["finding"], 2, found)  # no effect seen
        self.assertEqual((found["state"], found["is_final"]), (9, 1))
        encoder = self.encoder()
        self.assertEqual(encoder["zeroings"], 0)
        # The new driver's first request broke the dead one's count: one more request completes nothing.
        self.assertEqual(encoder["resets_counted"], 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
