"""Devices for a LateLine, each written from its maker's document: what they measure changes all the time, as a known function
of the clock. Nothing here comes from axlecast's code."""

import struct
from collections import defaultdict

from libmodbus import crc, with_crc
from saa_serial import frame
from sc_unit import REGISTER, ScUnit
from tformat import Encoder

TURN_NS = 20_000_000_000  # so slow that plausibility never helps; longer than any delay


class Samples:
    """What devices have sent, and when it was true: the test's truth."""

    def __init__(self):
        self._at = defaultdict(lambda: defaultdict(list))  # device, value: instants, ns

    def add(self, device, value, now):
        self._at[device][value].append(now)

    def distance(self, device, value, instant):
        """ns from `instant` to the nearest sample of this value; None: the device never sent it."""
        instants = self._at[device].get(value)
        return None if instants is None else min(abs(at - instant) for at in instants)


def shaft(bits, begin=0):
    """A shaft that turns steadily: its position at an instant in counts of 2^-bits turn, without wrapping."""
    return lambda now: begin + now * 2**bits // TURN_NS


class TFormat:
    """The one encoder of a T-format line."""

    def __init__(self, samples):
        self.encoder = Encoder(shaft(17, 3 * 2**17))
        self._samples = samples

    def size(self, begin):
        return Encoder.request_size(begin[0])

    def whose(self, request):
        return 0

    def answer(self, request, now):
        reply = self.encoder.answer(request, now)
        for at, single, _ in self.encoder.samples:
            if single is not None:
                self._samples.add("axis1", single, at)
        self.encoder.samples.clear()
        return reply


class SaaBus:
    """Encoders of the manual's 5.1.5. `units`: control byte BX to (device, bits, second byte of the reply)."""

    def __init__(self, samples, units):
        self._samples, self._units = samples, units
        self._shafts = {control: shaft(bits, index * 2**bits // 3)
                        for index, (control, (_, bits, _)) in enumerate(units.items())}

    def size(self, begin):
        return 3

    def whose(self, request):
        return request[2]

    def answer(self, request, now):
        if request[:2] != b"\xBC\xAA" or request[2] not in self._units:
            return None
        device, bits, second = self._units[request[2]]
        counts = self._shafts[request[2]](now) % 2**bits
        self._samples.add(device, counts, now)
        return frame(counts, bits, second)


def modbus_size(begin):
    """The standard functions that read, write one, or report the slave's ID."""
    if len(begin) < 2:
        return 0
    return {0x11: 4}.get(begin[1], 8) if begin[1] not in (15, 16) else (9 + begin[6] if len(begin) > 6 else 0)


class SaaModbus:
    """Encoders of the manual's 5.1.7. `units`: address to (device, bits, bytes of a reply to two registers)."""

    def __init__(self, samples, units):
        self._samples, self._units = samples, units
        self._shafts = {address: shaft(bits, index * 2**bits // 3)
                        for index, (address, (_, bits, _)) in enumerate(units.items())}

    def size(self, begin):
        return modbus_size(begin)

    def whose(self, request):
        return request[0]

    def answer(self, request, now):
        address, function = request[0], request[1]
        if crc(request[:-2]) != int.from_bytes(request[-2:], "little") or address not in self._units or function != 3:
            return None
        device, bits, of_two = self._units[address]
        first, count = struct.unpack(">HH", request[2:6])
        if first != 0 or count not in (1, 2):
            return None
        counts = self._shafts[address](now) % 2**bits
        size = 2 if count == 1 else of_two
        self._samples.add(device, counts, now)
        return with_crc([address, 3, size, *(counts % 256**size).to_bytes(size, "big")])


class ScBus:
    """Tsubaki's SC units. Each one's voltage register counts hundredths of a second. `units`: address to device."""

    STEP_NS = 10_000_000

    def __init__(self, samples, units):
        self._samples, self._devices = samples, units
        self._units = {address: ScUnit(mfg_number=f"MFG{address:07d}") for address in units}

    def size(self, begin):
        return modbus_size(begin)

    def whose(self, request):
        return request[0]

    def answer(self, request, now):
        address, function = request[0], request[1]
        if crc(request[:-2]) != int.from_bytes(request[-2:], "little") or address not in self._units:
            return None
        unit, device = self._units[address], self._devices[address]
        if function == 0x11:
            return with_crc([address, function, *unit.version])
        first, count = struct.unpack(">HH", request[2:6])
        if function not in (1, 2, 3, 4) or not unit.validate(function, first, count):
            return with_crc([address, function | 0x80, 0x01 if function > 4 else 0x02])
        if function == REGISTER and first <= 100 < first + count:
            voltage = now // self.STEP_NS % 65536
            unit.set_live(voltage=voltage)
            self._samples.add(device, voltage, now)
        values = unit.getValues(function, first, count)
        if function <= 2:
            bits = sum(1 << place for place, value in enumerate(values) if value)
            data = bits.to_bytes((count + 7) // 8, "little")
        else:
            data = struct.pack(f">{count}H", *values)
        return with_crc([address, function, len(data), *data])
