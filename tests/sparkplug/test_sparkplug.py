"""axlecast mqtt as an edge node of Sparkplug B: Debian's mosquitto as the broker, and sparkplug-payload from npm as the
reader and writer of payloads."""

import json
import os
import pathlib
import struct
import subprocess
import threading
import time
import unittest

from lcm_log import whole_records
from machine import BIN, one_axis, wait_for
from mqtt_broker import PORT, RELAY_PORT, MqttMachine

READER = pathlib.Path(os.environ["SPARKPLUG_READER"]) / "read.mjs"
AWAY = float(os.environ.get("AXLECAST_SPARKPLUG_AWAY", 10))  # s that the broker is away
SLACK = 5000  # ms from a reading to its publication, on a busy machine
DONE, FAILED = 0, 4
NODE = "spBv1.0/plant/{}/test"
DEVICE = "spBv1.0/plant/{}/test/axis1"
DEMO = pathlib.Path(os.environ["AXLECAST_SOURCE"]) / "config/demo.yaml"


def by_reader(lines):
    """The lines of the public reader for these lines."""
    done = subprocess.run(["node", READER], input="\n".join(lines) + "\n", capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def decoded(hexadecimal):
    return [json.loads(line) for line in by_reader([f"decode {text}" for text in hexadecimal])]


class Host:
    """What a host application receives: topic, QoS, retained flag and payload in order, by mosquitto_sub."""

    def __init__(self, port=PORT):
        self.messages = []
        self.process = subprocess.Popen(["mosquitto_sub", "-p", str(port), "-q", "1", "-t", "spBv1.0/#", "-t", "ready",
                                         "-F", "%t %q %r %x"], stdout=subprocess.PIPE, text=True)
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()
        self.known = {}
        def ready():
            subprocess.run(["mosquitto_pub", "-p", str(port), "-t", "ready", "-m", "1"], check=True)
            return self.messages
        wait_for(ready, "the subscription")

    def _read(self):
        for line in self.process.stdout:
            if line.endswith("\n"):
                self.messages.append(tuple(line[:-1].split(" ", 3)))

    def topics(self):
        return [message[0] for message in self.messages]

    def payloads(self):
        """(topic, QoS, payload) of every message of a node."""
        messages = [m for m in self.messages if m[0].split("/")[2:3] and m[0].split("/")[2][1:] in ("BIRTH", "DATA", "DEATH")]
        fresh = [m[3] for m in messages if m[3] not in self.known]
        self.known.update(zip(fresh, decoded(fresh) if fresh else [], strict=True))
        assert all(m[2] == "0" for m in messages), "nothing is retained"
        return [(topic, int(qos), self.known[payload]) for topic, qos, _, payload in messages]

    def sessions(self):
        """The messages from each NBIRTH to the next one, with the NDEATH and what else comes between."""
        sessions = []
        for message in self.payloads():
            if message[0] == NODE.format("NBIRTH"):
                sessions.append([])
            if sessions:
                sessions[-1].append(message)
        return sessions

    def close(self):
        self.process.kill()
        self.process.wait()
        self.reader.join()
        self.process.stdout.close()


def metric(payload, name):
    return next((m for m in payload["metrics"] if m.get("name") == name), None)


def number(value):
    return int(value)


class Sparkplug(MqttMachine):
    def run_machine(self, sparkplug="group: plant", port=PORT, interval="0.01s", more="", publish_hz=50):
        """A turning axis, every position of which is selected: the interval is shorter than its period."""
        mqtt = f"mqtt: {{host: 127.0.0.1, port: {port}, positions: {{interval: {interval}}}{more}, sparkplug: {{{sparkplug}}}}}\n"
        text = one_axis(simulate="{speed_rpm: 60}").replace("publish_hz: 200", f"publish_hz: {publish_hz}")
        self.config = self.write(text + mqtt)
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")

    def host(self):
        host = Host()
        self.addCleanup(host.close)
        return host

    def outbox(self):
        """Position/Seq of the samples in the outbox, in order."""
        numbers = []
        for path in sorted((self.folder / "state").glob("**/samples_*.lcm")):
            for record in whole_records(path.read_bytes()):
                channel_size = struct.unpack_from(">I", record, 20)[0]
                if record[28:28 + channel_size] == b"POSITION/axis1":
                    numbers.append(struct.unpack_from(">q", record, 28 + channel_size + 8 + 24)[0])
        return numbers

    def positions(self, session):
        """Position/Seq of a session's messages: (number, historical, ms), those of the births apart."""
        birth = next(p for topic, _, p in session if topic == DEVICE.format("DBIRTH"))
        alias = metric(birth, "Position/Seq")["alias"]
        in_births, sent = [], []
        for topic, _, payload in session:
            if topic == DEVICE.format("DBIRTH"):
                value = metric(payload, "Position/Seq")["value"]
                in_births += [] if value is None else [number(value)]
            if topic == DEVICE.format("DDATA"):
                sent += [(number(m["value"]), m.get("isHistorical", False), number(m["timestamp"]))
                         for m in payload["metrics"] if m.get("alias") == alias]
        return in_births, sent

    def check_complete(self, sessions):
        """Every sample in the outbox was received. No file of it is removed in so short a time. Returns their number."""
        received = set()
        for session in sessions:
            in_births, sent = self.positions(session)
            received.update(in_births, (each[0] for each in sent))
        stored = self.outbox()
        self.assertEqual(set(stored) - received, set())
        return len(stored)

    def check_sequence(self, session):
        """seq begins at 0 with NBIRTH and has no gap; NDEATH has none."""
        expected = 0
        for topic, qos, payload in session:
            if "/NDEATH/" in topic:
                self.assertNotIn("seq", payload)
                self.assertEqual(qos, 1)
                continue
            self.assertEqual(number(payload["seq"]), expected % 256, topic)
            self.assertEqual(qos, 0)
            expected += 1

    def rebirth_request(self):
        now = int(time.time() * 1000)
        return bytes.fromhex(by_reader(["encode " + json.dumps({"timestamp": now, "metrics": [
            {"name": "Node Control/Rebirth", "type": "Boolean", "value": True, "timestamp": now}]})])[0])

    def publish(self, topic, payload, *options):
        subprocess.run(["mosquitto_pub", "-p", str(PORT), "-t", topic, "-s", *options], input=payload, check=True)


class Births(Sparkplug):
    def test_the_demo_machine(self):
        self.broker()
        host = self.host()
        self.config = DEMO
        self.start("up", BIN / "axlecast", "up", DEMO, "--no-table")
        process = self.mqtt("--broker", "127.0.0.1", "--sparkplug", "plant", "--json")
        status = json.loads(self.axlecast("check-config", DEMO, "--json")[1])
        devices = {device["device"] for bus in status["buses"] for device in bus["devices"]}
        name = status["machine"]
        born = lambda: {topic.split("/")[-1] for topic in host.topics() if "/DBIRTH/" in topic}
        wait_for(lambda: born() >= devices, lambda: f"births of {devices - born()}: " + self.log("mqtt"))
        wait_for(lambda: len([t for t in host.topics() if "/DDATA/" in t]) >= 100, "data")
        self.assertEqual(self.end(process), DONE, self.log("mqtt"))
        wait_for(lambda: f"spBv1.0/plant/NDEATH/{name}" in host.topics(), "NDEATH")
        aliases, types, values = {}, {}, {}
        for topic, _, payload in host.payloads():
            kind, device = topic.split("/")[2], topic.split("/")[4:]
            if kind in ("NBIRTH", "DBIRTH"):
                for each in payload["metrics"]:
                    self.assertIn("type", each, f"{topic} {each}")
                    if each["name"] not in ("bdSeq", "Node Control/Rebirth"):
                        self.assertEqual(aliases.setdefault(number(each["alias"]), (device, each["name"])), (device, each["name"]))
                        types[number(each["alias"])] = each["type"]
            if kind in ("NDATA", "DDATA"):
                for each in payload["metrics"]:
                    self.assertNotIn("name", each)
                    self.assertEqual(aliases[number(each["alias"])][0], device)
                    self.assertEqual(each["type"], types[number(each["alias"])])
                    values.setdefault(aliases[number(each["alias"])][1], []).append(each["value"])
        self.assertTrue(any(isinstance(value, (int, float)) for value in values["Position/Value"]))

    def test_a_birth_and_its_units(self):
        self.broker()
        host = self.host()
        self.run_machine()
        process = self.mqtt("--json")
        wait_for(lambda: host.topics().count(DEVICE.format("DDATA")) >= 10, lambda: "data: " + self.log("mqtt"))
        self.assertEqual(self.end(process), DONE, self.log("mqtt"))
        wait_for(lambda: NODE.format("NDEATH") in host.topics(), "NDEATH")
        session = host.sessions()[0]
        birth = session[0][2]
        self.assertEqual((metric(birth, "Node Control/Rebirth")["type"], metric(birth, "Node Control/Rebirth")["value"]),
                         ("Boolean", False))
        self.assertEqual((metric(birth, "bdSeq")["type"], metric(birth, "bdSeq")["value"]), ("Int64", "0"))
        self.assertEqual([m["name"] for m in session[-1][2]["metrics"]], ["bdSeq"])
        births = [payload for topic, _, payload in session if topic == DEVICE.format("DBIRTH")]
        value = metric(births[-1], "Position/Value")
        self.assertEqual(value["properties"]["engUnit"]["value"], "deg")
        self.assertEqual(value["properties"]["Quality"]["type"], "Int32")
        for name in ("State", "Model", "Reading/Errors/timeout", "Alarm/device_offline/Active", "Alarm/battery_alarm/Active",
                     "Position/Speed"):
            self.assertIsNotNone(metric(births[0], name), name)
        self.check_sequence(session)


class Commands(Sparkplug):
    def test_a_rebirth_on_request_and_nothing_else(self):
        self.broker()
        host = self.host()
        self.run_machine()
        process = self.mqtt("--json")
        wait_for(lambda: host.topics().count(DEVICE.format("DDATA")) >= 10, lambda: "data: " + self.log("mqtt"))
        other = by_reader(["encode " + json.dumps({"timestamp": 1, "metrics": [
            {"name": "Position/Value", "type": "Double", "value": 1, "timestamp": 1}]})])[0]
        self.publish(NODE.format("NCMD"), bytes.fromhex(other))
        self.publish(NODE.format("NCMD"), b"\xff\xff")
        self.publish(DEVICE.format("DCMD"), bytes.fromhex(other))
        for _ in range(20):
            self.publish(NODE.format("NCMD"), self.rebirth_request())
        wait_for(lambda: host.topics().count(NODE.format("NBIRTH")) >= 2, "another birth")
        wait_for(lambda: host.topics()[-1] == DEVICE.format("DDATA"), "data")
        self.assertEqual(self.end(process), DONE, self.log("mqtt"))
        wait_for(lambda: NODE.format("NDEATH") in host.topics(), "NDEATH")
        summary = json.loads(self.log("mqtt").splitlines()[-1])
        self.assertEqual(summary["ignored"], 2, "DCMD is not subscribed")
        sessions = host.sessions()
        for session in sessions:
            self.check_sequence(session)
            self.assertEqual(metric(session[0][2], "bdSeq")["value"], "0", "it is the same connection")
        self.check_complete(sessions)


class BrokerAway(Sparkplug):
    def test_the_broker_is_away_and_the_process_is_killed_meanwhile(self):
        broker = self.broker()
        gate = self.relay()
        host = self.host()
        self.run_machine(port=RELAY_PORT)
        process = self.mqtt("--json")
        wait_for(lambda: host.topics().count(DEVICE.format("DDATA")) >= 50, lambda: "data: " + self.log("mqtt"))
        gate.cut()
        self.kill(broker)
        begin = time.monotonic()
        stored = len(self.outbox())
        wait_for(lambda: len(self.outbox()) >= stored + 50 * AWAY / 2 and time.monotonic() - begin > AWAY / 2,
                 "samples in the outbox", 60 + 2 * AWAY)
        before_kill = self.outbox()
        self.kill(process)
        process = self.mqtt("--json")
        wait_for(lambda: len(self.outbox()) >= len(before_kill) + 50 * AWAY / 2, "samples after the kill", 60 + 2 * AWAY)
        earlier = host
        earlier.close()  # it would connect to the new broker as well
        self.broker()
        host = self.host()
        gate.mode = "pass"
        wait_for(lambda: NODE.format("NBIRTH") in host.topics(), lambda: "births: " + self.log("mqtt"))
        wait_for(lambda: "births sent" in self.log("mqtt"), "the births")
        received = host.topics().count(DEVICE.format("DDATA"))
        wait_for(lambda: host.topics().count(DEVICE.format("DDATA")) >= received + 100, "live data")
        self.assertEqual(self.end(process), DONE, self.log("mqtt"))
        wait_for(lambda: NODE.format("NDEATH") in host.topics(), "NDEATH")
        self.assertTrue(json.loads(self.log("mqtt").splitlines()[-1])["caught_up"])
        first, second = earlier.sessions(), host.sessions()
        self.assertEqual((len(first), len(second)), (1, 1))
        for session in first + second:
            self.check_sequence(session)
        self.assertNotEqual(metric(first[0][0][2], "bdSeq")["value"], metric(second[0][0][2], "bdSeq")["value"])

        _, sent = self.positions(second[0])
        stored = self.check_complete(first + second)
        self.assertLessEqual(set(before_kill), set(self.outbox()), "the kill has cost nothing")
        # What was selected before the births is historical, and in order; what came later is not.
        born = number(second[0][0][2]["timestamp"])
        self.assertEqual([n for n, historical, ms in sent if not historical and ms < born - SLACK], [])
        self.assertEqual([n for n, historical, ms in sent if historical and ms > born + SLACK], [])
        live = [n for n, historical, _ in sent if not historical]
        self.assertEqual(live, sorted(live))
        print(f"\nbroker away for {time.monotonic() - begin:.0f} s, killed meanwhile: {stored} positions, 0 lost, "
              f"{sum(historical for _, historical, _ in sent)} historical")


class PrimaryHost(Sparkplug):
    def state(self, online, timestamp):
        self.publish("spBv1.0/STATE/scada1", json.dumps({"online": online, "timestamp": timestamp}).encode(), "-r", "-q", "1")

    def test_it_waits_for_its_host_and_leaves_with_it(self):
        self.broker()
        host = self.host()
        self.run_machine("group: plant, primary_host: scada1")
        self.state(False, 1000)
        process = self.mqtt("--json")
        wait_for(lambda: "waits for the primary host" in self.log("mqtt"), lambda: "waiting: " + self.log("mqtt"))
        wait_for(lambda: len(self.outbox()) >= 50, "samples meanwhile")
        self.assertEqual([t for t in host.topics() if "BIRTH" in t], [])
        self.state(True, 2000)
        wait_for(lambda: host.topics().count(DEVICE.format("DDATA")) >= 10, "data")
        self.state(False, 1999)  # a delayed will
        data = host.topics().count(DEVICE.format("DDATA"))
        wait_for(lambda: host.topics().count(DEVICE.format("DDATA")) >= data + 10, "more data")
        self.state(False, 2000)
        wait_for(lambda: NODE.format("NDEATH") in host.topics(), "NDEATH")
        wait_for(lambda: self.log("mqtt").count("waits for the primary host") >= 2, lambda: "waiting again: " + self.log("mqtt"))
        stored = len(self.outbox())
        wait_for(lambda: len(self.outbox()) >= stored + 50, "samples meanwhile")
        self.state(True, 3000)
        wait_for(lambda: host.topics().count(NODE.format("NBIRTH")) >= 2, "births")
        wait_for(lambda: host.topics()[-1] == DEVICE.format("DDATA"), "data")
        wait_for(lambda: self.end(process) == DONE, "the end")
        wait_for(lambda: host.topics().count(NODE.format("NDEATH")) >= 2, "NDEATH")
        self.check_complete(host.sessions())


class Session(Sparkplug):
    def test_two_bridges_with_one_id_stop_with_the_cause(self):
        self.broker()
        self.run_machine(more=", client_id: same")
        first = self.mqtt("--json")
        self.wait_connected()
        os.environ["XDG_STATE_HOME"] = str(self.folder / "other")
        second = self.mqtt("--json", name="other")
        wait_for(lambda: first.poll() is not None or second.poll() is not None,
                 lambda: "one of them to stop: " + self.log("mqtt") + self.log("other"))
        name, stopped = ("mqtt", first) if first.poll() is not None else ("other", second)
        self.assertEqual(stopped.wait(), FAILED)
        self.assertIn("client_id", self.log(name))

    def test_with_mqtt_3_1_1(self):
        self.broker()
        host = self.host()
        self.run_machine(more=', protocol: "3.1.1"')
        process = self.mqtt("--json")
        wait_for(lambda: host.topics().count(DEVICE.format("DDATA")) >= 10, lambda: "data: " + self.log("mqtt"))
        self.assertEqual(self.end(process), DONE, self.log("mqtt"))
        wait_for(lambda: NODE.format("NDEATH") in host.topics(), "NDEATH")
        self.check_sequence(host.sessions()[0])

    def test_the_will_when_it_is_killed_and_a_device_that_is_off(self):
        self.broker()
        host = self.host()
        self.run_machine()
        process = self.mqtt("--json")
        wait_for(lambda: host.topics().count(DEVICE.format("DDATA")) >= 10, lambda: "data: " + self.log("mqtt"))
        self.set_simulated(self.config, "rs485-0", power="off")
        wait_for(lambda: DEVICE.format("DDEATH") in host.topics(), "DDEATH")
        births = host.topics().count(DEVICE.format("DBIRTH"))
        self.set_simulated(self.config, "rs485-0", power="on")
        wait_for(lambda: host.topics().count(DEVICE.format("DBIRTH")) > births, "DBIRTH")
        self.kill(process)
        wait_for(lambda: NODE.format("NDEATH") in host.topics(), "the will")
        self.check_sequence(host.sessions()[0])


if __name__ == "__main__":
    unittest.main()
