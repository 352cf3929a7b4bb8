#!/usr/bin/env python3
"""Joins two LCM command ports and passes what goes over the one on to the other, in both directions: late, twice, in
another order, or not at all. Two machine's files that differ in lcm.command_url only, one for each side, put it between
processes that would otherwise share a port.

    lossy_relay.py 7668 7768 --loss 0.3 --duplication 0.1 --delay-ms 30 --seed 1

Prints `ready` when it listens, and its figures as JSON at SIGTERM. For one host: everything stays on lo."""

import argparse
import heapq
import json
import random
import select
import signal
import socket
import time

GROUP = "239.255.76.67"
LARGEST = 65536
FIGURES = ("received", "lost", "doubled", "passed", "overtaken")


class Side:
    """One port: receives on it, and sends on it from a socket of its own, by whose port it knows its own datagrams."""

    def __init__(self, port):
        self.port = port
        self.listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
        self.listener.bind((GROUP, port))
        membership = socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1")
        self.listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        self.listener.setblocking(False)
        self.speaker = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.speaker.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.speaker.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        self.speaker.bind(("", 0))

    def heard(self):
        """The datagrams of others that have come."""
        own = self.speaker.getsockname()[1]
        while True:
            try:
                data, sender = self.listener.recvfrom(LARGEST)
            except BlockingIOError:
                return
            if sender[1] != own:
                yield data

    def speak(self, data):
        self.speaker.sendto(data, (GROUP, self.port))


class Relay:
    def __init__(self, ports, loss, duplication, delay_s, seed):
        self.sides = [Side(port) for port in ports]
        self.loss, self.duplication, self.delay_s = loss, duplication, delay_s
        self.chance = random.Random(seed)
        self.under_way = []  # (when, number, side, data), a heap
        self.number = 0
        self.newest_passed = [0, 0]  # by side: the highest number that was handed over
        self.figures = dict.fromkeys(FIGURES, 0)

    def take(self, side, data):
        self.figures["received"] += 1
        copies = 1
        if self.chance.random() < self.duplication:
            self.figures["doubled"] += 1
            copies = 2
        for _ in range(copies):
            if self.chance.random() < self.loss:
                self.figures["lost"] += 1
                continue
            self.number += 1
            when = time.monotonic() + self.chance.uniform(0, self.delay_s)
            heapq.heappush(self.under_way, (when, self.number, side, data))

    def pass_on(self):
        while self.under_way and self.under_way[0][0] <= time.monotonic():
            _, number, side, data = heapq.heappop(self.under_way)
            if number < self.newest_passed[side]:
                self.figures["overtaken"] += 1
            self.newest_passed[side] = max(number, self.newest_passed[side])
            self.sides[side].speak(data)
            self.figures["passed"] += 1

    def run(self, stopped):
        listeners = [side.listener for side in self.sides]
        while not stopped():
            until = self.under_way[0][0] - time.monotonic() if self.under_way else 0.2
            select.select(listeners, [], [], min(max(until, 0), 0.2))
            for index, side in enumerate(self.sides):
                for data in side.heard():
                    self.take(1 - index, data)
            self.pass_on()


def share(text):
    value = float(text)
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError("0 to 1")
    return value


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ports", type=int, nargs=2, metavar="PORT")
    parser.add_argument("--loss", type=share, default=0, help="share of datagrams, of each copy")
    parser.add_argument("--duplication", type=share, default=0, help="share of datagrams")
    parser.add_argument("--delay-ms", type=float, default=0, help="at most, evenly spread: reorders")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    relay = Relay(options.ports, options.loss, options.duplication, options.delay_ms / 1000, options.seed)
    stop = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.append(True))
    print("ready", flush=True)
    relay.run(lambda: stop)
    print(json.dumps(relay.figures), flush=True)


if __name__ == "__main__":
    main()
