"""Motors watched by SC units, end to end: live data, trips, commands, login."""

import json
import os
import pathlib
import re
import unittest

from lcm_ear import LcmEar
from machine import BIN, LIMIT, Machine, wait_for

EXAMPLE = pathlib.Path(os.environ["AXLECAST_SOURCE"], "drivers/tsubaki_sc/example.yaml")
DONE, REJECTED, FAILED, NOT_VERIFIED = 0, 3, 4, 7
ONLINE, DEGRADED, OFFLINE = 1, 2, 3
STATUS_VALID, TRIPPED = 0x2, 0x4
NOT_PERMITTED, NO_PERMIT = 18, 14
OVERHEAT, SHOCK = 0x20, 0x40  # SC guideline 10, note 1
PASSWORD, OTHER = "Gm3!right-one", "Gm3~other-one"


class Motor(Machine):
    def run_machine(self, device="motor_control: start_stop, permit: not_required", simulate="", password=PASSWORD):
        """gm1 as `device` configures it, gm2 with the defaults."""
        for name, secret in (("main", password), ("new", OTHER)):
            self.set_password(name, secret)
        names = ", ".join(f"{name}: {{file: {self.folder / name}}}" for name in ("main", "new"))
        self.config = self.write(f"""machine: test
bridge: {{unsigned_commands: allow}}
buses:
  rs485-0:
    family: tsubaki_sc
    pacing: per_unit
    simulate:
      timing: {{reading: W, pace: unpaced}}
      gm1: {{password: "{PASSWORD}", voltage_v: 230, load_w: 150, parameters: "54=5"{simulate}}}
      gm2: {{password: "{PASSWORD}"}}
    devices:
      gm1: {{address: 1, passwords: {{{names}}}, password: main, {device}}}
      gm2: {{address: 2, passwords: {{{names}}}, password: main, permit: not_required}}
""")
        self.data = self.watch(self.config, "--commands")
        self.simulator(self.config, "rs485-0")
        self.running_driver = self.driver(self.config, "rs485-0", family="tsubaki-sc")
        self.bridge(self.config)
        self.wait_online(self.data, "gm1")
        self.wait_online(self.data, "gm2")
        wait_for(lambda: (self.motor() or {}).get("logged_in", -1) >= 0, "a whole reading")

    def set_password(self, name, secret):
        path = self.folder / name
        path.unlink(missing_ok=True)
        path.touch(mode=0o600)
        path.write_text(secret + "\n")

    def motor(self, device="gm1"):
        return self.data.last(f"MOTOR/{device}")

    def unit(self, device="gm1"):
        return self.simulated(self.config, "rs485-0")["devices"][device]

    def set(self, **quantities):
        self.set_simulated(self.config, "rs485-0", "gm1", **quantities)

    def power_off_and_on(self):
        self.set(power="off")
        self.wait_state(self.data, OFFLINE, "gm1")
        self.set(power="on")
        self.wait_state(self.data, ONLINE, "gm1")

    def do(self, device, *words):
        return self.outcome("do", device, *words, "--yes")

    def wait_motor(self, condition, what):
        return wait_for(lambda: (lambda m: m if m and condition(m) else None)(self.motor()),
                        lambda: f"{what}; last {self.motor()}")

    # -- readings

    def test_the_example_runs_and_ends_truthfully(self):
        self.set_password("sc.password", "password")
        text = EXAMPLE.read_text().replace("/etc/axlecast/sc.password", str(self.folder / "sc.password"))
        # A simulator on a busy host may miss the default of 150 ms, which makes its bus DEGRADED.
        text = re.sub(r"^( +)permit: not_required", r"\1permit: not_required\n\1timeout_us: 400000", text, flags=re.MULTILINE)
        text = text.replace("permit: not_required}", "permit: not_required, timeout_us: 400000}")
        self.assertEqual(text.count("timeout_us"), 4)
        # At this pacing a simulator that reads a request some ms late finds the next one too early, and ignores it.
        text = text.replace("    pacing: after_request\n", "")
        config = self.write(text)
        code, out, err = self.axlecast("up", config, "--seconds", "20", "--json", limit=120)
        self.assertEqual(code, 0, out + err)
        summary = json.loads(out)
        self.assertEqual((summary["good"], len(summary["devices"])), (True, 4), out)

    def test_readings_are_those_of_the_motor(self):
        self.run_machine()
        unit = self.unit()
        motor = self.motor()
        self.assertAlmostEqual(motor["voltage_v"], 230, delta=0.5)
        self.assertAlmostEqual(motor["power_w"], 150, delta=1)
        self.assertAlmostEqual(motor["temperature_c"], float(unit["temperature_c"]), delta=1)
        self.assertEqual((motor["mains_hz"], motor["stop_coil"], motor["trip_count"]), (50, 0, 0))
        self.set(load_w=200, temperature_c=-7.5)
        self.wait_motor(lambda m: abs(m["power_w"] - 200) < 1 and abs(m["temperature_c"] + 7.5) < 1, "200 W at -7.5 C")

    def test_the_product_code_reaches_consumers_as_text(self):
        ear = LcmEar()
        self.run_machine(simulate=", product_code: GM7x")
        codes = {"gm1": "GM7x", "gm2": "SC01"}
        for device, code in codes.items():
            wait_for(lambda: (self.data.last(f"DEVICE/{device}") or {}).get("product_code") == code,
                     lambda: f"{device}: {code}; last {self.data.last(f'DEVICE/{device}')}")
            # In the message itself, as LCM sends a string: its length with the final 0, the ASCII characters, 0.
            sent = (len(code) + 1).to_bytes(4, "big") + code.encode("ascii") + b"\0"
            wait_for(lambda: any(channel == f"DEVICE/{device}" and sent in data for channel, data in list(ear.messages)),
                     f"{sent} in DEVICE/{device}")
        done, out, err = self.axlecast("status", self.config, "--json")
        self.assertEqual(done, 0, out + err)
        self.assertEqual({device["device"]: device["product_code"] for device in json.loads(out)["devices"]}, codes)
        done, out, err = self.axlecast("info", self.config, "gm1", "--json")
        self.assertEqual((done, json.loads(out)["device"]["product_code"]), (0, "GM7x"), err)
        done, out, err = self.axlecast("info", self.config, "gm1")
        self.assertRegex(out, r"(?m)^product code +GM7x$", err)
        done, outcome = self.do("gm1", "read_identity")
        self.assertEqual(done, DONE, outcome)
        self.assertIn("product code GM7x,", outcome["text"])

    def test_the_product_code_of_a_unit_that_sends_the_second_character_first(self):
        self.run_machine("endian: low", simulate=", product_code: GM7x, character_order: low_first")
        wait_for(lambda: (self.data.last("DEVICE/gm1") or {}).get("product_code") == "GM7x",
                 lambda: f"GM7x; last {self.data.last('DEVICE/gm1')}")

    def test_a_unit_that_falls_silent_leaves_the_other_alone(self):
        self.run_machine()
        self.set(fault="off")
        self.wait_state(self.data, OFFLINE, "gm1")
        other = self.motor("gm2")["seq"]
        wait_for(lambda: self.motor("gm2")["seq"] > other + 20, "the other unit going on")
        self.assertEqual(self.data.last("DEVICE/gm2")["state"], ONLINE)
        self.set(fault="none")
        self.wait_state(self.data, ONLINE, "gm1")

    # -- trip limits

    def test_info_waits_for_the_trip_limits_and_shows_what_is_left(self):
        self.run_machine()
        code, out, err = self.axlecast("info", self.config, "gm1", "--json")
        self.assertEqual(code, DONE, err)
        self.assertEqual({"limits", "margins"} - set(json.loads(out)), set())
        info = self.start("info", BIN / "axlecast", "info", self.config, "gm1", "--limits")
        self.do("gm1", "write_parameters", "overheat_limit=88.8")  # LIMITS comes when one changes, else once a minute
        self.assertEqual(info.wait(LIMIT + 65), DONE)
        self.assertRegex(self.log("info"), r"overheat above [0-9.]+ degC: now -?[0-9.]+ degC, -?[0-9.]+ degC left\n")

    # -- trips

    def test_a_trip_raises_its_alarm_and_brings_its_log(self):
        self.run_machine()
        self.set(trip="overheat")
        tripped = self.wait_motor(lambda m: m["trip_count"] == 1, "the trip")
        self.assertEqual((tripped["status_bits"], tripped["trip_factor"]), (OVERHEAT, [OVERHEAT, 0, 0]))
        self.assertEqual(tripped["flags"] & TRIPPED, TRIPPED)
        wait_for(lambda: "overheat" in self.alarms(self.data, "gm1"), "the alarm")
        self.assertNotIn("overheat", self.alarms(self.data, "gm2"))
        trip = wait_for(lambda: self.data.last("TRIP/gm1"), "the log")
        self.assertEqual((trip["trip_count"], trip["factor_bits"], trip["log_index"], trip["valid_mask"]),
                         (1, OVERHEAT, 1, 0x7F))
        self.assertEqual(trip["interval_us"], 500_000)
        self.assertAlmostEqual(trip["samples"][0][19], 230, delta=0.5)
        self.assertLessEqual(trip["not_before_utime"], trip["not_after_utime"])

        self.set(reset_trip="now", power="cycle")
        wait_for(lambda: "overheat" not in self.alarms(self.data, "gm1"), "the alarm gone")
        code, outcome = self.do("gm1", "clear_trip_count")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        cleared = self.wait_motor(lambda m: m["trip_count"] == 0, "the count cleared")
        self.assertEqual(cleared["trip_factor"], [OVERHEAT, 0, 0], "factors stay")
        self.assertEqual(self.unit()["trip_count_clears"], 1)
        self.assertEqual(self.unit("gm2")["trip_count_clears"], 0)

        code, outcome = self.do("gm1", "fetch_trip_logs")
        self.assertEqual(code, DONE, outcome)

    def test_a_limit_that_is_passed_trips_by_itself(self):
        self.run_machine(simulate=', dip_set: 1')
        code, outcome = self.do("gm1", "write_parameters", "power_upper_a_1_50hz=180", "shock_time_upper_a_1=0.5")
        self.assertEqual(code, DONE, outcome)
        self.set(load_w=260)
        self.wait_motor(lambda m: m["status_bits"] & 0x01, "the trip by the power limit")
        trip = wait_for(lambda: self.data.last("TRIP/gm1"), "the log")
        self.assertGreater(trip["samples"][2][19], 180)  # power at the trip
        wait_for(lambda: "power_upper_limit_a" in self.alarms(self.data, "gm1"), "the alarm")

    # -- the motor

    def test_stop_and_start(self):
        self.run_machine()
        other = (self.unit("gm2")["stops"], self.unit("gm2")["starts"])
        code, outcome = self.do("gm1", "stop_motor")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        self.assertEqual((self.unit()["motor"], self.unit()["stop_coil"]), ("stopped", 1))
        self.wait_motor(lambda m: m["stop_coil"] == 1, "the stop coil in MOTOR")
        code, outcome = self.do("gm1", "start_motor")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        self.assertEqual((self.unit()["motor"], self.unit()["stop_coil"]), ("running", 0))
        self.assertEqual((self.unit("gm2")["stops"], self.unit("gm2")["starts"]), other)

    def test_the_verbs_of_the_cli(self):
        self.run_machine()
        cli = lambda *words: self.axlecast(*words, "--config", self.config)
        code, out, err = cli("motor", "stop", "gm1")
        self.assertEqual((code, self.unit()["motor"]), (DONE, "stopped"), out + err)
        code, out, err = cli("motor", "start", "gm1", "--yes")
        self.assertEqual((code, self.unit()["motor"]), (DONE, "running"), out + err)

        code, out, err = cli("param", "get", "gm1", "log_interval", "--json")
        self.assertEqual((code, json.loads(out)["parameters"][0]["value"]), (DONE, 0.5), out + err)
        code, out, err = cli("param", "set", "gm1", "log_interval=0.1", "overheat_limit=88.8")
        self.assertEqual(code, 2, "asks first: " + out + err)
        code, out, err = cli("param", "set", "gm1", "log_interval=0.1", "overheat_limit=88.8", "--yes")
        self.assertEqual(code, DONE, out + err)
        self.assertTrue(self.unit()["parameters"].endswith(" 888 5000 1"), self.unit()["parameters"])
        listed = {p["name"]: p["value"] for p in json.loads(cli("param", "list", "gm1", "--json")[1])["parameters"]}
        held = {p["name"]: p["value"] for p in json.loads(cli("param", "get", "gm1", "--json")[1])["parameters"]}
        self.assertEqual((listed["log_interval"], listed["overheat_limit"]), (0.1, 88.8), "present values")
        self.assertEqual(listed, held)
        code, out, err = cli("param", "list", "gm1")
        self.assertRegex(out, r"(?m)^overheat_limit +88\.8\b", err)
        saved = self.folder / "gm1.yaml"
        code, out, err = cli("param", "export", "gm1", "--out", saved)
        self.assertEqual(code, DONE, out + err)
        code, out, err = cli("param", "import", "gm2", saved, "--yes")
        self.assertEqual(code, DONE, out + err)
        self.assertEqual(self.unit("gm2")["parameters"], self.unit("gm1")["parameters"])

        self.set(trip="overheat")
        self.wait_motor(lambda m: m["trip_count"] == 1, "the trip")
        picture = self.folder / "trip.svg"
        code, out, err = cli("trips", "gm1", "--json", "--svg", picture)
        self.assertEqual((code, len(json.loads(out)["trips"])), (DONE, 1), out + err)
        self.assertIn("<svg", picture.read_text())

    def test_param_list_shows_what_the_unit_holds_now(self):
        self.run_machine()

        def listed(*options):
            code, out, err = self.axlecast("param", "list", "gm1", "--config", self.config, *options)
            self.assertEqual(code, DONE, out + err)
            return out, err

        def raw_values():
            out, err = listed("--json")
            parameters = json.loads(out)["parameters"]
            self.assertNotIn(None, [parameter["value"] for parameter in parameters], err)
            return " ".join(str(round(parameter["value"] / parameter["step"])) for parameter in parameters)
        self.assertEqual(raw_values(), self.unit()["parameters"], "every value, in the order of the registers")
        # The unit gets other values without a command of axlecast.
        self.set(parameters="52=777 54=9")
        self.assertEqual(raw_values(), self.unit()["parameters"])
        self.assertTrue(raw_values().endswith(" 777 5000 9"))
        out, _ = listed()
        self.assertRegex(out, r"(?m)^overheat_limit +77\.7 degC +[0-9]")
        self.assertRegex(out, r"(?m)^log_interval +0\.9 s +[0-9]")
        out, err = listed("--no-reads", "--json")
        self.assertEqual({parameter["value"] for parameter in json.loads(out)["parameters"]}, {None})
        self.assertEqual(err, "")
        self.set(power="off")
        self.wait_state(self.data, OFFLINE, "gm1")
        out, err = listed()
        self.assertRegex(out, r"(?m)^log_interval +- +[0-9]")
        self.assertTrue(err.startswith("without the present values: "), err)

    def test_a_tripped_motor_is_not_started(self):
        self.run_machine()
        self.set(trip="excessive_shock")
        self.wait_motor(lambda m: m["status_bits"] == SHOCK, "the trip")
        code, outcome = self.do("gm1", "start_motor")
        self.assertIn(code, (REJECTED, FAILED), outcome)
        self.assertIn("trip", outcome["text"])
        self.assertEqual(self.unit()["motor"], "tripped")

    def denied(self, device, *operations):
        before = (self.unit(device)["stops"], self.unit(device)["starts"])
        for operation in operations:
            code, outcome = self.do(device, operation)
            self.assertEqual((code, outcome["reason_code"]), (REJECTED, NOT_PERMITTED), outcome)
            self.assertIn("motor_control", outcome["text"])
        self.assertEqual((self.unit(device)["stops"], self.unit(device)["starts"]), before)

    def test_without_motor_control_neither_is_done(self):
        self.run_machine()
        self.denied("gm2", "stop_motor", "start_motor")

    def test_motor_control_stop_allows_only_that(self):
        self.run_machine("motor_control: stop, permit: not_required")
        self.denied("gm1", "start_motor")
        code, outcome = self.do("gm1", "stop_motor")
        self.assertEqual(code, DONE, outcome)

    def test_a_start_needs_a_permit_and_a_stop_none(self):
        self.run_machine("motor_control: start_stop")
        code, outcome = self.do("gm1", "stop_motor")
        self.assertEqual(code, DONE, outcome)
        code, outcome = self.do("gm1", "start_motor")
        self.assertEqual((code, outcome["reason_code"]), (REJECTED, NO_PERMIT), outcome)
        self.assertEqual(self.unit()["motor"], "stopped")

    # -- login

    def test_the_unit_of_an_exchange_gets_the_parameters_of_the_old_one(self):
        self.run_machine()
        before = self.unit()["parameters"]
        backup = self.folder / "gm1.txt"
        guide = self.start("replace", BIN / "axlecast", "replace", "gm1", "--yes", "--json", "--backup", backup, "--config",
                           self.config)
        wait_for(lambda: "Exchange gm1 now" in self.log("replace"), lambda: self.log("replace"))
        self.assertIn("log_interval: 0.5", backup.read_text())
        self.set(power="off")
        self.wait_state(self.data, OFFLINE, "gm1")
        self.set(parameters="54=7")
        self.assertNotEqual(self.unit()["parameters"], before)
        self.set(power="on")
        self.assertEqual(guide.wait(LIMIT), DONE, self.log("replace"))
        self.assertEqual(self.unit()["parameters"], before)
        report = json.loads(self.log("replace").splitlines()[-1])
        self.assertEqual((report["accepted"], report["next"], len(report["written"])), (None, None, 1), report)

    def test_parameters_are_written_after_a_login_and_again_after_a_power_off(self):
        self.run_machine("motor_control: none")
        self.assertEqual(self.unit()["logged_in"], 0, "reading needs no login")
        code, outcome = self.do("gm1", "write_parameters", "overheat_limit=77.5", "log_interval=0.2")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        self.assertIn("logged out again", outcome["text"])
        unit = self.unit()
        self.assertEqual((unit["logged_in"], unit["logins"], unit["logouts"]), (0, 1, 1))
        self.assertTrue(self.unit()["parameters"].endswith(" 775 5000 2"), self.unit()["parameters"])
        code, outcome = self.do("gm1", "log_in")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        self.wait_motor(lambda m: m["logged_in"] == 1, "logged in, as MOTOR tells")
        code, outcome = self.do("gm1", "log_out")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        self.assertEqual((self.unit()["logged_in"], self.unit()["logouts"]), (0, 2))

        self.power_off_and_on()
        self.wait_motor(lambda m: m["logged_in"] == 0, "logged out by the power-off")
        code, outcome = self.do("gm1", "write_parameter", "name=overheat_limit", "value=78")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        unit = self.unit()
        self.assertEqual((unit["logins"], unit["logouts"], unit["wrong_passwords"]), (3, 3, 0))
        self.assertIn(" 780 ", unit["parameters"])

    def test_with_motor_control_the_unit_is_kept_logged_in(self):
        self.run_machine()
        self.wait_motor(lambda m: m["logged_in"] == 1, "logged in without a command")
        self.power_off_and_on()
        wait_for(lambda: self.unit()["logins"] == 2, lambda: f"logged in again: {self.unit()}")
        self.assertEqual(self.unit()["logouts"], 0)

    def test_a_wrong_password_is_tried_once(self):
        self.run_machine("motor_control: none", password="not-the-one")
        for _ in range(3):
            code, outcome = self.do("gm1", "write_parameter", "name=log_interval", "value=0.3")
            self.assertIn(code, (REJECTED, FAILED), outcome)  # refused at once when the unit is known to be logged out
            self.assertIn("main", outcome["text"])
            self.assertNotIn("not-the-one", json.dumps(outcome))
        wait_for(lambda: "wrong_password" in self.alarms(self.data, "gm1"), "the alarm")
        self.assertEqual((self.unit()["wrong_passwords"], self.unit()["parameter_writes"]), (1, 0))
        # The file is correct again; only a command tries again.
        self.set_password("main", PASSWORD)
        code, outcome = self.do("gm1", "log_in")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        wait_for(lambda: "wrong_password" not in self.alarms(self.data, "gm1"), "the alarm gone")
        code, outcome = self.do("gm1", "write_parameter", "name=log_interval", "value=0.3")
        self.assertEqual(code, DONE, outcome)
        self.assertEqual(self.unit()["wrong_passwords"], 1)

    def test_a_password_file_that_others_can_read_is_not_used(self):
        self.run_machine("motor_control: none")
        (self.folder / "main").chmod(0o644)
        code, outcome = self.do("gm1", "write_parameter", "name=log_interval", "value=0.3")
        self.assertEqual(code, FAILED, outcome)
        self.assertIn("chmod 600", outcome["text"])
        self.assertEqual(self.unit()["logins"], 0)

    def test_the_password_is_changed_and_used_from_then_on(self):
        self.run_machine("motor_control: none")
        code, outcome = self.do("gm1", "set_password", "name=elsewhere")
        self.assertEqual(code, REJECTED, outcome)
        code, outcome = self.do("gm1", "set_password", "name=new")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        self.assertEqual(self.unit()["password_changes"], 1)
        code, outcome = self.do("gm1", "check_password", "name=new")
        self.assertEqual(code, REJECTED, "it is logged out again: " + str(outcome))
        code, outcome = self.do("gm1", "log_in")
        self.assertEqual(code, DONE, outcome)
        code, outcome = self.do("gm1", "check_password", "name=new")
        self.assertEqual(code, DONE, outcome)
        self.power_off_and_on()
        self.wait_motor(lambda m: m["logged_in"] == 0, "logged out by the power-off")
        code, outcome = self.do("gm1", "write_parameter", "name=log_interval", "value=0.4")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        self.assertEqual(self.unit()["wrong_passwords"], 0)
        # A new driver reads the file, which still names the old one, and reports it.
        self.running_driver.terminate()
        self.running_driver.wait()
        self.set(power="cycle")
        self.driver(self.config, "rs485-0", family="tsubaki-sc", name="driver-again")
        self.wait_motor(lambda m: m["flags"] & STATUS_VALID and m["logged_in"] == 0, "a reading of the new driver")
        code, outcome = wait_for(lambda: (lambda r: r if r[0] != REJECTED else None)(self.do("gm1", "log_in")), "a login")
        self.assertEqual(code, FAILED, outcome)
        wait_for(lambda: "wrong_password" in self.alarms(self.data, "gm1"), "the alarm")


if __name__ == "__main__":
    unittest.main(verbosity=2)
