"""What comes faster than a process reads: each receiver asks the kernel for a large buffer, counts what was dropped all
the same, says so where its user looks, and names what mends it."""

import pathlib
import re
import signal
import socket
import subprocess
import unittest

from machine import BIN, one_axis, wait_for
from mqtt_broker import MqttMachine
from recording import GROUP, PORT, Sender
from web_client import WebSocket

COMMAND_PORT = 7668
WEB_PORT = 8877
ASKED = 32 << 20  # bytes, which the kernel doubles for its own book-keeping (socket(7))
SO_RCVBUFFORCE = 33
SIZE = 60_000  # bytes of a datagram
LOSS = re.compile(r"(\d+) datagrams? lost because this process's receive buffer was full(.*)")


def sockets():
    """(command line, bytes of the kernel's buffer) of every socket at the group."""
    listing = subprocess.run(["ss", "-H", "-u", "-a", "-n", "-p", "-m", "-O"], check=True, capture_output=True, text=True)
    for line in listing.stdout.splitlines():
        process = re.search(r"pid=(\d+),", line)
        if GROUP not in line or not process:
            continue
        words = pathlib.Path(f"/proc/{process[1]}/cmdline").read_bytes().decode().split("\0")
        yield int(process[1]), " ".join(words), int(re.search(r"skmem:\(r\d+,rb(\d+)", line)[1]) // 2


def given(bytes_asked):
    """What the kernel gives a socket of this user that asks for so much."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        try:
            asking.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, bytes_asked)
        except PermissionError:
            asking.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, bytes_asked)
        return asking.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 2


class Reception(MqttMachine):
    def setUp(self):
        super().setUp()
        self.config = self.write(one_axis() + "mqtt: {host: 127.0.0.1}\n")

    def started(self, name, *command):
        """A process that listens at the group."""
        process = self.start(name, *command)
        wait_for(lambda: process.poll() is not None or any(pid == process.pid for pid, _, _ in sockets()),
                 lambda: f"{name} at the group: {self.log(name)}")
        self.assertIsNone(process.poll(), self.log(name))
        return process

    def watching(self, *before):
        return self.started("watch", *before, BIN / "axlecast", "watch", self.config, "--json", "--channel", "DEVICE/.*")

    def lose(self, process, port=PORT):
        """The process stands still while more comes than its buffer takes: on a channel that nobody subscribed."""
        self.stand_still(process)
        sender = Sender(port)
        self.addCleanup(sender.socket.close)
        sender.send(3 * ASKED // SIZE, channel="FLOOD", size=SIZE)
        process.send_signal(signal.SIGCONT)

    def wait_told(self, name):
        return wait_for(lambda: LOSS.search(self.log(name)), lambda: f"{name} to tell its loss: {self.log(name)}")

    def test_every_receiver_asks_for_a_large_buffer(self):
        self.broker()
        self.start("up", BIN / "axlecast", "up", self.config, "--no-table", "--web")
        self.watching()
        self.start("record", BIN / "axlecast", "record", self.folder / "a.lcm", "--url", f"udpm://{GROUP}:{PORT}?ttl=0")
        names = ("axlecast up", "axlecast web", "axlecast mqtt", "axlecast watch", "axlecast record", "axlecast-tformat",
                 "axlecast-bridge")
        wait_for(lambda: all(any(name in words for _, words, _ in sockets()) for name in names),
                 lambda: f"a socket of each of {names}: {list(sockets())} {self.log('up')}")
        enough = given(ASKED)
        for _, words, size in sockets():
            self.assertGreaterEqual(size, enough, words)

    def test_up_counts_what_was_dropped_and_names_the_cause(self):
        config = self.write(one_axis(), "plain.yaml")
        up = self.started("up", BIN / "axlecast", "up", config, "--no-table")
        self.lose(up)
        self.wait_told("up")
        up.send_signal(signal.SIGINT)
        up.wait(60)
        summary = self.log("up").partition("\nran ")[2]
        self.assertRegex(summary, LOSS)

    def test_the_page_and_its_server_count_it(self):
        web = self.started("web", BIN / "axlecast", "web", self.config, "--port", str(WEB_PORT))
        wait_for(lambda: f":{WEB_PORT}/" in self.log("web"), lambda: self.log("web"))
        self.lose(web)
        told = int(self.wait_told("web")[1])
        page = WebSocket(WEB_PORT)
        self.addCleanup(page.close)
        state, _ = page.until(lambda frame: frame["type"] == "state")
        self.assertGreaterEqual(state["reception"]["dropped"], told)

    def test_a_broker_is_no_reason_not_to_count_it(self):
        self.broker()
        mqtt = self.mqtt()
        self.wait_connected()
        self.lose(mqtt)
        self.wait_told("mqtt")

    def test_driver_and_bridge_count_it_at_the_command_port(self):
        self.simulator(self.config, "rs485-0")
        for name, process in (("driver-rs485-0", self.driver(self.config, "rs485-0")), ("bridge", self.bridge(self.config))):
            with self.subTest(name):
                wait_for(lambda: any(pid == process.pid for pid, _, _ in sockets()), lambda: self.log(name))
                self.lose(process, COMMAND_PORT)
                self.wait_told(name)

    def test_a_buffer_that_the_host_keeps_small_is_named_with_what_mends_it(self):
        watch = self.watching("setpriv", "--inh-caps=-net_admin", "--bounding-set=-net_admin")
        small = next(size for pid, _, size in sockets() if pid == watch.pid)
        self.lose(watch)
        remedy = self.wait_told("watch")[2]
        if small < ASKED:
            self.assertIn(f"the kernel buffers {small} bytes of this port instead of {ASKED}", remedy)
            self.assertIn(f"sysctl -w net.core.rmem_max={ASKED}", remedy)
        else:
            self.assertEqual(remedy, "")


if __name__ == "__main__":
    unittest.main()
