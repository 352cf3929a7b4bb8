"""The Python package receives and sends: beside drivers, stock LCM tools and senders that lose messages."""

import asyncio
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import unittest

import lcm_log
from lcm_log import datagram
from machine import Machine, one_axis, wait_for

PACKAGE = os.environ["AXLECAST_PYTHON_PACKAGE"]
sys.path.insert(0, PACKAGE)
import axlecast  # noqa: E402 pylint: disable=wrong-import-position
from axlecast.receiver import Receiver, Sender  # noqa: E402 pylint: disable=wrong-import-position

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
URL = "udpm://239.255.76.67:7667?ttl=0"
LIMIT = 60  # s


class FromDrivers(Machine):
    def test_positions_of_a_driver(self):
        config = self.write(one_axis())
        with Receiver(URL) as receiver:
            self.simulator(config, "rs485-0")
            self.driver(config, "rs485-0")
            seen = []
            for message in receiver.messages(LIMIT):
                position = receiver.decode(message)
                if isinstance(position, axlecast.position_t):
                    self.assertEqual(message.channel, "POSITION/axis1")
                    seen.append(position)
                if len(seen) == 200:
                    break
            self.assertEqual([position.seq for position in seen], list(range(seen[0].seq, seen[0].seq + len(seen))))
            self.assertEqual((receiver.lost, receiver.lost_by_sender()), (0, {}))
            self.assertEqual(len({position.machine_id for position in seen}), 1)
            self.assertNotEqual(seen[0].clock_id, 0)

    def example(self, *words):
        """Starts a driver and an example; returns a function that reads the example's next line."""
        config = self.write(one_axis())
        self.simulator(config, "rs485-0")
        self.driver(config, "rs485-0")
        example = subprocess.Popen([sys.executable, "-B", SOURCE / "client/example" / words[0], *words[1:]], stdout=subprocess.PIPE,
                                   text=True, env={**os.environ, "PYTHONPATH": PACKAGE})
        self.addCleanup(example.stdout.close)
        self.addCleanup(example.wait)
        self.addCleanup(example.kill)
        return example.stdout.readline

    def test_the_control_loop_knows_the_position(self):
        line = self.example("control_loop.py", "axis1", "--url", URL)
        known = 0
        for _ in range(2_000):
            text = line()
            self.assertRegex(text, r"^(-?\d+\.\d{3} ± \d+\.\d counts|no position: [a-z].*)$")
            known += "counts" in text
            if known == 50:
                return
        self.fail(text)

    def test_the_example_prints_positions(self):
        line = self.example("print_position.py", URL)
        lines = [line() for _ in range(100)]
        self.assertTrue(all(re.fullmatch(r"POSITION/axis1 (-?\d+\.\d{3}|not valid) 0 lost\n", line) for line in lines), lines)
        self.assertIn("example/print_position.py", (SOURCE / "docs/python.md").read_text(encoding="utf-8"))


class StockTools(Machine):
    def test_what_stock_lcm_sends(self):
        sizes = [0, 1, 1_000, 65_000, 70_000, 400_000]
        path = self.folder / "sent.lcm"
        record = struct.Struct(">IqqII")
        data = [bytes(index for index in range(256)) * (size // 256 + 1) for size in sizes]
        data = [whole[:size] for whole, size in zip(data, sizes)]
        path.write_bytes(b"".join(record.pack(0xEDA1DA01, number, 1_000 * number, 5, len(body)) + f"BIG/{number}".encode() + body
                                  for number, body in enumerate(data)))
        with Receiver(URL) as receiver:
            player = subprocess.Popen(["lcm-logplayer", "--lcm-url", URL, path], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            self.addCleanup(player.wait)
            received = {}
            for message in receiver.messages(LIMIT):
                received[message.channel] = message.data
                if len(received) == len(data):
                    break
            self.assertEqual(receiver.lost, 0)
        self.assertEqual(received, {f"BIG/{number}": body for number, body in enumerate(data)})

    def test_what_stock_lcm_receives(self):
        path = self.folder / "received.lcm"
        logger = subprocess.Popen(["lcm-logger", "--lcm-url", URL, "--quiet", path], stdout=subprocess.DEVNULL)
        self.addCleanup(logger.wait)
        self.addCleanup(logger.kill)
        position = axlecast.position_t()
        position.seq, position.value = 77, 1.5
        with Sender(URL, prefix="press3.") as sender:
            def logged():
                sender.publish("READY", b"")
                return path.exists() and b"READY" in path.read_bytes()
            wait_for(logged, "the logger to receive")
            sender.publish("POSITION/axis1", position)
            sender.publish("BIG", bytes(200_000))
            self.assertRaises(ValueError, sender.publish, "x" * 64, b"")

            def ended():
                sender.publish("END", b"")
                return b"press3.END" in path.read_bytes()
            wait_for(ended, "the last message")
        logger.send_signal(signal.SIGINT)
        logger.wait(LIMIT)
        events = [(channel, data) for channel, data in lcm_log.events(path) if not channel.endswith(("READY", "END"))]
        self.assertEqual([channel for channel, _ in events], ["press3.POSITION/axis1", "press3.BIG"])
        self.assertEqual(axlecast.position_t.decode(events[0][1]).seq, 77)
        self.assertEqual(events[1][1], bytes(200_000))


class Loss(unittest.TestCase):
    def setUp(self):
        self.sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
        for sending in self.sockets:
            sending.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            self.addCleanup(sending.close)

    def send(self, sender, message, group="239.255.76.67", port=7667):
        self.sockets[sender].sendto(message, (group, port))

    def test_gaps_of_each_sender(self):
        with Receiver(URL) as receiver:
            for number in range(100):
                if number % 10 != 5:
                    self.send(0, datagram(number, "A"))
                self.send(1, datagram(number, "B"))
            messages = list(receiver.messages(1))
            self.assertEqual((len(messages), receiver.received, receiver.lost), (190, 190, 10))
            self.assertEqual(list(receiver.lost_by_sender().values()), [10])
            self.assertEqual(list(receiver.lost_by_sender())[0][1], self.sockets[0].getsockname()[1])

    def test_other_groups_and_prefixes_and_bytes_are_not_messages(self):
        with Receiver(URL, prefix="press3.") as receiver:
            self.send(0, datagram(0, "press3.A", b"1"))
            self.send(0, datagram(0, "press3.A", b"2"), group="239.255.76.68")
            self.send(0, datagram(1, "press4.A", b"3"))
            self.send(0, b"no message")
            self.send(0, datagram(2, "press3.A", b"4"))
            self.assertEqual([(message.channel, message.data) for message in receiver.messages(1)], [("A", b"1"), ("A", b"4")])

    def test_types_of_others_and_damaged_messages(self):
        position = axlecast.position_t()
        whole = position.encode()
        with Receiver(URL) as receiver:
            for number, data in enumerate((whole, whole[:40], b"", bytes(8) + whole[8:])):
                self.send(0, datagram(number, "POSITION/axis1", data))
            decoded = [receiver.decode(message) for message in receiver.messages(1)]
            self.assertIsInstance(decoded[0], axlecast.position_t)
            self.assertEqual(decoded[1:], [None] * 3)

            class Own:
                @staticmethod
                def _get_packed_fingerprint():
                    return b"12345678"

                @staticmethod
                def decode(data):
                    return data[8:]
            receiver.register(Own)
            self.send(0, datagram(4, "OWN", b"12345678own"))
            self.assertEqual([receiver.decode(message) for message in receiver.messages(1)], [b"own"])

    def test_asyncio(self):
        async def first(receiver, count):
            numbers = []
            async for message in receiver:
                numbers.append(int(message.data))
                if len(numbers) == count:
                    return numbers

        async def run():
            with Receiver(URL) as receiver:
                waiting = asyncio.create_task(first(receiver, 50))
                for number in range(50):
                    await asyncio.sleep(0)
                    self.send(0, datagram(number, "A", str(number).encode()))
                return await asyncio.wait_for(waiting, LIMIT)
        self.assertEqual(asyncio.run(run()), list(range(50)))

    def test_a_full_buffer_is_counted(self):
        with Receiver(URL + "&recv_buf_size=4096") as receiver:
            for number in range(2_000):
                self.send(0, datagram(number, "A", bytes(500)))
            received = len(list(receiver.messages(0)))
            self.send(0, datagram(2_000, "A"))
            self.assertEqual(len(list(receiver.messages(1))), 1)
            self.assertGreater(receiver.lost, 0)
            self.assertEqual(received + 1 + receiver.lost, 2_001)


class Urls(unittest.TestCase):
    def test_an_interface_by_name_address_and_network(self):
        for interface in ("lo", "127.0.0.1", "127.0.0.0/8"):
            url = f"{URL}&interface={interface}"
            with Receiver(url) as receiver, Sender(url) as sender:
                sender.publish("A", interface.encode())
                self.assertEqual([message.data for message in receiver.messages(1)], [interface.encode()])

    def test_ipv6(self):
        url = "udpm://[ff15::6c63:6d]:7667?ttl=0&interface=net1"
        subprocess.run(["ip", "link", "add", "net1", "type", "veth", "peer", "name", "net2"], check=True)
        for name in ("net1", "net2"):
            subprocess.run(["sysctl", "--quiet", "--write", f"net.ipv6.conf.{name}.accept_dad=0"], check=True)
            subprocess.run(["ip", "link", "set", name, "up"], check=True)
        with Receiver(url) as receiver, Sender(url) as sender:
            sender.publish("A", bytes(100_000))
            self.assertEqual([len(message.data) for message in receiver.messages(1)], [100_000])

    def test_what_is_no_url(self):
        for url, cause in (("tcpq://host:1", "only udpm://"), ("239.255.76.67:7667", "only udpm://"), ("udpm://10.0.0.1:7667", "no multicast group"),
                           ("udpm://239.255.76.67", "port must be"), ("udpm://239.255.76.67:0", "port must be"),
                           ("udpm://239.255.76.67:7667?ttl=256", "ttl must be"), ("udpm://:7667", "no multicast group")):
            with self.assertRaisesRegex(ValueError, re.escape(cause)):
                Receiver(url)
        for interface in ("eth77", "10.99.0.0/16"):
            with self.assertRaises(OSError):
                Receiver(f"{URL}&interface={interface}")


if __name__ == "__main__":
    unittest.main()
