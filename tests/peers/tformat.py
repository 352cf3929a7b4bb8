"""Tamagawa's T-format as the maker's specification of the Smart Abs TS5669 N127 describes it: fields, and an encoder that
answers requests. Written from the document alone; nothing here comes from axlecast's code."""

from functools import reduce

STANDBY_NS = 1_000_000_000  # 5.4: at power-on, with a battery
WRITE_NS = 18_000_000  # 8.1: a write to the EEPROM is complete at most this long after its request
RESET_GAP_NS = 40_000_000  # 9: requests of a reset sequence
RESET_REQUESTS = 10
CELLS = 80  # 6.1.1: addresses 0 to 79
ENID = 0x11  # 6.3.3
FIELD_NS = 4_000  # 6.1: 10 bits at 2.5 Mbit/s
REPLY_GAP_NS = 3_000  # 7.1

# Table 1: the four bits of the data ID code, cc0 first, and their parity.
CODES = {"0": "00000", "1": "10001", "2": "01001", "3": "11000", "6": "01100", "D": "10111",
         "7": "11101", "8": "00011", "C": "00110"}
SYNC = "010"  # figure 4: between the start bit and cc0
# Table 2, from DF0 on.
DATA = {"0": ("ABS",), "1": ("ABM",), "2": ("ENID",), "3": ("ABS", "ENID", "ABM", "ALMC"),
        "7": ("ABS",), "8": ("ABS",), "C": ("ABS",)}
# Table 3.
OS, FS, CE, OF, ME, BE, BA = 0x01, 0x02, 0x04, 0x08, 0x20, 0x40, 0x80
LATCHED = OS | CE | OF | ME | BE  # 9: what a reset of all errors clears
COUNTING_ERROR, TURNS_OR_BATTERY, PARITY_ALARM, DELIMITER_ALARM = 0x10, 0x20, 0x40, 0x80  # 6.3.2


def from_bits(bits):
    """A field's byte from its bits in the order of the line: the least significant one first."""
    return sum(1 << place for place, bit in enumerate(bits) if bit == "1")


def control(data_id):
    return from_bits(SYNC + CODES[data_id])


def crc(data):
    """6.3.4: the rest of the division by x^8 + 1, which is each bit place's parity over all bytes."""
    return reduce(lambda a, b: a ^ b, data, 0)


def with_crc(data):
    return bytes(data) + bytes([crc(data)])


def read_request(data_id):
    return bytes([control(data_id)])


def eeprom_read_request(address):
    return with_crc([control("D"), address])


def eeprom_write_request(address, value):
    return with_crc([control("6"), address, value])


def wire_ns(size):
    """How long so many bytes take on the line."""
    return size * FIELD_NS


class Encoder:
    """One encoder. `shaft(ns)` returns the shaft's position at an instant in counts of 1/131072 turn, as a whole number
    that does not wrap. It notes each sample that it sent: (instant, one-revolution data, turns or None)."""

    def __init__(self, shaft, powered_ns=None, alarms=0):
        self.shaft, self.alarms = shaft, alarms
        self.samples = []
        self.cells = [0] * CELLS
        self.rewrites = 0
        self.zero = 0  # counts, one revolution
        self.turn_zero = 0
        self._ready_ns = None if powered_ns is None else powered_ns + STANDBY_NS
        self._writing_until = 0
        self._reset, self._reset_count, self._reset_last = None, 0, 0

    # -- the line

    @staticmethod
    def request_size(begin):
        """The number of bytes of a request that begins with this byte: 6.2."""
        return {control("D"): 3, control("6"): 4}.get(begin, 1)

    def answer(self, request, now):
        """The reply to one request that was complete at `now` (monotonic ns), or None. The sample is taken at `now`."""
        if self._ready_ns is not None and now < self._ready_ns:
            return None  # 5.4, note 2
        if not request or request[0] & 7 != from_bits(SYNC):
            return None  # tables 5 and 6, No. 1
        code = format(request[0] >> 3, "05b")[::-1]
        if code.count("1") % 2:
            return self.all_data(now, request[0], PARITY_ALARM)  # No. 3 and 4
        data_id = next((name for name, bits in CODES.items() if bits == code), None)
        if data_id in ("6", "D"):
            return self._access(data_id, request, now)
        self._count_reset(data_id, now)
        if data_id is None:
            return self.all_data(now, request[0])  # No. 2 and 3
        return self._data(data_id, now, request[0], 0)

    def all_data(self, now, control_field, alarm=0):
        """The data of data ID 3: tables 5 and 6."""
        return self._data("3", now, control_field, alarm)

    # -- data readout

    def _data(self, data_id, now, control_field, alarm):
        shaft = self.shaft(now) - self.zero
        turns = (shaft // 2**17 - self.turn_zero) % 2**16
        single = shaft % 2**17
        has = DATA[data_id]
        if "ABS" in has:
            self.samples.append((now, single, turns if "ABM" in has else None))
        elif "ABM" in has:
            self.samples.append((now, None, turns))
        parts = {"ABS": single.to_bytes(3, "little"), "ABM": turns.to_bytes(3, "little"), "ENID": bytes([ENID]),
                 "ALMC": bytes([self.alarms])}
        body = b"".join(parts[name] for name in has)
        return with_crc(bytes([control_field, self._status() | alarm]) + body)

    def _status(self):
        return (COUNTING_ERROR if self.alarms & CE else 0) | (TURNS_OR_BATTERY if self.alarms & (ME | BE | BA) else 0)

    # -- resets: 9

    def _count_reset(self, data_id, now):
        if data_id not in ("7", "8", "C"):
            self._reset = None
            return
        in_sequence = data_id == self._reset and now - self._reset_last >= RESET_GAP_NS
        self._reset_count = self._reset_count + 1 if in_sequence else 1
        self._reset, self._reset_last = data_id, now
        if self._reset_count == RESET_REQUESTS:
            self._reset = None
            self._do_reset(data_id, now)

    def _do_reset(self, data_id, now):
        if data_id == "8":
            self.zero += (self.shaft(now) - self.zero) % 2**17
            self._writing_until = now + WRITE_NS
            self.rewrites += 1
            return
        if data_id == "C":
            self.turn_zero = (self.shaft(now) - self.zero) // 2**17
        self.alarms &= ~LATCHED

    # -- EEPROM: 6.3.5, 8

    def _access(self, data_id, request, now):
        self._reset = None
        if len(request) != self.request_size(request[0]) or crc(request) or request[1] >= CELLS:
            return self.all_data(now, request[0])
        address = request[1]
        if now < self._writing_until:
            return with_crc([request[0], address | 0x80, 0])  # table 4
        if data_id == "6":
            self.cells[address] = request[2]
            self.rewrites += 1
            self._writing_until = now + WRITE_NS
        return with_crc([request[0], address, self.cells[address]])
