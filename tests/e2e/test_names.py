"""Names beside numbers: the same in watch, status, info, log cat and the JSON Schema."""

import json
import unittest

import jsonschema

from machine import BIN, LIMIT, Machine, one_axis, wait_for

NAMES = {"position_t": ("unit_name", "flag_names"), "device_info_t": ("state_name", "unit_name", "errors_by_name"),
         "bus_health_t": ("state_name", "errors_by_name")}


class Names(Machine):
    def test_the_same_everywhere(self):
        config = self.write(one_axis())
        schemas = json.loads(self.axlecast("mqtt", "--schema")[1])["$defs"]
        kinds = {"position_t": "position", "device_info_t": "device", "bus_health_t": "bus"}
        data = self.watch(config)
        self.simulator(config, "rs485-0")
        self.driver(config, "rs485-0")
        self.wait_online(data)
        seen = {}
        wait_for(lambda: seen.update({m["type"]: m for m in data.since(0)}) or
                 (set(NAMES) <= set(seen) and seen["bus_health_t"]["state"] == 1), "a message of each type, the bus up")
        for kind, names in NAMES.items():
            for name in names:
                self.assertIn(name, seen[kind])
                # MQTT's schema: of its payloads, which are these messages without `spare`.
                jsonschema.validate(seen[kind][name], schemas[kinds[kind]]["properties"][name])
        self.assertEqual((seen["device_info_t"]["state_name"], seen["position_t"]["unit_name"]), ("ONLINE", "deg"))
        self.assertIn("simulated", seen["position_t"]["flag_names"])
        self.assertEqual(seen["bus_health_t"]["state_name"], "UP")

        status = json.loads(self.axlecast("status", config, "--json")[1])
        self.assertEqual(status["devices"][0]["state_name"], "ONLINE")
        self.assertEqual(status["buses"][0]["state_name"], "UP")
        self.assertEqual(set(status["devices"][0]["errors_by_name"]), set(seen["device_info_t"]["errors_by_name"]))
        info = json.loads(self.axlecast("info", config, "axis1", "--json")[1])
        self.assertIn("valid", info["position"]["flag_names"])

        log = self.folder / "a.lcm"
        recorder = self.start("record", BIN / "axlecast", "record", log, "--config", config)
        wait_for(lambda: log.exists() and log.stat().st_size > 10_000, "some messages in the log")
        recorder.terminate()
        self.assertEqual(recorder.wait(LIMIT), 0, self.log("record"))
        code, out, err = self.axlecast("log", "cat", log, "--channel", "^POSITION/axis1$")
        self.assertEqual(code, 0, err)
        self.assertTrue(out)
        for line in out.splitlines()[:10]:
            found = json.loads(line)
            self.assertEqual((found["unit_name"], "simulated" in found["flag_names"]), ("deg", True))


if __name__ == "__main__":
    unittest.main(verbosity=2)
