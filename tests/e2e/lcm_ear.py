"""Receives LCM messages by its published wire protocol, without liblcm: nothing is lost below 64 MB."""

import socket
import struct
import threading

SHORT, FRAGMENT = 0x4C433032, 0x4C433033


class LcmEar:
    """Every message on a group and port since it was made, in `messages`: (channel, data), in order of their ends."""

    def __init__(self, group="239.255.76.67", port=7667):
        self.messages = []
        self.parts = {}
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.setsockopt(socket.SOL_SOCKET, 33, 64 << 20)  # SO_RCVBUFFORCE
        self.socket.bind(("", port))
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                               struct.pack("4s4s", socket.inet_aton(group), socket.inet_aton("0.0.0.0")))
        self.thread = threading.Thread(target=self._hear, daemon=True)
        self.thread.start()

    def _hear(self):
        while True:
            datagram, sender = self.socket.recvfrom(65536)
            if not datagram:
                return
            magic, sequence = struct.unpack_from(">II", datagram)
            if magic == SHORT:
                channel, data = datagram[8:].split(b"\0", 1)
                self._take(channel, data)
            elif magic == FRAGMENT:
                self._part(datagram, (sender, sequence))

    def _part(self, datagram, key):
        _, _, size, offset, number, count = struct.unpack_from(">IIIIHH", datagram)
        payload = datagram[20:]
        message = self.parts.setdefault(key, {"data": bytearray(size), "left": count, "channel": b""})
        if number == 0:
            message["channel"], payload = payload.split(b"\0", 1)
        message["data"][offset:offset + len(payload)] = payload
        message["left"] -= 1
        if message["left"] == 0:
            del self.parts[key]
            self._take(message["channel"], bytes(message["data"]))

    def _take(self, channel, data):
        if channel != b"LCM_SELF_TEST":
            self.messages.append((channel.decode(), data))

    def channels(self):
        return [channel for channel, _ in self.messages]
