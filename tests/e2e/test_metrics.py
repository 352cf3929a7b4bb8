"""/metrics of `axlecast web`, as Prometheus reads it."""

import os
import pathlib
import re
import subprocess
import unittest

from machine import BIN, Machine, one_axis, wait_for
from web_client import request

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])


class Metrics(Machine):
    def serve(self, config):
        process = self.start("web", BIN / "axlecast", "web", config, "--port", "0")
        address = lambda: re.search(r"^http://\S+:(\d+)/$", self.log("web"), re.MULTILINE)
        wait_for(lambda: address() or process.poll() is not None, "the server's address")
        self.assertIsNone(process.poll(), self.log("web"))
        self.port = int(address()[1])

    def scrape(self):
        """Values by sample, with their labels as the text has them."""
        status, headers, body = request(self.port, "/metrics")
        self.assertEqual((status, headers["content-type"]), (200, "text/plain; version=0.0.4; charset=utf-8"))
        self.text = body.decode()
        lines = [line for line in self.text.splitlines() if not line.startswith("#")]
        samples = [line.rpartition(" ") for line in lines]
        self.assertEqual(len({sample for sample, _, _ in samples}), len(lines), "every sample once")
        return {sample: float(value) for sample, _, value in samples}

    def wait_value(self, sample, holds, what):
        return wait_for(lambda: holds(self.scrape().get(sample, float("nan"))), lambda: f"{sample} {what}\n{self.text}")

    def check_text(self):
        done = subprocess.run(["promtool", "check", "metrics"], input=self.text, capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stdout + done.stderr), (0, ""), self.text)

    def test_counters_grow_and_states_change_with_what_happens(self):
        self.config = self.write(one_axis("{speed_rpm: 60}"))
        self.serve(self.config)
        self.wait_value('axlecast_device_state{device="axis1",state="silent"}', lambda v: v == 1, "never heard yet")
        self.simulator(self.config, "rs485-0")
        driver = self.driver(self.config, "rs485-0")
        self.wait_value('axlecast_device_state{device="axis1",state="online"}', lambda v: v == 1, "the driver reads it")
        self.wait_value('axlecast_bus_exchange_seconds_count{bus="rs485-0"}', lambda v: v > 0, "exchanges were told")
        self.wait_value('axlecast_device_speed_radians_per_second{device="axis1"}', lambda v: abs(v - 6.283) < 0.7, "60 rpm")
        before = self.scrape()
        self.check_text()
        for counter in ("device_readings_total{device=\"axis1\"}", "bus_exchanges_total{bus=\"rs485-0\"}",
                        "bus_exchange_seconds_sum{bus=\"rs485-0\"}", "messages_received_total{channel=\"POSITION/axis1\"}"):
            self.wait_value(f"axlecast_{counter}", lambda v, old=before[f"axlecast_{counter}"]: v > old, "grows")
        now = self.scrape()
        buckets = [value for sample, value in now.items() if sample.startswith("axlecast_bus_exchange_seconds_bucket")]
        self.assertGreater(len(buckets), 20)
        self.assertEqual(buckets, sorted(buckets))
        self.assertEqual(buckets[-1], now['axlecast_bus_exchange_seconds_count{bus="rs485-0"}'])

        self.set_simulated(self.config, "rs485-0", fault="bit_flip:0.01")
        self.wait_value('axlecast_device_reading_errors_total{device="axis1",kind="checksum"}', lambda v: v > 0, "counted")

        self.kill(driver)
        self.wait_value('axlecast_device_state{device="axis1",state="silent"}', lambda v: v == 1, "the driver is dead")
        dead = self.scrape()
        self.assertEqual(dead['axlecast_bus_state{bus="rs485-0",state="silent"}'], 1)
        self.assertNotIn('axlecast_device_position_radians{device="axis1"}', dead)
        self.assertGreater(dead['axlecast_device_readings_total{device="axis1"}'], 0)
        self.check_text()

    def test_commands_and_recorders_are_counted(self):
        self.config = self.write(one_axis())
        self.serve(self.config)
        self.assertEqual(self.scrape()["axlecast_bridge_up"], 0)
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")
        self.bridge(self.config)
        self.start("record", BIN / "axlecast", "record", self.folder / "a.lcm", "--config", self.config)
        self.wait_value("axlecast_bridge_up", lambda v: v == 1, "a bridge serves")
        self.wait_value('axlecast_recorder_state{recorder="test",state="recording"}', lambda v: v == 1, "it records")
        self.wait_value('axlecast_recorder_messages_total{recorder="test"}', lambda v: v > 0, "it hears")
        self.wait_value('axlecast_alarms{origin="bridge",name="bridge"}', lambda v: v == 1, "everybody may command")
        self.assertIn('axlecast_alarm{origin="bridge",name="bridge",alarm="unsigned_allowed",severity="info",state="live"} 1', self.text)
        code, outcome = self.outcome("clear-errors", "axis1")
        self.assertIn(code, (0, 7), outcome)
        self.wait_value('axlecast_commands_total{outcome="succeeded"}', lambda v: v == 1, "the outcome was heard")
        self.check_text()

    def test_the_demo(self):
        self.start("up", BIN / "axlecast", "up", SOURCE / "config/demo.yaml", "--no-table")
        self.serve(SOURCE / "config/demo.yaml")
        answering = lambda now: sum(value for sample, value in now.items() if re.match(
            r'axlecast_device_state\{.*state="(online|degraded)"', sample))
        wait_for(lambda: answering(self.scrape()) == 13, lambda: f"13 devices answer:\n{self.text}", limit=120)
        self.wait_value('axlecast_motor_voltage_volts{device="conveyor"}', lambda v: v > 0, "the motor is read")
        self.check_text()
        now = self.scrape()
        states = {sample: value for sample, value in now.items() if sample.startswith("axlecast_device_state{")}
        self.assertEqual((len(states), sum(states.values())), (13 * 5, 13))
        self.assertEqual(now["axlecast_bridge_up"], 1)


if __name__ == "__main__":
    unittest.main()
