"""Our driver of SAA encoders on Modbus against pymodbus as the encoders, on time and late."""

import struct
import time
import unittest

from cable import Cable
from lcm_listener import Listener
from machine import Machine, wait_for
from pymodbus.interfaces import IModbusSlaveContext
from sc_unit import ModbusServer

VALID = 0x1


class Encoder(IModbusSlaveContext):
    """Manual 5.1.7: function 03 at address 0, one register up to 16 bits, two above, top byte first."""

    def __init__(self, counts, registers, step=0):
        self.counts, self.registers, self.step = counts, registers, step
        self.read_at = {}  # counts: monotonic ns

    def validate(self, function, address, count=1):
        return function == 3 and address == 0 and count == self.registers

    def getValues(self, function, address, count=1):  # noqa: N802 (pymodbus's name)
        self.counts += self.step
        self.read_at[self.counts] = time.monotonic_ns()
        return list(struct.unpack(">2H", struct.pack(">I", self.counts)))[2 - count:]

    def setValues(self, function, address, values):  # noqa: N802 (pymodbus's name)
        raise AssertionError("nothing writes here")


class SaaModbus(Machine):
    def run_bus(self, encoders, bits, keys=""):
        self.cable = Cable()
        self.addCleanup(self.cable.close)
        self.listener = Listener()
        self.addCleanup(self.listener.close)
        self.encoders = encoders
        server = ModbusServer(self.cable.peer, encoders)
        self.addCleanup(server.close)
        devices = "".join(f"      axis{a}: {{address: {a}, bits: {bits}, unit: deg{keys}}}\n" for a in encoders)
        config = self.write(f"""machine: test
buses:
  rs485-0:
    family: saa_modbus
    link: {{port: {self.cable.host}, pty: true}}
    devices:
{devices}""")
        self.driver(config, "rs485-0", family="saa-modbus")

    def valid(self, axis):
        return [m for m in self.listener.of(f"POSITION/{axis}") if m.flags & VALID]

    def test_one_register(self):
        self.run_bus({1: Encoder(383, 1), 247: Encoder(16383, 1)}, 14)
        for address, counts, angle in ((1, 383, 8.4155), (247, 16383, 359.9780)):
            wait_for(lambda: len(self.valid(f"axis{address}")) > 20, "positions")
            self.assertEqual({m.raw_counts for m in self.valid(f"axis{address}")}, {counts})
            self.assertAlmostEqual(self.valid(f"axis{address}")[-1].value, angle, delta=1e-4)
        # 5.1.7 (5) gives this request byte for byte.
        self.assertIn(bytes.fromhex("01 03 00 00 00 01 84 0A"), {d for _, who, d in self.cable.passed if who == "host"})

    def test_two_registers(self):
        self.run_bus({1: Encoder(2**26 - 2, 2)}, 26)
        wait_for(lambda: len(self.valid("axis1")) > 20, "positions")
        self.assertEqual({m.raw_counts for m in self.valid("axis1")}, {2**26 - 2})
        self.assertIn(bytes.fromhex("01 03 00 00 00 02 C4 0B"), {d for _, who, d in self.cable.passed if who == "host"})

    def test_a_late_reply_never_becomes_another_value(self):
        """The counts of each reply show whose it is and when it was read. Unit 1 is often late by up to 0.3 s: more than
        the timeout, several requests of the other unit and the next one of its own; less than late_us."""
        first, second = 1000, 40000
        self.run_bus({1: Encoder(first, 1, step=1), 2: Encoder(second, 1, step=1)}, 16, ", timeout_us: 20000")
        number = [0]

        def late(reply):
            if reply[0] != 1:
                return 0.0
            number[0] += 1
            return (0, 0, 0.015, 0.03, 0.05, 0, 0.08, 0, 0.3)[number[0] % 9]

        self.cable.delay = late
        wait_for(lambda: number[0] > 60 and len(self.valid("axis1")) > 20 and len(self.valid("axis2")) > 60,
                 lambda: f"{number[0]} replies, {len(self.valid('axis1'))} and {len(self.valid('axis2'))} positions")
        self.assertGreater(self.listener.last("DEVICE/axis1").errors[0], 5, "there were time-outs")
        for axis, encoder in (("axis1", self.encoders[1]), ("axis2", self.encoders[2])):
            for message in self.valid(axis):
                self.assertIn(message.raw_counts, encoder.read_at, f"{axis} shows a value that is not its own")
                read_at = encoder.read_at[message.raw_counts]
                # The true instant lies within the interval that the driver gives; the slack is this process's.
                self.assertLessEqual(abs(message.mono_ns - read_at), message.time_uncertainty_ns + 5_000_000, axis)


if __name__ == "__main__":
    unittest.main(verbosity=2)
