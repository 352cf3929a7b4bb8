"""Datagrams that LCM never sends, or not like this: malformed, cut, oversized, overlapping, wrapped, of ever new names.

hostile_datagrams.py KIND GENUINE COUNT RATE SEED TTL ADDRESS...

sends COUNT of them, of one KIND or of `all`, at RATE a second, from ever new ports, to ports 7667 and 7668 of the addresses in turn. GENUINE holds
datagrams of the machine, each after its length (u32). Prints how many of each kind were sent, as JSON. It needs nothing
but Python, so that it runs in another network namespace."""

import json
import random
import socket
import struct
import sys
import time

SHORT, FRAGMENT = 0x4C433032, 0x4C433033
PORTS = (7667, 7668)
LARGEST = 65507  # UDP's
BURST = 20


def short(sequence, channel, data):
    return struct.pack(">II", SHORT, sequence) + channel + b"\0" + data


def fragment(sequence, size, offset, number, count, data, channel=b""):
    head = struct.pack(">IIIIHH", FRAGMENT, sequence, size, offset, number, count)
    return head + (channel + b"\0" if number == 0 else b"") + data


def the_one_that_ends_liblcm(sequence=1, channel=b"POSITION/axis1"):
    """Upstream's pull request 628: offset and length wrap around at 2^32."""
    return fragment(sequence, 64, 0xFFFFFFF0, 0, 2, b"x" * 64, channel)


class Hostile:
    def __init__(self, genuine, seed, kind="all"):
        self.chance = random.Random(seed)
        self.genuine = genuine
        self.names = [datagram[8:datagram.index(0, 8)] for datagram in genuine]
        self.sequence = 0
        self.kinds = [name for name in dir(self) if name.startswith("make_") and kind in ("all", name[5:])]
        self.made = dict.fromkeys(self.kinds, 0)

    def next(self):
        """A few datagrams that belong together."""
        kind = self.chance.choice(self.kinds)
        self.sequence = (self.sequence + 1) & 0xFFFFFFFF
        datagrams = getattr(self, kind)()
        self.made[kind] += len(datagrams)
        return datagrams

    def bytes(self, most=1400):
        return self.chance.randbytes(self.chance.randrange(most))

    def name(self):
        return self.chance.choice(self.names)

    def make_noise(self):
        magic = self.chance.choice([b"", b"LC02", b"LC03", b"LC01"])
        return [magic + self.bytes()]

    def make_cut(self):
        datagram = self.chance.choice(self.genuine)
        return [datagram[:self.chance.randrange(len(datagram))]]

    def make_name_without_an_end(self):
        return [struct.pack(">II", SHORT, self.sequence) + b"A" * self.chance.randrange(1400)]

    def make_long_name(self):
        return [short(self.sequence, b"A" * self.chance.randrange(64, 400), self.bytes())]

    def make_garbage_in_a_genuine_channel(self):
        return [short(self.sequence, self.name(), self.bytes())]

    def make_inverted_bits(self):
        datagram = bytearray(self.chance.choice(self.genuine))
        begin = datagram.index(0, 8) + 1
        if bytes(datagram[8:begin]).startswith(b"POSITION/"):
            begin = 0  # what is measured must not be forged as if it were genuine: its header or name is damaged
            datagram[8] ^= 0x20
        for _ in range(self.chance.randint(1, 4)):
            datagram[self.chance.randrange(begin, len(datagram))] ^= 1 << self.chance.randrange(8)
        return [bytes(datagram)]

    def make_new_name(self):
        """A well-formed message of the machine's types on a channel that nobody has received."""
        datagram = self.chance.choice(self.genuine)
        kind = datagram[8:datagram.index(0, 8)].split(b"/")[0]
        name = b"%s/x%010x" % (kind, self.chance.getrandbits(40))
        return [short(self.sequence, name, datagram[datagram.index(0, 8) + 1:])]

    def make_oversized(self):
        if self.chance.random() > 0.05:
            return []  # they are as long as fifty others
        head = short(self.sequence, self.name(), b"")
        return [head + b"x" * (LARGEST - len(head))]

    def make_wrapped_offset(self):
        return [the_one_that_ends_liblcm(self.sequence, self.name())]

    def make_wrapped_length(self):
        return [fragment(self.sequence, 0xFFFFFFFF, self.chance.choice([0xFFFFFFFF, 0x80000000, 0xFFFFFF00]),
                         self.chance.randrange(2), 2, self.bytes(), self.name())]

    def make_wrapped_sequence(self):
        return [short(number & 0xFFFFFFFF, b"X", b"") for number in (0xFFFFFFFE, 0xFFFFFFFF, 0x100000000, 5)]

    def make_overlapping(self):
        data = self.bytes()
        return [fragment(self.sequence, 4000, 0, 0, 3, data, self.name()),
                fragment(self.sequence, 4000, len(data) // 2, 1, 3, self.bytes() + b"x"),
                fragment(self.sequence, 4000, 10, 2, 3, self.bytes() + b"x")]

    def make_contradicting(self):
        return [fragment(self.sequence, size, 0, 0, count, b"x" * 100, self.name())
                for size, count in ((1000, 3), (2000, 3), (1000, 9), (1 << 28, 65535))]

    def make_never_whole(self):
        return [fragment(self.sequence, 14_000, 0, 0, 10, b"x" * 1400, self.name()),
                fragment(self.sequence, 14_000, 1400, 1, 10, b"x" * 1400)]

    def make_no_such_fragment(self):
        return [fragment(self.sequence, 1000, 500, 7, 3, b"x" * 500), fragment(self.sequence, 9, 0, 0, 0, b"", b"A")]

    def make_larger_than_any(self):
        return [fragment(self.sequence, size, 0, 0, 2, b"x" * 1000, self.name()) for size in ((1 << 28) + 1, 1 << 31)]


def read_genuine(path):
    datagrams, data, at = [], open(path, "rb").read(), 0
    while at < len(data):
        size = struct.unpack_from(">I", data, at)[0]
        datagrams.append(data[at + 4:at + 4 + size])
        at += 4 + size
    return datagrams


def write_genuine(path, messages):
    """`messages`: (channel, data), as LcmEar has them."""
    with open(path, "wb") as file:
        for channel, data in messages:
            datagram = short(1, channel.encode(), data)
            file.write(struct.pack(">I", len(datagram)) + datagram)


def new_socket(ttl):
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
    return sender


def main():
    count, rate, seed, ttl = map(float, sys.argv[3:7])
    addresses = sys.argv[7:]
    hostile = Hostile(read_genuine(sys.argv[2]), int(seed), sys.argv[1])
    sender, sent, refused, begin = new_socket(int(ttl)), 0, 0, time.monotonic()
    while sent < count:
        due = min(count, (time.monotonic() - begin) * rate + BURST)
        while sent < due:
            for datagram in hostile.next():
                try:
                    sender.sendto(datagram, (addresses[sent % len(addresses)], PORTS[hostile.chance.randrange(2)]))
                except OSError:
                    refused += 1  # nobody listens there, or the interface is full
                sent += 1
            if hostile.chance.random() < 0.01:
                sender.close()
                sender = new_socket(int(ttl))
        if sent < count:
            time.sleep(1e-3)
    kinds = {kind.removeprefix("make_"): made for kind, made in hostile.made.items()}
    print(json.dumps({"sent": sent, "refused": refused, "seconds": time.monotonic() - begin, "kinds": kinds}))


if __name__ == "__main__":
    main()
