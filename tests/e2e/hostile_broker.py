"""A broker that takes the connection and then sends what no broker should, of every type of MQTT packet (OASIS MQTT 5.0,
chapter 3), some of it malformed; and another one that is well behaved from a moment on."""

import random
import socket
import struct
import threading

CONNACK = bytes([0x20, 3, 0, 0, 0])

# libmosquitto 2.0.11 logs a property that it does not know without a client, and its logger asserts that there is one.
UNKNOWN_PROPERTY = bytes.fromhex("99 04 d0 2c 25 67")


def packet(kind, body, flags=0):
    return bytes([kind << 4 | flags]) + varint(len(body)) + body


def varint(number):
    text = b""
    while True:
        text += bytes([number % 128 | (0x80 if number > 127 else 0)])
        number //= 128
        if number == 0:
            return text


def hostile_packets(seed=1):
    """Name and bytes of each: every type with nothing, with an unknown property, with a property longer than the packet, with
    random bytes, and packets that announce more than they bring."""
    chance = random.Random(seed)
    yield "the SUBACK that was seen", UNKNOWN_PROPERTY
    for kind in range(16):
        yield f"type {kind}, empty", packet(kind, b"")
        for head in (b"", b"\x00", b"\x00\x01", b"\x00\x00", b"\x00\x01\x00", b"\x00\x01t"):
            yield f"type {kind}, {head.hex()} and an unknown property", packet(kind, head + b"\x25\x67" + b"\0" * 36)
            yield f"type {kind}, {head.hex()} and a property beyond its end", packet(kind, head + b"\x05\x26\xff\xff\x41\x41")
        for _ in range(4):
            yield f"type {kind}, random", packet(kind, chance.randbytes(chance.randrange(1, 60)), chance.randrange(16))
        yield f"type {kind}, 256 MB announced", bytes([kind << 4]) + b"\xff\xff\xff\x7f" + b"\0" * 1000
        yield f"type {kind}, a length without end", bytes([kind << 4]) + b"\xff" * 6
    for properties in (b"\x25\x67", b"\x03\x21\x00\x00", b"\x05\x27\x00\x00\x00\x00", b"\x02\x24\x00", b"\x02\x25\x00"):
        yield "a second CONNACK", packet(2, b"\x00\x00" + properties)
    yield "a message of QoS 2, again and again", b"".join(packet(3, b"\x00\x01t" + struct.pack("!H", i) + b"\x00x", 4) for i in range(1, 200))
    yield "confirmations of what was never sent", b"".join(packet(4, struct.pack("!H", i)) for i in range(1, 500))


class HostileBroker:
    """Listens on `port`; each connection gets the next of `packets` after its CONNACK and is held until the other side ends
    it. `sent`: the names of what was sent."""

    def __init__(self, packets, port):
        self.packets = iter(packets)
        self.sent = []
        self.links = []
        self.listener = socket.socket()
        self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.listener.bind(("127.0.0.1", port))
        self.listener.listen()
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while True:
            try:
                link, _ = self.listener.accept()
            except OSError:
                return
            self.links.append(link)
            threading.Thread(target=self._serve, args=(link,), daemon=True).start()

    def _serve(self, link):
        try:
            link.recv(65536)  # CONNECT
            name, data = next(self.packets, ("nothing", b""))
            link.sendall(CONNACK + data)
            self.sent.append(name)
            while link.recv(65536):
                pass
        except OSError:
            pass
        finally:
            link.close()

    def close(self):
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()
        for link in self.links:
            try:
                link.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
