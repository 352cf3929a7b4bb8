"""Alarms acknowledged and shelved by signed commands: who, when and why outlive the bridge and the driver."""

import json
import unittest

from machine import wait_for
from signed_machine import SignedMachine

DONE, USAGE, REJECTED = 0, 2, 3
LIVE, UNACKNOWLEDGED, SHELVED = 0, 3, 4
ONLINE = 1
BATTERY = "battery_alarm"


class Alarms(SignedMachine):
    def run_machine(self):
        self.config = self.write(f"""machine: test
{self.make_keys()}
buses:
  rs485-0:
    family: tformat
    poll_hz: 200
    simulate:
      axis1: {{start_deg: 100}}
    devices:
      axis1: {{model: ts5669n127, unit: deg, publish_hz: 100, timeout_us: 500000, acknowledge: warning}}
""")
        self.data = self.watch(self.config, "--commands")
        self.simulator(self.config, "rs485-0")
        self.running_driver = self.driver(self.config, "rs485-0")
        self.running_bridge = self.bridge(self.config)
        self.wait_online(self.data)
        wait_for(lambda: "serving commands" in self.log("bridge"), lambda: self.log("bridge"))

    def battery(self, volts):
        self.set_simulated(self.config, "rs485-0", battery_v=volts)

    def raise_battery(self):
        self.battery(3.0)
        self.wait_battery(LIVE)

    def wait_battery(self, state):
        return wait_for(lambda: (self.alarms(self.data).get(BATTERY) or {}).get("state") == state,
                        lambda: f"{BATTERY} in state {state}: {self.alarms(self.data)}")

    def wait_no_battery(self):
        wait_for(lambda: BATTERY not in self.alarms(self.data), lambda: f"no {BATTERY}: {self.alarms(self.data)}")

    def cli(self, *words, key="local"):
        code, out, err = self.axlecast(*words, "--config", self.config, "--key", self.keys / f"{key}.key", "--json")
        self.assertTrue(out, err)
        return code, json.loads(out)

    def listed(self):
        code, out, err = self.axlecast("alarms", self.config, "--json")
        self.assertEqual(code, DONE, err)
        return json.loads(out)

    def listed_battery(self):
        return next((alarm for alarm in self.listed()["alarms"] if alarm["name"] == BATTERY), None)

    def restart_driver(self):
        boot = self.data.last("ALARM/axis1")["boot_id"]
        self.kill(self.running_driver)
        self.running_driver = self.driver(self.config, "rs485-0")
        wait_for(lambda: self.data.last("ALARM/axis1")["boot_id"] != boot, "ALARM of the new driver")

    def restart_bridge(self):
        self.kill(self.running_bridge)
        served = self.log("bridge").count("serving commands")
        self.running_bridge = self.bridge(self.config)
        wait_for(lambda: self.log("bridge").count("serving commands") > served, lambda: self.log("bridge"))

    def test_acknowledging_is_told_with_who_when_and_why_and_outlives_driver_and_bridge(self):
        self.run_machine()
        self.raise_battery()
        self.assertIsNone(self.listed_battery()["acknowledged"])
        code, outcome = self.cli("ack", "axis1", "--reason", "battery ordered")
        self.assertEqual(code, DONE, outcome)
        self.assertEqual([entry["alarm"] for entry in outcome["acknowledged"]], [BATTERY])
        self.wait_battery(LIVE)  # acknowledging clears nothing
        mark = self.listed_battery()["acknowledged"]
        self.assertEqual((mark["who"], mark["reason"]), ("local", "battery ordered"))
        self.restart_bridge()
        self.restart_driver()
        self.wait_battery(LIVE)
        self.assertEqual(self.listed_battery()["acknowledged"], mark)
        # Given back: when it goes now it needs nobody, and the mark ends with it.
        restored = lambda: any(status["operation"] == "restore_acknowledgement" and status["state"] == 4
                               for status in self.data.of("DRIVER_STATUS/rs485-0"))
        wait_for(restored, "the acknowledgement given back")
        self.battery(3.6)
        self.wait_no_battery()
        self.battery(3.0)
        self.wait_battery(LIVE)
        wait_for(lambda: self.listed_battery()["acknowledged"] is None, "the next one is a new one")

    def test_what_goes_unacknowledged_stays_until_somebody_has_seen_it(self):
        self.run_machine()
        self.raise_battery()
        self.battery(3.6)
        self.wait_battery(UNACKNOWLEDGED)
        self.assertEqual(self.data.last("DEVICE/axis1")["state"], ONLINE)
        code, out, err = self.axlecast("alarms", self.config)
        self.assertEqual(code, DONE, err)
        self.assertIn("unacknowledged", out)
        self.assertEqual(self.cli("ack", "axis1", BATTERY)[0], DONE)
        self.wait_no_battery()
        code, outcome = self.cli("ack", "axis1", BATTERY)
        self.assertEqual(code, REJECTED)
        self.assertIn("is not listed", outcome["acknowledged"][0]["text"])
        self.assertEqual(self.cli("ack", "axis1")[1]["acknowledged"], [])

    def test_a_shelf_is_kept_over_restarts_and_ends_by_itself(self):
        self.run_machine()
        self.raise_battery()
        code, outcome = self.cli("shelve", "axis1", BATTERY, "--for", "8h", "--reason", "maintenance at two")
        self.assertEqual(code, DONE, outcome)
        self.wait_battery(SHELVED)
        shelf = self.listed_battery()["shelved"]
        self.assertEqual((shelf["who"], shelf["reason"], shelf["up_to"]), ("local", "maintenance at two", "warning"))
        self.restart_driver()
        self.restart_bridge()
        self.wait_battery(SHELVED)
        self.assertEqual(self.listed_battery()["shelved"], shelf)
        self.assertEqual(self.cli("unshelve", "axis1", BATTERY)[0], DONE)
        self.wait_battery(LIVE)
        self.assertIsNone(self.listed_battery()["shelved"])
        self.assertEqual(self.cli("shelve", "axis1", BATTERY, "--for", "2s", "--reason", "short")[0], DONE)
        self.wait_battery(SHELVED)
        self.wait_battery(LIVE)
        wait_for(lambda: self.listed()["idle_shelves"] == [] and self.listed_battery()["shelved"] is None, "no shelf")
        history = self.axlecast("history", "--config", self.config, "--json")[1]
        self.assertIn("maintenance at two", history)

    def test_only_who_may_and_only_what_is_bounded(self):
        self.run_machine()
        self.raise_battery()
        code, out, err = self.axlecast("keygen", self.keys / "eye.key", "--role", "observer", "--json")
        self.assertEqual(code, DONE, err)
        public = json.loads(out)["keys"][0]["public"]
        text = self.config.read_text().replace("    plc: {", f"    eye: {{public: {public}, role: observer}}\n    plc: {{")
        self.config.write_text(text)
        self.restart_bridge()
        code, outcome = self.cli("ack", "axis1", BATTERY, key="eye")
        self.assertEqual((code, outcome["acknowledged"][0]["reason"]), (REJECTED, "denied"))
        for wrong in (("shelve", "axis1", BATTERY, "--for", "25h", "--reason", "x"),
                      ("shelve", "axis1", BATTERY, "--reason", "x"),
                      ("shelve", "axis1", BATTERY, "--for", "1h"),
                      ("ack", "axis9")):
            self.assertEqual(self.axlecast(*wrong, "--config", self.config)[0], USAGE, wrong)
        self.wait_battery(LIVE)


if __name__ == "__main__":
    unittest.main()
