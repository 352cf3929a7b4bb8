"""MCAP, read by MCAP's own library (npm @mcap/core), its JSON checked against its schemas by python3-jsonschema."""

import json
import math
import os
import unittest

import jsonschema
from example_log import START, Converted, peer


class Mcap(Converted):
    def read(self, *options):
        reader = os.environ["MCAP_READER"] + "/read.mjs"
        return json.loads(peer("node", reader, self.convert("mcap", *options)))

    def test_every_message_with_its_type_and_times(self):
        for i in range(300):
            self.log.position("axis1", START + 1_000 * i, i, 100 * i, speed=math.nan if i % 2 else 0.5)
        motor = self.log.message("motor_health_t", START + 7, 0, voltage_v=200.25, current_a=math.nan, trip_factor=[1, 0, 0])
        self.log.add(START + 50, "MOTOR/gm1", motor)
        self.log.add(START + 60, "CAMERA", b"\0\1raw")
        self.log.add(START + 70, "POSITION/axis1", self.log.events[0][2][:-1])  # cut
        self.log.add(START + 5, "AXLECAST/machine.yaml", b"machine: press3\n")
        self.log.add(START + 80, "AXLECAST/seal", bytes(20))
        found = self.read()

        self.assertEqual(found["header"]["library"], "axlecast")
        self.assertEqual(sorted(s["name"] for s in found["schemas"]), ["axlecast.motor_health_t", "axlecast.position_t"])
        channels = sorted((c["topic"], c["messageEncoding"], c["schemaId"] != 0) for c in found["channels"])
        self.assertEqual(channels, [("CAMERA", "lcm", False), ("MOTOR/gm1", "json", True), ("POSITION/axis1", "json", True),
                                    ("POSITION/axis1", "lcm", False)])
        self.assertEqual([(a["name"], a["mediaType"], a["data"]) for a in found["attachments"]],
                         [("AXLECAST/machine.yaml", "application/yaml", "machine: press3\n")])

        sent = [event for event in self.log.events if not event[1].startswith("AXLECAST/")]
        self.assertEqual(len(found["messages"]), len(sent))
        schemas = {s["id"]: json.loads(s["data"]) for s in found["schemas"]}
        for (utime, channel, data), message in zip(sent, found["messages"], strict=True):
            self.assertEqual((message["topic"], int(message["logTime"])), (channel, 1_000 * utime))
            content = bytes.fromhex(message["hex"])
            if message["encoding"] == "lcm":
                self.assertEqual(content, data)
                continue
            content = json.loads(content)
            jsonschema.validate(content, schemas[message["schemaId"]])
            if channel == "MOTOR/gm1":
                self.assertEqual((content["voltage_v"], content["current_a"]), (200.25, None))
                continue
            position = self.log.types.position_t.decode(data)
            self.assertEqual((content["counts"], content["value"]), (position.counts, position.value))
            self.assertEqual((int(message["publishTime"]), message["sequence"]), (1_000 * position.utime, position.seq))

        statistics = found["statistics"]
        self.assertEqual(int(statistics["messageCount"]), len(sent))
        self.assertEqual((statistics["schemaCount"], statistics["channelCount"], statistics["attachmentCount"]), (2, 4, 1))
        self.assertEqual(int(statistics["messageStartTime"]), 1_000 * min(e[0] for e in sent))
        self.assertEqual(int(statistics["messageEndTime"]), 1_000 * max(e[0] for e in sent))
        self.assertEqual(sum(map(int, statistics["channelMessageCounts"].values())), len(sent))
        self.assertEqual(statistics["chunkCount"], found["chunks"])

    def test_many_chunks(self):
        for i in range(6_000):
            self.log.position("axis1", START + 1_000 * i, i, i)
        found = self.read()
        self.assertGreater(found["chunks"], 1)
        self.assertEqual([json.loads(bytes.fromhex(m["hex"]))["counts"] for m in found["messages"]], list(range(6_000)))
        self.assertEqual(found["byIndex"], 6_000)

    def test_the_schema_of_every_type_is_one(self):
        filled = {"id": bytes(16), "token": bytes(16), "sig": bytes(64), "body": b"", "order": b"", "permit": b""}
        for kind in (name for name in dir(self.log.types) if name.endswith("_t")):
            slots = getattr(self.log.types, kind).__slots__
            if "utime" in slots:
                given = {name: content for name, content in filled.items() if name in slots}
                self.log.add(START, f"ANY/{kind}", self.log.message(kind, START, 0, **given))
        found = self.read()
        self.assertEqual(len(found["messages"]), len(self.log.events))
        schemas = {s["id"]: json.loads(s["data"]) for s in found["schemas"]}
        self.assertEqual(len(schemas), len(self.log.events))
        for schema in schemas.values():
            jsonschema.Draft202012Validator.check_schema(schema)
        for message in found["messages"]:
            self.assertEqual(message["encoding"], "json", message["topic"])
            jsonschema.validate(json.loads(bytes.fromhex(message["hex"])), schemas[message["schemaId"]])
        position = next(s for s in schemas.values() if s["title"] == "position_t")
        self.assertIn("sampling instant", position["properties"]["utime"]["description"])

    def test_an_empty_selection_is_a_whole_file(self):
        self.log.position("axis1", START, 0, 1)
        found = self.read("--channel", "nothing")
        self.assertEqual((found["messages"], found["statistics"]["messageCount"]), ([], "0"))


if __name__ == "__main__":
    unittest.main()
