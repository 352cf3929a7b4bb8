"""Names beside numbers: the same in watch, status, info, log cat and the JSON Schemas; and in the frames of axlecast web."""

import json
import os
import pathlib
import re
import unittest

import jsonschema

from machine import BIN, LIMIT, Machine, one_axis, wait_for
from web_client import WebSocket

WEB_SCHEMA = pathlib.Path(os.environ["AXLECAST_SOURCE"], "docs/web_protocol.schema.json")
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
        wait_for(lambda: log.exists() and log.stat().st_size > 100_000, "some messages in the log")
        recorder.terminate()
        self.assertEqual(recorder.wait(LIMIT), 0, self.log("record"))
        code, out, err = self.axlecast("log", "cat", log, "--channel", "^POSITION/axis1$")
        self.assertEqual(code, 0, err)
        self.assertTrue(out)
        for line in out.splitlines()[:10]:
            found = json.loads(line)
            self.assertEqual((found["unit_name"], "simulated" in found["flag_names"]), ("deg", True))

    def test_the_frames_of_the_web_are_as_their_schema_describes(self):
        """Every frame of a machine on which something happens: readings, alarms, a trip, a command, a recorder, an error."""
        config = self.write(one_axis() + "  motors:\n    family: tsubaki_sc\n    pacing: per_unit\n"
                            "    simulate: {timing: {reading: W, pace: unpaced}}\n"
                            "    devices: {gm1: {address: 1, permit: not_required}}\n")
        schema = jsonschema.Draft202012Validator(json.loads(WEB_SCHEMA.read_text()))
        data = self.watch(config)
        self.start("web", BIN / "axlecast", "web", config, "--port", "0")
        self.start("up", BIN / "axlecast", "up", config, "--no-table")
        port = int(wait_for(lambda: re.search(r"^http://\S+:(\d+)/$", self.log("web"), re.MULTILINE), "the address")[1])
        self.start("record", BIN / "axlecast", "record", self.folder / "a.lcm", "--config", config)
        for device in ("axis1", "gm1"):
            self.wait_online(data, device)
        wait_for(lambda: data.last("LIMITS/gm1"), "the limits")
        socket = WebSocket(port)
        self.addCleanup(socket.close)
        socket.ask(type="subscribe", devices=["axis1", "gm1"], history_s=10)
        socket.ask(type="nonsense")
        self.set_simulated(config, "motors", "gm1", trip="overheat")
        self.axlecast("motor", "stop", "gm1", "--config", config)
        left = {"hello", "state", "alarms", "samples", "trip", "command", "error"}
        parts = {"position", "motor", "limits", "recorder", "flags"}

        def have_all(frame):
            problem = jsonschema.exceptions.best_match(schema.iter_errors(frame))
            self.assertIsNone(problem, f"{problem} in {frame}")
            left.discard(frame["type"])
            if frame["type"] == "state":
                readings = {device["device"]: device["reading"] or {} for device in frame["devices"]}
                found = {"position": readings["axis1"].get("valid"), "motor": "overheat" in readings["gm1"].get("status_names", []),
                         "flags": "simulated" in readings["axis1"].get("flags", []),
                         "limits": any(device.get("limits") for device in frame["devices"]), "recorder": frame["recorders"]}
                parts.difference_update(part for part, is_there in found.items() if is_there)
            return not left and not parts
        socket.until(have_all)
        again = WebSocket(port)
        self.addCleanup(again.close)
        left |= {"trend", "trip"}  # what a server sends of the past
        again.until(have_all)

    def test_the_names_in_the_webs_schema_are_those_of_the_messages(self):
        mine = json.loads(WEB_SCHEMA.read_text())["$defs"]
        theirs = {kind: of["properties"] for kind, of in json.loads(self.axlecast("mqtt", "--schema")[1])["$defs"].items()}
        alarm = theirs["alarm"]["entries"]["items"]["properties"]
        known = lambda schema: [name for name in schema["enum"] if name is not None]
        for name, schema in (("unit", theirs["position"]["unit_name"]), ("device_state", theirs["device"]["state_name"]),
                             ("bus_state", theirs["bus"]["state_name"]), ("command_state", theirs["command"]["state_name"]),
                             ("severity", alarm["severity_name"]), ("alarm_state", alarm["state_name"]),
                             ("alarm_source", alarm["source_name"])):
            self.assertEqual(known(mine[name]), known(schema), name)
        self.assertEqual(known(mine["recorder_state"]), [*known(theirs["recorder"]["state_name"]), "ENDED", "?"])
        for name, schema in (("position_flags", theirs["position"]["flag_names"]), ("motor_flags", theirs["motor"]["flag_names"]),
                             ("motor_status", theirs["motor"]["status_names"])):
            self.assertEqual(known(mine[name]["items"]["anyOf"][0]), known(schema["items"]["anyOf"][0]), name)
        self.assertEqual(list(mine["errors"]["properties"]), list(theirs["device"]["errors_by_name"]["properties"]))


if __name__ == "__main__":
    unittest.main(verbosity=2)
