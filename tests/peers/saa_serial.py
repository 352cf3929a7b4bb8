"""The serial protocol of the SAA encoders as the maker's manual, 5.1.1 to 5.1.6, describes it: frames both ways, and an
encoder that plays it on a pty. Nothing here comes from axlecast's code."""

import os
import pty
import select
import threading
import time
import tty


def data_bytes(bits):
    """5.1.1 (2): two up to 16 bits, three up to 24, four above."""
    return 2 if bits <= 16 else 3 if bits <= 24 else 4


def frame(counts, bits, second=0x81):
    """FF, 81 or the address, the data with the top byte first, the low 8 bits of the sum of all before."""
    body = bytes([0xFF, second]) + counts.to_bytes(data_bytes(bits), "big")
    return body + bytes([sum(body) % 256])


def positions(stream, bits, second=0x81):
    """The counts of a stream's frames, each found where the last one ended; ValueError where none is."""
    size = data_bytes(bits) + 3
    found = []
    for begin in range(0, len(stream) - size + 1, size):
        piece = stream[begin:begin + size]
        if piece[:2] != bytes([0xFF, second]) or sum(piece[:-1]) % 256 != piece[-1]:
            raise ValueError(f"no frame at byte {begin}: {piece.hex(' ')}")
        found.append(int.from_bytes(piece[2:-1], "big"))
    return found


class Pty:
    """One end for the peer, and `path` for our program."""

    def __init__(self):
        self.master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self.stopped = threading.Event()

    def close(self):
        self.stopped.set()
        self.thread.join()
        os.close(self.master)
        os.close(self._slave)

    def run(self, body):
        self.thread = threading.Thread(target=body, daemon=True)
        self.thread.start()


class Streamer(Pty):
    """An encoder in timing mode: one frame a period, of `counts_of(n)`, with `noise(n)` before it."""

    def __init__(self, bits, hertz, counts_of, noise=lambda n: b""):
        super().__init__()
        self.sent = []  # (monotonic ns just before the frame, counts)
        self._bits, self._period, self._counts_of, self._noise = bits, 1 / hertz, counts_of, noise
        self.run(self._stream)

    def _stream(self):
        due = time.monotonic()
        n = 0
        while not self.stopped.wait(max(0.0, due - time.monotonic())):
            counts = self._counts_of(n)
            noise = self._noise(n)
            self.sent.append((time.monotonic_ns(), counts))
            os.write(self.master, noise + frame(counts, self._bits))
            # An encoder does not make up for lost time, as this process could have to.
            due = max(due + self._period, time.monotonic() + 0.5 * self._period)
            n += 1


class PolledEncoders(Pty):
    """Encoders in bus mode with zero clearing. `units`: control byte BX to an object with counts(), zero() and
    second, the second byte of its replies."""

    def __init__(self, bits, units):
        super().__init__()
        self._bits, self._units = bits, units
        self.unknown = []
        self.run(self._answer)

    def _answer(self):
        heard = b""
        while not self.stopped.is_set():
            if not select.select([self.master], [], [], 0.05)[0]:
                continue
            heard += os.read(self.master, 256)
            while len(heard) >= 3:
                command, heard = heard[:3], heard[3:]
                self._take(command)

    def _take(self, command):
        """5.1.6: BC AA BX asks; BC AA CX, "generally" with the same X, clears to zero and is not answered."""
        if command[:2] == b"\xBC\xAA" and command[2] in self._units:
            unit = self._units[command[2]]
            os.write(self.master, frame(unit.counts(), self._bits, unit.second))
        elif command[:2] == b"\xBC\xAA" and command[2] - 0x10 in self._units:
            self._units[command[2] - 0x10].zero()
        else:
            self.unknown.append(command)
