"""Receives LCM by its published wire protocol and decodes by what lcm-gen makes for Python: nothing of axlecast's."""

import socket
import struct
import threading

import lcm_log
from machine import LIMIT, wait_for

GROUP, PORT = "239.255.76.67", 7667
SHORT_MESSAGE = 0x4C433032


class Listener:
    """Every message of the data port, from now on."""

    def __init__(self):
        self.types = lcm_log.generated_types()
        self._messages = []
        self._lock = threading.Lock()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.bind((GROUP, PORT))
        member = socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1")
        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        threading.Thread(target=self._read, daemon=True).start()

    def close(self):
        self._socket.close()

    def _read(self):
        while True:
            try:
                packet = self._socket.recv(65536)
            except OSError:
                return
            magic, _ = struct.unpack_from(">II", packet)
            if magic != SHORT_MESSAGE:
                continue  # none of ours is longer than one datagram
            channel, _, data = packet[8:].partition(b"\0")
            kind = {b"MOTOR": "motor_health_t", b"TRIP": "trip_log_t", b"LIMITS": "motor_limits_t", b"DEVICE": "device_info_t",
                    b"POSITION": "position_t", b"BUS": "bus_health_t", b"ALARM": "alarm_t"}.get(channel.split(b"/")[0])
            if kind is None:
                continue
            message = getattr(self.types, kind).decode(data)
            with self._lock:
                self._messages.append((channel.decode(), message))

    def of(self, channel):
        with self._lock:
            return [message for name, message in self._messages if name == channel]

    def channels(self):
        with self._lock:
            return {name for name, _ in self._messages}

    def last(self, channel):
        with self._lock:
            return next((message for name, message in reversed(self._messages) if name == channel), None)

    def wait(self, channel, condition, what, limit=LIMIT):
        """The first message of `channel`, past or future, that fulfils `condition`."""
        return wait_for(lambda: next((m for m in self.of(channel) if condition(m)), None),
                        lambda: f"{channel}: {what}; last {self._text(self.last(channel))}", limit)

    @staticmethod
    def _text(message):
        return message and {name: getattr(message, name) for name in message.__slots__}
