"""What the tests of `axlecast record` share: a sender of LCM messages, a recorder that listens, what a log holds of it."""

import json
import signal
import socket
import struct
import threading

import lcm_log
from machine import BIN, Machine, wait_for

GROUP, PORT = "239.255.76.67", 7667
URL = f"udpm://{GROUP}:{PORT}?ttl=0"
OWN = ("RECORDER/test", "ALARM/recorder/test")  # what a recorder reports about itself


class Sender:
    """One LCM process's sending side, with its numbers (short messages of the wire protocol)."""

    def __init__(self, port=PORT):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.address = (GROUP, port)
        self.sent = 0

    def send(self, count=1, channel="T", size=50):
        for _ in range(count):
            head = struct.pack(">II", 0x4C433032, self.sent) + channel.encode() + b"\0"
            self.socket.sendto(head + struct.pack(">I", self.sent).ljust(size, b"."), self.address)
            self.sent += 1

    def own_port(self):
        return self.socket.getsockname()[1]


def numbers(events, channel="T"):
    return [struct.unpack_from(">I", data)[0] for name, data in events if name == channel]


class Recorder(Machine):
    """Base of the tests of `axlecast record`."""

    def setUp(self):
        super().setUp()
        self.log_path = self.folder / "a.lcm"
        self.sender = Sender()
        self.addCleanup(self.sender.socket.close)

    def record(self, *options, url=URL, name="record", env=None):
        """A recorder that listens."""
        return self.recorder(*options, "--url", url, "--name", "test", name=name, env=env)

    def recorder(self, *options, name="record", env=None):
        process = self.start(name, BIN / "axlecast", "record", *options, "--json", env=env)
        wait_for(lambda: self.lines(name, "start") or process.poll() is not None, "the recorder to listen")
        self.assertIsNone(process.poll(), self.log(name))
        return process

    def lines(self, name, kind):
        found = []
        for line in self.log(name).splitlines():
            if line.startswith("{") and (message := json.loads(line))["kind"] == kind:
                found.append(message)
        return found

    def end(self, process, name="record"):
        """Exit code and summary after Ctrl-C."""
        process.send_signal(signal.SIGINT)
        code = process.wait(30)
        return code, self.lines(name, "end")[-1]

    def recorded(self, path=None):
        return numbers(lcm_log.events(path or self.log_path))

    def readable(self):
        try:
            return len(self.recorded())
        except (ValueError, struct.error):
            return 0

    def watch_health(self):
        """A function that gives the recorder's newest health."""
        return self.newest_of("RECORDER/test", "recorder_health_t")

    def watch_alarms(self):
        """A function that gives the recorder's newest alarms."""
        return self.newest_of("ALARM/recorder/test", "alarm_t")

    def newest_of(self, channel, kind):
        """A function that gives the newest message, decoded by what lcm-gen makes; None before the first."""
        types = lcm_log.generated_types()
        listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((GROUP, PORT))
        listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + bytes(4))
        listener.settimeout(0.2)
        newest, end = [], threading.Event()

        def listen():
            while not end.is_set():
                try:
                    of, data = listener.recv(65536)[8:].split(b"\0", 1)
                except TimeoutError:
                    continue
                if of == channel.encode():
                    newest[:] = [getattr(types, kind).decode(data)]

        thread = threading.Thread(target=listen)
        thread.start()
        self.addCleanup(listener.close)
        self.addCleanup(thread.join)
        self.addCleanup(end.set)
        return lambda: newest[0] if newest else None
