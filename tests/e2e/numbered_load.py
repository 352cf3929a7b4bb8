"""A sender in a process of its own: numbered LCM messages at a steady rate until SIGTERM.

numbered_load.py COUNT_FILE RATE

COUNT_FILE holds 8 bytes: how many messages the kernel has taken, and on loopback delivered, so far. A message's data: its
number and the instant before it was sent (CLOCK_MONOTONIC, ns)."""

import mmap
import signal
import socket
import struct
import sys
import time

DATA = struct.Struct("<Iq")
CHANNEL = "LOAD"
BYTES = 400


def main():
    count_file, rate = sys.argv[1], float(sys.argv[2])
    with open(count_file, "r+b") as file:
        shared = mmap.mmap(file.fileno(), 8)
    ended = []
    signal.signal(signal.SIGTERM, lambda *_: ended.append(True))
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    sender.connect(("239.255.76.67", 7667))
    sent, begin = 0, time.monotonic()
    while not ended:
        due = int((time.monotonic() - begin) * rate) + 1
        for number in range(sent, min(due, sent + 100)):
            head = struct.pack(">II", 0x4C433032, number) + CHANNEL.encode() + b"\0"
            sender.send(head + DATA.pack(number, time.monotonic_ns()).ljust(BYTES, b"."))
            struct.pack_into("<q", shared, 0, number + 1)
            sent = number + 1
        if sent >= due:
            time.sleep(1e-3)


if __name__ == "__main__":
    main()
