"""BiSS-C as the SAA encoders' manual, 5.6, describes it: frames both ways, sample by sample, and an encoder that plays it on
the socket of a simulated SPI bus (drivers/hal/simulated_spi.h). Nothing here comes from axlecast's code."""

import os
import pathlib
import socket
import struct
import threading

PROTOCOL = b"axlecast-spi-1"


def check(covered, polynomial="1000011", inverted=True):
    """The CRC of a text of bits by long division, start 0."""
    width = len(polynomial) - 1
    rest = [int(bit) for bit in covered + "0" * width]
    for begin in range(len(covered)):
        if rest[begin]:
            for offset, term in enumerate(polynomial):
                rest[begin + offset] ^= int(term)
    return "".join(str(bit ^ inverted) for bit in rest[-width:])


def frame(counts, bits, turns=0, turn_bits=0, error=False, warning=False, **crc):
    """Turns, position, error and warning bit (active low), CRC."""
    covered = f"{turns:0{turn_bits}b}" if turn_bits else ""
    covered += f"{counts:0{bits}b}" + "01"[not error] + "01"[not warning]
    return covered + check(covered, **crc)


def transfer(body, clocks, delay=0, busy=2):
    """What the host samples: high, the acknowledgement from the second rising edge on, start bit, 0, the frame, low."""
    samples = "11" + "1" * delay + "0" * busy + "10" + body
    return (samples + "0" * clocks)[:clocks]


def position(samples, bits):
    """(counts, status bits) of a transfer; ValueError if there is no frame."""
    head, _, rest = samples.partition("0")
    if head != "1" * max(2, len(head)) or "1" not in rest:
        raise ValueError(f"no acknowledgement and start bit: {samples}")
    after = rest[rest.index("1") + 1:]
    body = after[1:1 + bits + 2 + 6]
    if after[0] != "0" or check(body[:-6]) != body[-6:]:
        raise ValueError(f"no frame: {samples}")
    return int(body[:bits], 2), body[bits:bits + 2]


class Encoder:
    """Answers every transfer with samples_of(n, clocks); keeps the settings of each."""

    def __init__(self, path, samples_of):
        self.samples_of, self.settings = samples_of, []
        path = pathlib.Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.listener.bind(str(path))
        self.listener.listen(1)
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        try:
            while True:
                host, _ = self.listener.accept()
                host.send(PROTOCOL)
                while packet := host.recv(512):
                    self.settings.append(struct.unpack(">BBI", packet[:6]))
                    clocks = 8 * (len(packet) - 6)
                    samples = self.samples_of(len(self.settings) - 1, clocks)
                    host.send(int(samples, 2).to_bytes(clocks // 8, "big"))
                host.close()
        except OSError:
            pass  # the test is over

    def close(self):
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()


class Master:
    """Clocks the device behind the socket of a simulated SPI bus."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.settimeout(10)
        self.socket.connect(os.fspath(path))
        greeting = self.socket.recv(512)
        if greeting != PROTOCOL:
            raise ValueError(f"not {PROTOCOL} but {greeting}")

    def clock(self, octets, mode=2, hertz=1_000_000, word=8):
        self.socket.send(struct.pack(">BBI", mode, word, hertz) + bytes(octets))
        answer = self.socket.recv(512)
        return f"{int.from_bytes(answer, 'big'):0{8 * octets}b}"

    def close(self):
        self.socket.close()
