"""A CAN adapter on a serial line, which the kernel's own driver `slcan` makes into a CAN interface: what QEMU's bus
does not model stands here. Its controller counts errors as ISO 11898-1 12.1.4 has it and tells the kernel of its states, so
that a wrong bit rate, an open cable, a short circuit and lost frames look to the kernel as they do on a real adapter.

The bus behind it is a CAN interface of the guest (`wire`): a simulator on the other controller is a node of it.

Protocol: Lawicel CANUSB manual, and of the states and errors drivers/net/can/slcan/slcan-core.c (slc_bump_state,
slc_bump_err)."""

import collections
import fcntl
import os
import select
import socket
import struct
import threading
import time
import tty

N_SLCAN = 17            # linux/tty.h
TIOCSETD = 0x5423
SIOCGIFNAME = 0x8910
BIT_RATES = [10000, 20000, 50000, 100000, 125000, 250000, 500000, 800000, 1000000]  # S0 to S8
WARNING, PASSIVE, BUS_OFF = 96, 128, 256
ATTEMPT_S = 0.002       # between two attempts to send a frame that failed
QUEUE = 16              # frames that the adapter holds


class SlcanAdapter:
    """Its interface is `name`, down at first. The faults of its bus are attributes, changed while it runs."""

    def __init__(self, wire, wire_bitrate=250000):
        self.wire_bitrate = wire_bitrate
        self.plugged = True      # the cable to the other nodes: without it nobody acknowledges
        self.shorted = False     # CAN_H and CAN_L touch: every bit that is sent comes back wrong
        self.bitrate = 0         # that the host has set
        self.is_open = False
        self.commands = []
        self.tec = self.rec = 0
        self.state = "a"
        self.since = {}          # when each state was entered first, and "e": the first error; time.time_ns
        self.lost_at = 0         # when the first frame was lost, likewise
        self.lost = False        # receives frames and has no room for them
        self.waiting = collections.deque()
        self.wire = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.wire.bind((wire,))
        self.master, self.line = os.openpty()
        tty.setraw(self.line)
        fcntl.ioctl(self.line, TIOCSETD, struct.pack("i", N_SLCAN))
        self.name = fcntl.ioctl(self.line, SIOCGIFNAME, bytes(16)).split(b"\0")[0].decode()
        self.done = False
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def pull_out(self):
        """The adapter leaves its socket: the interface goes. Once is enough."""
        if self.done:
            return
        self.done = True
        self.thread.join()
        os.close(self.line)
        os.close(self.master)
        self.wire.close()

    def _run(self):
        text = b""
        again = 0.0
        while not self.done:
            ready, _, _ = select.select([self.master, self.wire], [], [], ATTEMPT_S if self.waiting else 0.02)
            if self.master in ready:
                *lines, text = (text + os.read(self.master, 4096)).split(b"\r")
                for line in lines:
                    self._command(line.decode("ascii"))
            if self.wire in ready:
                self._received(self.wire.recv(16))
            if self.waiting and time.monotonic() >= again:
                again = time.monotonic() + (0 if self._sent(self.waiting[0]) else ATTEMPT_S)

    # -- the host's side

    def _say(self, text):
        os.write(self.master, text.encode() + b"\r")

    def _command(self, line):
        self.commands.append(line)
        if line.startswith("S"):
            self.bitrate = BIT_RATES[int(line[1:])]
        elif line == "O":  # a fresh controller
            self.is_open, self.tec, self.rec, self.state = True, 0, 0, "a"
        elif line == "C":
            self.is_open = False
            self.waiting.clear()
        elif line[:1] in tuple("tTrR") and self.is_open and self.state != "b":
            if len(self.waiting) < QUEUE:
                self.waiting.append(line)
            else:
                self._say("e3OOO")
        self._say("")

    # -- the bus's side

    def _sent(self, line):
        """One attempt at a frame of the host; true when it is off the queue."""
        if self.shorted or (self.plugged and self.bitrate != self.wire_bitrate):
            self.tec += 8  # a bit error, and the others' error flags destroy what follows
            self._tell_errors("BBB")
        elif not self.plugged:
            # An acknowledge error; error passive and with no dominant bit on the bus the counter stays (exception 1).
            self.tec = self.tec if self.tec >= PASSIVE else self.tec + 8
            self._tell_errors("aaa")
        else:
            self.waiting.popleft()
            self.wire.send(frame_of(line))
            self.tec = max(0, self.tec - 1)
            self._tell_state()
            return True
        if self.state == "b":
            self.waiting.clear()
        return False

    def _received(self, frame):
        if not (self.is_open and self.plugged) or self.shorted or self.state == "b":
            return
        if self.bitrate != self.wire_bitrate:
            self.rec = min(self.rec + 8, 135)  # error passive: no further count is of use
            self._tell_errors("sss")
        elif self.lost:
            self.lost_at = self.lost_at or time.time_ns()
            self._say("e3ooo")
        else:
            self.rec = min(119, self.rec - 1) if self.rec >= PASSIVE else max(0, self.rec - 1)
            self._tell_state()
            self._say(line_of(frame))

    def _tell_errors(self, kinds):
        self.since.setdefault("e", time.time_ns())
        # Three letters: slcan ignored shorter messages until Linux 6.14.
        self._say(f"e3{kinds}")
        self._tell_state()

    def _tell_state(self):
        worst = max(self.tec, self.rec)
        state = ("b" if self.tec >= BUS_OFF else "p" if worst >= PASSIVE else "w" if worst >= WARNING else "a")
        if state != self.state:
            self.state = state
            self.since.setdefault(state, time.time_ns())
            self._say(f"s{state}{self.rec:03}{self.tec:03}")


def frame_of(line):
    """The kernel's form of a frame in the adapter's: t1232AABB."""
    digits = 8 if line[0] in "TR" else 3
    identifier = int(line[1:1 + digits], 16)
    length = int(line[1 + digits])
    data = bytes.fromhex(line[2 + digits:])
    flags = (socket.CAN_EFF_FLAG if line[0] in "TR" else 0) | (socket.CAN_RTR_FLAG if line[0] in "rR" else 0)
    return struct.pack("=IB3x8s", identifier | flags, length, data.ljust(8, b"\0"))


def line_of(frame):
    identifier, length, data = struct.unpack("=IB3x8s", frame)
    remote = identifier & socket.CAN_RTR_FLAG
    if identifier & socket.CAN_EFF_FLAG:
        head = f"{'R' if remote else 'T'}{identifier & socket.CAN_EFF_MASK:08X}"
    else:
        head = f"{'r' if remote else 't'}{identifier & socket.CAN_SFF_MASK:03X}"
    return f"{head}{length}" + ("" if remote else data[:length].hex().upper())
