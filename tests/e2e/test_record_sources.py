"""What axlecast record listens to: an encoder's own alarm as the trigger, LCM over TCP, and what is no source."""

import ctypes
import json
import socket
import struct
import subprocess
import unittest

import lcm_log
from machine import one_axis, wait_for
from recording import Recorder


class RecordSources(Recorder):
    def test_an_encoders_alarm_triggers(self):
        config = self.write(one_axis("{speed_rpm: 60, battery_v: 3.6}"))
        watch = self.watch(config)
        self.simulator(config, "rs485-0")
        self.driver(config, "rs485-0")
        self.wait_online(watch)
        process = self.recorder(self.folder, "--config", config, "--trigger", "ALARM/axis1 battery",
                                "--pre-trigger", "60s", "--post-trigger", "60s")
        seen = len(watch.of("POSITION/axis1"))
        wait_for(lambda: len(watch.of("POSITION/axis1")) > seen + 100, "positions in the recorder's memory")
        self.assertEqual(list(self.folder.glob("test_*.lcm")), [], "nothing yet")
        self.set_simulated(config, "rs485-0", battery_v=0)
        wait_for(lambda: any(name.startswith("battery") for name in self.alarms(watch)),
                 lambda: f"the alarm: {self.alarms(watch)}")
        seen = len(watch.of("POSITION/axis1"))
        wait_for(lambda: len(watch.of("POSITION/axis1")) > seen + 20, "positions behind it")
        code, summary = self.end(process)
        self.assertEqual(code, 0, summary)
        log, = self.folder.glob("test_*.lcm")
        channels = [channel for channel, _ in lcm_log.events(log)]
        alarm = max(at for at, channel in enumerate(channels) if channel == "ALARM/axis1")
        self.assertGreater(channels[:alarm].count("POSITION/axis1"), 100, "what came before it")
        self.assertGreater(channels[alarm:].count("POSITION/axis1"), 10, "and after it")

    # -- LCM over TCP: the server is liblcm's own, of Java

    def tcp_server(self, port):
        process = self.start("server", "java", "-cp", "/usr/share/java/lcm.jar", "lcm.lcm.TCPService", port)

        def answers():
            with socket.socket() as link:
                return link.connect_ex(("127.0.0.1", port)) == 0
        wait_for(answers, lambda: "the server: " + self.log("server"))
        return process

    def publisher(self, url):
        """A function that publishes by stock liblcm."""
        lcm = ctypes.CDLL("liblcm.so.1")
        lcm.lcm_create.restype = ctypes.c_void_p
        link = ctypes.c_void_p(lcm.lcm_create(url.encode()))
        self.assertTrue(link)
        self.addCleanup(lcm.lcm_destroy, link)

        def publish(channel, data):
            self.assertEqual(lcm.lcm_publish(link, channel.encode(), data, len(data)), 0)
        return publish

    def test_tcp_is_recorded(self):
        self.tcp_server(7700)
        url = "tcpq://127.0.0.1:7700"
        process = self.record(self.log_path, url=url)
        publish = self.publisher(url)
        wait_for(lambda: publish("HELLO", b"") or self.holds("HELLO"), "the server to hand messages on")
        for number in range(500):
            publish("T", struct.pack(">I", number))
        wait_for(lambda: self.readable() == 500, "all in the file")
        code, summary = self.end(process)
        self.assertEqual((code, summary["senders"]), (0, []), summary)
        self.assertEqual(self.recorded(), list(range(500)))

    def holds(self, channel):
        try:
            return any(name == channel for name, _ in lcm_log.events(self.log_path))
        except (ValueError, struct.error):
            return False

    def test_without_a_server_it_says_so(self):
        code, _, err = self.axlecast("record", self.log_path, "--url", "tcpq://127.0.0.1:7700")
        self.assertEqual(code, 4, err)
        self.assertIn("tcpq://127.0.0.1:7700", err)

    def test_a_server_that_ends_is_told(self):
        server = self.tcp_server(7700)
        process = self.record(self.log_path, url="tcpq://127.0.0.1:7700")
        self.kill(server)
        self.assertEqual(process.wait(30), 4, self.log("record"))
        self.assertIn("LCM failed on tcpq://127.0.0.1:7700", self.lines("record", "end")[-1]["error"])

    def test_a_log_is_no_source(self):
        lcm_log.write(self.log_path, [(0, "T", b"1234")])
        for url in (f"file://{self.log_path}?mode=r", "memq://"):
            code, _, err = self.axlecast("record", self.folder / "b.lcm", "--url", url)
            self.assertEqual(code, 2, err)
            self.assertIn(url, err)
        self.assertFalse((self.folder / "b.lcm").exists())


if __name__ == "__main__":
    unittest.main(verbosity=2)
