"""Two hosts: this network, and a second network namespace that links connect with it. For tests of what one host sends to another."""

import socket
import subprocess
import unittest


def ip(*words):
    subprocess.run(("ip", *words), check=True)


class Host:
    """A network of its own, without processes."""

    def __init__(self):
        self.holder = subprocess.Popen(("unshare", "--net", "sh", "-c", "echo; exec sleep infinity"), stdout=subprocess.PIPE)
        self.holder.stdout.readline()  # it has its network
        self.ip("link", "set", "lo", "up")

    def words(self, *words):
        """The command that runs `words` in this network."""
        return ("nsenter", "--target", str(self.holder.pid), "--net", *map(str, words))

    def ip(self, *words):
        subprocess.run(self.words("ip", *words), check=True)

    def close(self):
        self.holder.kill()
        self.holder.wait()
        self.holder.stdout.close()


class Capture:
    """Counts the UDP datagrams to some ports on an interface of this network, in both directions."""

    def __init__(self, interface, ports):
        self.socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))  # ETH_P_ALL
        self.socket.bind((interface, 0))
        self.socket.setblocking(False)
        self.ports = {port.to_bytes(2, "big") for port in ports}
        self.frames = 0

    def count(self):
        while True:
            try:
                frame = self.socket.recv(65536)
            except BlockingIOError:
                return self.frames
            kind = frame[12:14]
            header = {b"\x08\x00": 14 + 20, b"\x86\xdd": 14 + 40}.get(kind)
            self.frames += header is not None and frame[header + 2:header + 4] in self.ports

    def close(self):
        self.socket.close()


class LinkedHosts(unittest.TestCase):
    """Base: `self.other` is the other host; link(1) makes a link with the interface eth1 at both ends."""

    def setUp(self):
        super().setUp()
        self.other = Host()
        self.addCleanup(self.other.close)

    def link(self, number):
        name = f"eth{number}"
        ip("link", "add", name, "type", "veth", "peer", "name", name, "netns", str(self.other.holder.pid))
        ip("address", "add", f"10.{number}.0.1/24", "dev", name)
        self.other.ip("address", "add", f"10.{number}.0.2/24", "dev", name)
        self.other.ip("link", "set", name, "up")
        ip("link", "set", name, "up")
        self.addCleanup(subprocess.run, ("ip", "link", "del", name), check=False, stderr=subprocess.DEVNULL)

    def capture(self, interface, ports=(7667, 7668)):
        capture = Capture(interface, ports)
        self.addCleanup(capture.close)
        return capture
