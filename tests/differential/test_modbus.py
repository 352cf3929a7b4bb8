"""Modbus RTU: our frames and checks against pymodbus, and `axlecast decode` of the two Modbus families against frames that pymodbus makes."""

import logging
import unittest

from compared import CASES, Compared, decode, flipped, made, resized
from pymodbus.bit_read_message import ReadCoilsResponse, ReadDiscreteInputsResponse
from pymodbus.bit_write_message import WriteSingleCoilResponse
from pymodbus.factory import ClientDecoder, ServerDecoder
from pymodbus.framer.rtu_framer import ModbusRtuFramer
from pymodbus.pdu import ExceptionResponse
from pymodbus.register_read_message import ReadHoldingRegistersResponse, ReadInputRegistersResponse
from pymodbus.register_write_message import WriteMultipleRegistersResponse, WriteSingleRegisterResponse

import libmodbus

READS = {1: ReadCoilsResponse, 2: ReadDiscreteInputsResponse, 3: ReadHoldingRegistersResponse, 4: ReadInputRegistersResponse}
REQUESTS, REPLIES = ServerDecoder(), ClientDecoder()
logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # it reports each damaged frame


def frame(message, unit):
    message.unit_id = unit
    return ModbusRtuFramer(REPLIES).buildPacket(message)


def read_frame(data, unit, decoder=REPLIES):
    """What pymodbus decodes of exactly one frame of this unit; None if it refuses it, waits for more, or leaves bytes over."""
    found = []
    framer = ModbusRtuFramer(decoder)
    try:
        framer.processIncomingPacket(data, found.append, unit)
    except Exception:  # noqa: BLE001 (pymodbus 3.0 raises whatever its decoder comes across)
        return None
    return found[0] if len(found) == 1 and not framer._buffer else None  # pylint: disable=protected-access


def with_crc(data):
    """A frame whose checksum fits, whatever is in it."""
    return libmodbus.with_crc(data)


class Modbus(Compared):
    def exchange(self):
        """(order of our request, its unit, what pymodbus answers, what it must mean)."""
        chance, unit = self.chance, self.chance.randint(1, 247)
        kind, start = chance.choice((1, 2, 3, 4, 3, 4, 5, 6, 16)), chance.randrange(65536)
        if kind in (1, 2):
            bits = [chance.random() < 0.5 for _ in range(chance.randint(1, 2000))]
            return f"read {kind} {unit} {start} {len(bits)}", unit, READS[kind](bits)
        if kind in (3, 4):
            values = [chance.randrange(65536) for _ in range(chance.choice((1, 2, 7, 125, chance.randint(1, 125))))]
            return f"read {kind} {unit} {start} {len(values)}", unit, READS[kind](values)
        if kind == 5:
            on = chance.random() < 0.5
            return f"coil {unit} {start} {int(on)}", unit, WriteSingleCoilResponse(start, on)
        if kind == 6:
            value = chance.randrange(65536)
            return f"register {unit} {start} {value}", unit, WriteSingleRegisterResponse(start, value)
        values = [chance.randrange(65536) for _ in range(chance.randint(1, 123))]
        return f"registers {unit} {start} {' '.join(map(str, values))}", unit, WriteMultipleRegistersResponse(start, len(values))

    def reply(self, answer, unit):
        chance = self.chance
        kind = chance.randrange(8)
        if kind == 0:
            return frame(ExceptionResponse(answer.function_code, chance.randrange(1, 256)), unit)
        good = frame(answer, unit)
        if kind == 1:
            return flipped(good, chance)
        if kind == 2:
            return resized(good, chance, chance.randbytes)
        if kind == 3:  # another content, with a checksum that fits
            return with_crc(flipped(good[:-2], chance, 2))
        if kind == 4:  # a reply to another request
            return frame(self.exchange()[2], unit)
        return good

    @staticmethod
    def expected(request, reply):
        """What the reply to this request means: pymodbus' content, which it does not compare with the request."""
        asked, unit = read_frame(request, request[0], REQUESTS), request[0]
        found = read_frame(reply, unit)
        if found is None:
            return None
        if isinstance(found, ExceptionResponse):
            same = found.original_code == asked.function_code
            return f"exception {found.exception_code}" if same else None
        if found.function_code != asked.function_code:
            return None
        if asked.function_code in (1, 2):
            size = (asked.count + 7) // 8
            return f"ok {reply[3:-2].hex()}" if len(found.bits) == 8 * size and reply[2] == size else None
        if asked.function_code in (3, 4):
            data = b"".join(value.to_bytes(2, "big") for value in found.registers)
            return f"ok {data.hex()}" if len(found.registers) == asked.count else None
        if asked.function_code == 16:
            return "ok " if (found.address, found.count) == (asked.address, asked.count) else None
        return "ok " if (found.address, found.value) == (asked.address, asked.value) and reply == request else None

    def test_requests_and_replies(self):
        exchanges = [self.exchange() for _ in range(CASES)]
        requests = [bytes.fromhex(text) for text in made([order for order, _, _ in exchanges])]
        for (order, unit, answer), request in zip(exchanges, requests, strict=True):
            asked = read_frame(request, unit, REQUESTS)
            self.assertIsNotNone(asked, order)
            self.assertEqual((asked.function_code, asked.unit_id), (answer.function_code, unit), order)
            self.assertEqual(asked.address, int(order.split()[3 if order.startswith("read") else 2]), order)
            if order.startswith("read "):
                self.assertEqual(asked.count, int(order.split()[4]), order)
            elif order.startswith("registers"):
                self.assertEqual(asked.values, [int(value) for value in order.split()[3:]], order)
            else:
                self.assertEqual(int(asked.value), int(order.split()[3]), order)
        replies = [self.reply(answer, unit) for _, unit, answer in exchanges]
        checked = made([f"check {request.hex()} {reply.hex() or '-'}" for request, reply in zip(requests, replies, strict=True)])
        for request, reply, ours in zip(requests, replies, checked, strict=True):
            expected = self.expected(request, reply)
            where = (request.hex(), reply.hex(), expected, ours)
            if expected is None:
                self.refused += 1
                self.assertNotIn(ours.split()[0], ("ok", "exception"), where)
            else:
                self.accepted += 1
                self.assertEqual(ours.strip(), expected.strip(), where)


class Families(Compared):
    def damaged(self, good):
        chance = self.chance
        kind = chance.randrange(6)
        if kind == 0:
            return flipped(good, chance)
        if kind == 1:
            return resized(good, chance, chance.randbytes)
        return with_crc(flipped(good[:-2], chance, 1)) if kind == 2 else good

    def test_saa_modbus_positions(self):
        """5.1.7 (5): one register up to 16 bits, two above; the more significant one first."""
        for bits in range(10, 27):
            frames, unit = [], self.chance.randint(1, 247)
            for _ in range(CASES // 17):
                counts = self.chance.randrange(2**bits)
                registers = [counts] if bits <= 16 else [counts >> 16, counts & 0xFFFF]
                frames.append(self.damaged(frame(ReadHoldingRegistersResponse(registers), unit)) or b"\1")
            for data, ours in zip(frames, decode("saa-modbus", [f"bits={bits}"], [data.hex() for data in frames]), strict=True):
                found, where = read_frame(data, data[0]), (bits, data.hex(), ours)
                # Other functions are the encoder's own, and the requests: tests/peers and the encoder's unit tests.
                if found is None and len(data) > 1 and data[1] in (0x03, 0x83) and len(data) != 8:
                    self.refuse(ours, where)
                elif isinstance(found, ReadHoldingRegistersResponse):
                    counts = sum(value << 16 * place for place, value in enumerate(reversed(found.registers)))
                    # Modbus reserves the other addresses.
                    if not 1 <= len(found.registers) <= 2 or counts >> bits or not 1 <= data[0] <= 247:
                        self.refuse(ours, where)
                        continue
                    self.accepted += 1
                    self.assertEqual((ours["ok"], ours["kind"], ours["address"], ours["counts"]),
                                     (True, "read_position_reply", data[0], counts), where)

    def test_tsubaki_registers(self):
        frames = []
        for _ in range(CASES):
            kind = self.chance.choice((3, 4))
            values = [self.chance.randrange(65536) for _ in range(self.chance.choice((1, 2, 5, 7, 20, 55)))]
            frames.append(self.damaged(frame(READS[kind](values), self.chance.randint(1, 16))) or b"\1")
        for data, ours in zip(frames, decode("tsubaki-sc", [], [data.hex() for data in frames]), strict=True):
            found, where = read_frame(data, data[0]), (data.hex(), ours)
            if found is None and len(data) > 1 and data[1] in (0x03, 0x04) and len(data) != 8:
                self.refuse(ours, where)
            elif isinstance(found, (ReadHoldingRegistersResponse, ReadInputRegistersResponse)) and 1 <= data[0] <= 16:
                if not found.registers:
                    self.refuse(ours, where)
                    continue
                self.accepted += 1
                self.assertEqual((ours["ok"], ours["address"], ours["registers"]), (True, data[0], found.registers), where)


if __name__ == "__main__":
    unittest.main()
