"""axlecast mqtt against Debian's mosquitto: what is published, what a broker that is away, killed, silent or slow costs,
who is let in, and that the drivers feel nothing of it."""

import json
import os
import pathlib
import random
import subprocess
import unittest

import jsonschema
from hostile_broker import UNKNOWN_PROPERTY, HostileBroker, hostile_packets
from lcm_ear import LcmEar
from machine import BIN, LIMIT, one_axis, wait_for
from mqtt_broker import PORT, RELAY_PORT, MqttMachine, gaps

BASE = "axlecast/test/"
HOSTILE = int(os.environ.get("AXLECAST_MQTT_HOSTILE", 0))  # packets of a hostile broker beside those that are always sent
WINDOW = 20  # messages on their way at a time
DONE, USAGE, REJECTED, LOSSES, FAILED, NO_ANSWER = 0, 2, 3, 3, 4, 6


class Mqtt(MqttMachine):
    def run_machine(self, mqtt="", **options):
        """One axis, at 200 positions a second, that turns; its driver and its simulator."""
        options.setdefault("simulate", "{speed_rpm: 60}")
        self.config = self.write(one_axis(**options) + (f"mqtt: {mqtt}\n" if mqtt else ""))
        self.data = self.watch(self.config, "--channel", "^(DEVICE|ALARM|BUS)/")
        self.running_simulator = self.simulator(self.config, "rs485-0")
        self.running_driver = self.driver(self.config, "rs485-0")
        self.wait_online(self.data)

    def check_schemas(self, subscriber):
        schemas = json.loads(self.axlecast("mqtt", "--schema")[1])
        for message in list(subscriber.messages):
            level = message["topic"].removeprefix(BASE).split("/")[0]
            jsonschema.validate(json.loads(message["payload"]), schemas["$defs"][level])
        return {topic.removeprefix(BASE).split("/")[0] for topic in subscriber.topics()}


class Publishing(Mqtt):
    def test_what_is_published_and_its_schemas(self):
        self.broker()
        self.run_machine("{host: 127.0.0.1, positions: {interval: 0.1s}}")
        self.bridge(self.config)
        subscriber = self.subscribe()
        process = self.mqtt("--json")
        wait_for(lambda: len(subscriber.of(BASE + "position/axis1")) >= 20, "positions")
        self.assertEqual(self.outcome("zero", "axis1", "--yes")[0], REJECTED, "the shaft turns")
        wait_for(lambda: subscriber.of(BASE + "command/axis1"), "the outcome of a command")
        wait_for(lambda: subscriber.of(BASE + "alarm/bridge") and subscriber.of(BASE + "bus/rs485-0"), "states")
        self.assertEqual(self.end(process), DONE, self.log("mqtt"))
        wait_for(lambda: (subscriber.last(BASE + "status") or {}).get("state") == "ended", "the farewell")
        levels = self.check_schemas(subscriber)
        self.assertGreaterEqual(levels, {"position", "device", "bus", "alarm", "command", "status"})
        positions = subscriber.of(BASE + "position/axis1")
        self.assertEqual(gaps(positions), 0)
        times = [position["utime"] for position in positions]
        self.assertGreaterEqual((times[-1] - times[0]) / (len(times) - 1), 95_000, "no oftener than configured")
        # Who comes later sees the states, and no position as if it were new.
        late = self.subscribe()
        wait_for(lambda: BASE + "status" in late.topics() and BASE + "device/axis1" in late.topics(), "retained states")
        self.assertNotIn(BASE + "position/axis1", late.topics())

    def test_the_last_will_when_it_is_killed(self):
        self.broker()
        self.run_machine()
        subscriber = self.subscribe()
        process = self.mqtt("--broker", "127.0.0.1", "--prefix", "plant/hall2")
        status = "plant/hall2/test/status"
        wait_for(lambda: (subscriber.last(status) or {}).get("state") == "online", "it is there")
        self.kill(process)
        wait_for(lambda: (subscriber.last(status) or {}).get("state") == "offline", "the will")
        late = self.subscribe()
        wait_for(lambda: (late.last(status) or {}).get("state") == "offline", "the will is kept")

    def test_up_starts_it_where_the_file_names_a_broker(self):
        self.broker()
        subscriber = self.subscribe()
        self.config = self.write(one_axis() + "mqtt: {host: 127.0.0.1}\n")
        self.assertIn("mqtt, to 127.0.0.1:1883 without TLS", self.axlecast("check-config", self.config)[1])
        process = self.start("up", BIN / "axlecast", "up", self.config, "--no-table")
        wait_for(lambda: subscriber.of(BASE + "position/axis1"), lambda: "positions: " + self.log("up"))
        process.terminate()
        process.wait(60)
        wait_for(lambda: (subscriber.last(BASE + "status") or {}).get("state") == "ended", "the farewell")

    def test_print_needs_no_broker(self):
        self.run_machine()
        code, out, err = self.axlecast("mqtt", self.config, "--print", "--json", "--seconds", "2")
        self.assertEqual(code, DONE, err)
        lines = [json.loads(line) for line in out.splitlines()]
        self.assertIn(BASE + "position/axis1", {line["topic"] for line in lines})
        device = next(line for line in lines if line["topic"] == BASE + "device/axis1")
        self.assertEqual((device["retain"], device["qos"], device["payload"]["state_name"]), (True, 1, "ONLINE"))
        self.assertEqual(self.axlecast("mqtt", self.config)[0], USAGE, "without a broker")

    def test_nothing_to_print_without_a_machine(self):
        self.config = self.write(one_axis())
        self.assertEqual(self.axlecast("mqtt", self.config, "--print", "--seconds", "1")[0], NO_ANSWER)


class Hostile(Mqtt):
    def test_a_hostile_broker_costs_the_connection_and_nothing_that_waits(self):
        unknown = bytes([0x50, 5, 0, 1, 0, 0x25, 0x67])  # a PUBREC with a property that there is not
        huge = b"\x30\xff\xff\xff\x7f" + b"\0" * 100_000  # a message of 256 MB
        packets = [("SUBACK", UNKNOWN_PROPERTY), ("PUBREC", unknown), ("PUBLISH", huge)]
        more = list(hostile_packets())
        random.Random(2).shuffle(more)
        packets += more[:HOSTILE]
        broker = HostileBroker(packets, PORT)
        self.run_machine("{host: 127.0.0.1, positions: {interval: 0.1s}}")
        process = self.mqtt("--json")
        # An attempt comes at the latest 8 s after the one before, which is given up after 30 s.
        wait_for(lambda: len(broker.sent) >= len(packets), lambda: f"a connection each, not {broker.sent}: " + self.log("mqtt"),
                 LIMIT + 40 * HOSTILE)
        broker.close()
        self.broker()
        subscriber = self.subscribe()
        wait_for(lambda: subscriber.of(BASE + "device/axis1"), "a state")
        # What was published while the hostile broker had the connection comes first, and nothing is missing.
        wait_for(lambda: len(subscriber.of(BASE + "position/axis1")) >= 40, "positions")
        self.assertIsNone(process.poll(), self.log("mqtt"))
        self.assertIn("libmosquitto", self.log("mqtt"))
        if HOSTILE == 0:  # else the queue's bounds and brokers that only hang up cost some
            self.assertEqual(gaps(subscriber.of(BASE + "position/axis1")), 0)
            self.assertEqual(self.end(process), DONE, self.log("mqtt"))


class BrokerAway(Mqtt):
    """The bridge reaches the broker through a relay, so that the listener can return before the broker does."""

    def run_bridge(self, queue="{}", interval="0.05s", seconds=None):
        self.running_broker = self.broker()
        self.gate = self.relay()
        self.run_machine(f"{{host: 127.0.0.1, port: {RELAY_PORT}, positions: {{interval: {interval}}}, queue: {queue}}}")
        self.subscriber = self.subscribe()
        self.process = self.mqtt("--json")
        self.wait_connected()
        wait_for(lambda: len(self.positions()) >= 20, "positions")

    def positions(self):
        return self.subscriber.of(BASE + "position/axis1")

    def summary(self):
        return json.loads(self.log("mqtt").splitlines()[-1])

    def rate(self, ear, count):
        """Positions a second of the driver on LCM, while `count` come."""
        times = []
        begin = len(ear.messages)
        def enough():
            times[:] = [int.from_bytes(data[8:16], "big") for channel, data in ear.messages[begin:]
                        if channel == "POSITION/axis1"]
            return len(times) > count
        wait_for(enough, "positions on LCM", LIMIT + count / 50)
        return (len(times) - 1) / (times[-1] - times[0]) * 1e6

    def away(self, count):
        """The broker is killed, and while it is away the driver publishes `count` positions; then it is back. The rates
        of the driver before and meanwhile."""
        ear = LcmEar()
        before = self.rate(ear, min(count, 1000))
        self.gate.cut()
        self.kill(self.running_broker)
        meanwhile = self.rate(ear, count)
        self.subscriber_before = self.subscriber
        self.running_broker = self.broker()
        self.subscriber = self.subscribe()
        wait_for(lambda: self.subscriber_ready(), "the one who listens")
        self.gate.mode = "pass"
        self.wait_connected(2)
        return before, meanwhile

    def check_losses(self, missing, counted):
        """Each loss is counted, and no more than that, but for a window whose confirmations the cut has swallowed."""
        self.assertLessEqual(missing, counted)
        self.assertLessEqual(counted - missing, WINDOW)

    def subscriber_ready(self):
        subprocess.run(["mosquitto_pub", "-p", str(PORT), "-t", "ready", "-m", "1"], check=True)
        return "ready" in self.subscriber.topics()

    def test_within_the_bound_nothing_is_lost(self):
        count = int(float(os.environ.get("AXLECAST_MQTT_AWAY", 5)) * 200)
        self.run_bridge(interval="0.01s")
        before, meanwhile = self.away(count)
        wait_for(lambda: (self.subscriber.last(BASE + "status") or {}).get("waiting", 99) <= 20, "it has caught up",
                 LIMIT + count / 50)
        self.assertEqual(self.end(self.process), DONE, self.log("mqtt"))
        wait_for(lambda: (self.subscriber.last(BASE + "status") or {}).get("state") == "ended", "the farewell")
        positions = self.subscriber_before.of(BASE + "position/axis1") + self.positions()
        summary = self.summary()
        print(f"\nbroker away for {count / 200:g} s: {len(positions)} positions, {gaps(positions)} missing, shed "
              f"{summary['shed_samples']}, replaced states {summary['replaced']}; driver {before:.1f} /s before, "
              f"{meanwhile:.1f} /s meanwhile")
        self.assertEqual(gaps(positions), 0)
        self.assertEqual([summary[key] for key in ("shed_samples", "shed_events", "shed_states", "lost_before")], [0] * 4)
        if "AXLECAST_MQTT_AWAY" in os.environ:  # the campaign: nothing else runs
            self.assertGreaterEqual(meanwhile, 0.7 * before)

    def test_beyond_the_bound_the_oldest_positions_go_and_are_counted(self):
        self.run_bridge(queue="{messages: 100}", interval="0.01s")
        self.away(1000)
        wait_for(lambda: (self.subscriber.last(BASE + "status") or {}).get("waiting", 99) <= 20, "it has caught up")
        self.assertEqual(self.end(self.process), LOSSES)
        wait_for(lambda: (self.subscriber.last(BASE + "status") or {}).get("state") == "ended", "the farewell")
        summary = self.summary()
        self.assertGreater(summary["shed_samples"], 100)
        self.assertEqual([summary["shed_events"], summary["shed_states"]], [0, 0])
        positions = self.subscriber_before.of(BASE + "position/axis1") + self.positions()
        self.check_losses(gaps(positions), summary["shed_samples"])
        self.assertEqual(self.subscriber.of(BASE + "device/axis1")[-1]["state_name"], "ONLINE")
        self.assertIn("mqtt_messages_shed",
                      {entry["name"] for entry in self.data.last("ALARM/mqtt/test")["entries"]})

    def test_an_alarm_that_comes_while_the_broker_is_away_arrives(self):
        self.run_bridge()
        self.gate.cut()
        self.set_simulated(self.config, "rs485-0", power="off")
        self.wait_state(self.data, 3)
        wait_for(lambda: "broker_away" in self.alarms(self.data, "mqtt/test"), "the alarm on LCM")
        self.gate.mode = "pass"
        wait_for(lambda: (self.subscriber.last(BASE + "device/axis1") or {}).get("state_name") == "OFFLINE", "the state")
        wait_for(lambda: "broker_away" not in self.alarms(self.data, "mqtt/test"), "the alarm to go")
        self.assertEqual(self.end(self.process), DONE, self.log("mqtt"))

    def test_a_broker_that_takes_connections_and_never_answers(self):
        self.run_bridge()
        self.gate.cut("stall")
        wait_for(lambda: "does not answer" in self.log("mqtt"), "the cause")
        self.gate.cut("pass")
        self.wait_connected(2)
        wait_for(lambda: (self.subscriber.last(BASE + "status") or {}).get("connections") == 2, "the status")
        self.assertEqual(self.end(self.process), DONE, self.log("mqtt"))

    def test_a_slow_broker_gets_the_newest_and_the_loss_is_counted(self):
        self.run_bridge(queue="{messages: 100}", interval="0.01s")
        self.gate.cut(6000)  # bytes a second: about a tenth of what comes
        self.wait_connected(2)
        wait_for(lambda: (self.subscriber.last(BASE + "status") or {}).get("shed_samples", 0) > 50, "positions shed")
        self.gate.mode = "pass"
        wait_for(lambda: (self.subscriber.last(BASE + "status") or {}).get("waiting", 99) <= 20, "it has caught up")
        self.assertEqual(self.end(self.process), LOSSES)
        wait_for(lambda: (self.subscriber.last(BASE + "status") or {}).get("state") == "ended", "the farewell")
        self.check_losses(gaps(self.positions()), self.summary()["shed_samples"])

    def test_it_ends_at_once_while_the_broker_is_away(self):
        self.run_bridge()
        self.gate.cut()
        wait_for(lambda: self.gate.accepted > 1, "an attempt")
        self.assertEqual(self.end(self.process), LOSSES, "what still waits is told")
        self.assertGreater(self.summary()["waiting"], 0)


class Access(Mqtt):
    PASSWORD = "Vx4#right-one"

    def password_file(self, text, mode=0o600, name="password"):
        path = self.folder / name
        path.touch(mode=mode)
        path.write_text(text + "\n")
        path.chmod(mode)
        return path

    def broker_with_password(self, *lines, port=PORT):
        passwords = self.folder / "passwords"
        subprocess.run(["mosquitto_passwd", "-b", "-c", passwords, "press3", self.PASSWORD], check=True,
                       stderr=subprocess.DEVNULL)
        return self.broker("allow_anonymous false", f"password_file {passwords}", *lines, port=port)

    def test_user_and_password(self):
        self.broker_with_password()
        right = self.password_file(self.PASSWORD)
        self.run_machine(f"{{host: 127.0.0.1, user: press3, password: {{file: {right}}}}}")
        subscriber = self.subscribe("-u", "press3", "-P", self.PASSWORD)
        process = self.mqtt("--json")
        wait_for(lambda: subscriber.of(BASE + "position/axis1"), "positions")
        for place in ("cmdline", "environ"):
            self.assertNotIn(self.PASSWORD.encode(), pathlib.Path(f"/proc/{process.pid}/{place}").read_bytes())
        self.assertEqual(self.end(process), DONE)
        self.assertNotIn(self.PASSWORD, self.log("mqtt"))

    def test_a_wrong_password_is_told_and_mended_without_a_restart(self):
        for protocol in ("5", "3.1.1"):
            with self.subTest(protocol):
                broker = self.broker_with_password()
                path = self.password_file("wrong")
                self.config = self.write(one_axis())
                name = f"mqtt-{protocol}"
                process = self.mqtt("--broker", "127.0.0.1", "--user", "press3", "--password-file", path, "--protocol",
                                    protocol, name=name)
                wait_for(lambda: "check user and password" in self.log(name), lambda: self.log(name))
                self.password_file(self.PASSWORD)
                self.wait_connected(name=name)
                self.assertNotIn("wrong", self.log(name))
                self.end(process)
                broker.terminate()
                broker.wait()

    def test_a_machine_whose_broker_refuses_all_along_is_not_good(self):
        self.broker_with_password()
        path = self.password_file("wrong")
        self.config = self.write(one_axis() + f"mqtt: {{host: 127.0.0.1, user: press3, password: {{file: {path}}}}}\n")
        up = self.start("up", BIN / "axlecast", "up", self.config, "--no-table")

        def faults_of_status():
            code, out, err = self.axlecast("status", self.config, "--json")
            faults = json.loads(out)["faults"] if out else []
            return (code, faults) if any(fault.startswith("mqtt: ") for fault in faults) else None
        self.assertEqual(wait_for(faults_of_status, lambda: "status to tell of the broker: " + self.log("up"))[0], 1)
        code, out, err = self.axlecast("status", self.config)
        self.assertRegex(out, r"\nnot good:\n(  .*\n)*  mqtt: \w+")
        code, out, err = self.axlecast("doctor", self.config, "--only", "machine_faults", "--json")
        findings = json.loads(out)["findings"]
        self.assertTrue(any("mqtt: " in finding["found"] for finding in findings), out + err)
        self.assertEqual(code, 1)
        up.send_signal(2)
        self.assertEqual(up.wait(60), DONE, "ended by its operator")
        self.assertRegex(self.log("up"), r"\nnot good:\n(  .*\n)*  mqtt: \w+")
        self.assertNotIn("good: every device", self.log("up"))
        code, out, err = self.axlecast("up", self.config, "--seconds", "12", "--json", limit=120)
        self.assertEqual(code, 1, out + err)
        summary = json.loads(out)
        self.assertFalse(summary["good"])
        self.assertTrue(any(fault.startswith("mqtt: ") for fault in summary["faults"]), summary["faults"])

    def test_a_run_that_is_shorter_than_the_alarm_of_a_refusing_broker_is_not_good(self):
        """The alarm comes after 10 s. Before that, only the exit code of `axlecast mqtt` shows that the broker took nothing.
        A signal ends `up --seconds` early."""
        self.broker_with_password()
        path = self.password_file("wrong")
        self.config = self.write(one_axis() + f"mqtt: {{host: 127.0.0.1, user: press3, password: {{file: {path}}}}}\n")
        data = self.watch(self.config, "--channel", "^(DEVICE|ALARM)/")
        up = self.start("up", BIN / "axlecast", "up", self.config, "--no-table", "--seconds", "3600")
        self.wait_online(data)
        wait_for(lambda: "check user and password" in self.log("up"), lambda: "the refusal: " + self.log("up"))
        up.send_signal(2)
        self.assertEqual(up.wait(60), 1, self.log("up"))
        self.assertRegex(self.log("up").partition("\nnot good:\n")[2], r"(?m)^  mqtt\b.*")
        self.assertNotIn("good: every device", self.log("up"))

    def test_a_password_that_others_can_read_is_refused(self):
        self.config = self.write(one_axis())
        path = self.password_file(self.PASSWORD, 0o644)
        code, _, err = self.axlecast("mqtt", self.config, "--broker", "127.0.0.1", "--user", "a", "--password-file", path)
        self.assertEqual(code, FAILED)
        self.assertIn("chmod 600", err)
        self.assertNotIn(self.PASSWORD, err)

    def certificates(self):
        """An authority, its broker and its client; and another authority."""
        def openssl(*words):
            subprocess.run(["openssl", *words], check=True, cwd=self.folder, stderr=subprocess.DEVNULL)
        for authority in ("ca", "other"):
            openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2",
                    "-subj", f"/CN={authority}", "-keyout", f"{authority}.key", "-out", f"{authority}.pem")
        (self.folder / "names").write_text("subjectAltName=DNS:localhost,DNS:broker.example\n")
        for name in ("broker", "client"):
            openssl("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-subj",
                    f"/CN={name}", "-keyout", f"{name}.key", "-out", f"{name}.csr")
            openssl("x509", "-req", "-in", f"{name}.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial",
                    "-days", "2", "-extfile", "names", "-out", f"{name}.pem")

    def test_tls_with_a_certificate_of_ours(self):
        self.certificates()
        self.broker(f"cafile {self.folder}/ca.pem", f"certfile {self.folder}/broker.pem",
                    f"keyfile {self.folder}/broker.key", "require_certificate true", port=8883)
        self.run_machine()
        tls = ["--cafile", self.folder / "ca.pem", "--cert", self.folder / "client.pem", "--key",
               self.folder / "client.key", "-h", "localhost"]
        subscriber = self.subscribe(*map(str, tls), port=8883)
        good = ["--ca", self.folder / "ca.pem", "--certificate", self.folder / "client.pem", "--key",
                self.folder / "client.key"]
        process = self.mqtt("--broker", "localhost", *good)
        wait_for(lambda: subscriber.of(BASE + "position/axis1"), lambda: "positions: " + self.log("mqtt"))
        self.assertEqual(self.end(process), DONE)
        for name, broker, options, cause in (
                ("another-authority", "localhost", ["--ca", self.folder / "other.pem", *good[2:]], "certificate verify failed"),
                ("another-name", "127.0.0.1:8883", good, "certificate verify failed"),
                ("no-certificate", "localhost", good[:2], ""),
                ("no-tls", "127.0.0.1:8883", [], "")):
            with self.subTest(name):
                process = self.mqtt("--broker", broker, *options, name=name)
                wait_for(lambda: self.log(name).count("\n") > 1, "the cause")
                self.assertIn(cause, self.log(name))
                self.assertNotIn(": connected", self.log(name))
                self.end(process)

    def resolving(self):
        """An environment in which a name has two addresses."""
        hosts = self.write("::1 broker.example\n127.0.0.1 broker.example\n", "hosts")
        return {"LD_PRELOAD": "libnss_wrapper.so", "NSS_WRAPPER_HOSTS": str(hosts)}

    def test_of_a_names_addresses_the_one_with_the_broker_is_found(self):
        self.certificates()
        tls = [f"cafile {self.folder}/ca.pem", f"certfile {self.folder}/broker.pem", f"keyfile {self.folder}/broker.key"]
        self.config = self.write(one_axis())
        for port, (address, lines, options) in enumerate((
                ("::1", [], []), ("127.0.0.1", [], []),
                ("::1", tls, ["--ca", self.folder / "ca.pem"]), ("127.0.0.1", tls, ["--ca", self.folder / "ca.pem"])), 8890):
            name = f"mqtt-{port}"
            with self.subTest(address=address, tls=bool(lines)):
                self.broker(f"listener {port} {address}", *lines, wait=False)
                process = self.mqtt("--broker", f"broker.example:{port}", *options, name=name, env=self.resolving())
                self.wait_connected(name=name)
                self.end(process)

    def test_a_broker_that_is_not_there_is_told_at_once_with_tls_too(self):
        self.config = self.write(one_axis())
        self.certificates()
        for name, options in (("plain", []), ("tls", ["--ca", self.folder / "ca.pem"])):
            process = self.mqtt("--broker", "127.0.0.1:8899", *options, name=name)
            wait_for(lambda: self.log(name).count("\n") > 1, "the cause")
            self.assertIn("Connection refused", self.log(name))
            self.end(process)

    def test_what_the_brokers_access_list_forbids_is_counted(self):
        rights = self.write("topic readwrite axlecast/test/status\ntopic read #\n", "rights")
        self.broker(f"acl_file {rights}")
        self.run_machine("{host: 127.0.0.1}")
        subscriber = self.subscribe()
        process = self.mqtt("--json")
        # mosquitto 2.0.11 ends the connection with each refusal: the last status is its will as a rule.
        wait_for(lambda: any(status.get("refused", 0) > 0 for status in subscriber.of(BASE + "status")),
                 "refusals in the status")
        wait_for(lambda: "Not authorized" in self.log("mqtt"), lambda: self.log("mqtt"))
        self.assertEqual(self.end(process), LOSSES)
        self.assertEqual(subscriber.topics(), {BASE + "status"})


if __name__ == "__main__":
    unittest.main(verbosity=2)
