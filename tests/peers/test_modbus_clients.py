"""mbpoll and libmodbus against our simulators, compared with the makers' documents."""

import re
import subprocess
import time
import unittest

from libmodbus import Client, NoAnswer, Refused, with_crc
from machine import Machine
from sc_unit import BLOCKS, COIL, HOLDING, INPUT, LOGGED_IN, REGISTER, characters

FUNCTION, ADDRESS, DATA, LOGIN = 1, 2, 3, 4  # error codes: guideline 5
SAMPLES = 20


class Clients(Machine):
    def simulate(self, bus):
        self.config = self.write(f"machine: test\nbuses:\n  rs485-0:\n{bus}")
        self.simulator(self.config, "rs485-0")
        return next(self.run_dir.glob("**/rs485-0.pty"))

    def refused(self, code, act):
        with self.assertRaises(Refused) as refusal:
            act()
        self.assertEqual(refusal.exception.code, code)

    def mbpoll(self, baud, slave, table, first, count=1, write=()):
        """{address: value} as mbpoll prints it, with addresses as in the documents."""
        time.sleep(0.12)  # guideline 3: at least 0.1 s before the next command
        command = ["mbpoll", "-m", "rtu", "-b", str(baud), "-P", "none", "-a", str(slave), "-t", table, "-0", "-r",
                   str(first), "-1", "-q"]
        command += ["-c", str(count), str(self.port)] if not write else [str(self.port), *map(str, write)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=30)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return {int(address): int(value) for address, value in re.findall(r"\[(\d+)\]:\s+(-?\d+)", done.stdout)}


class ScUnits(Clients):
    UNIT = """    family: tsubaki_sc
    simulate:
      timing: {%s}
      gm1: {mains_hz: 60, dip_set: 2, version: "02 1f", product_code: SC02, mfg_number: "0123456789", voltage_v: 220,
            temperature_c: -12.5, ambient_c: -12.5, thermal_s: 100000, accel_x_mps2: 1.5, accel_y_mps2: -2.25,
            accel_z_mps2: 9.81, parameters: "14=4321 52=800 54=5"}
    devices:
      gm1: {address: 16}
"""

    def run_simulator(self, timing="reading: none, pace: unpaced"):
        self.port = self.simulate(self.UNIT % timing)

    def connect(self, timeout=1.0):
        client = Client(self.port, 9600, timeout)
        self.addCleanup(client.close)
        client.address(16)
        return client

    def test_mbpoll_reads_what_was_set(self):
        self.run_simulator("reading: A")
        self.assertEqual(self.mbpoll(9600, 16, "1", 0), {0: 1})  # on: 60 Hz
        live = self.mbpoll(9600, 16, "3", 100, 7)
        signed = {address: value - 65536 if address >= 103 and value > 32767 else value for address, value in live.items()}
        self.assertEqual(signed[100], 2200)
        self.assertAlmostEqual(signed[103], -125, delta=2)
        self.assertEqual([signed[104], signed[105], signed[106]], [150, -225, 981])
        self.assertEqual(self.mbpoll(9600, 16, "3", 200, 5), {200: 0, 201: 0, 202: 0, 203: 0, 204: 0})
        self.assertEqual(self.mbpoll(9600, 16, "4", 52, 3)[52], 800)
        self.assertEqual(self.mbpoll(9600, 16, "4", 54), {54: 5})
        # Guideline 10: what holds now, of DIP set 2 at 60 Hz.
        parameters = self.mbpoll(9600, 16, "4", 0, 55)
        self.assertEqual(len(parameters), 55)
        self.assertEqual(list(self.mbpoll(9600, 16, "3", 0, 9).values()),
                         [parameters[address] for address in (14, 16, 18, 20, 21, 22, 23, 24, 25)])
        self.assertEqual(list(self.mbpoll(9600, 16, "4", 350, 5).values()), characters("0123456789", 5))
        self.assertEqual(list(self.mbpoll(9600, 16, "4", 300, 2).values()), characters("SC02", 2))
        self.assertEqual(self.mbpoll(9600, 16, "0", 100), {100: 0})

        # Writing, with the login that the unit was delivered with.
        self.mbpoll(9600, 16, "4", 100, write=characters("password", 8))
        self.assertEqual(self.mbpoll(9600, 16, "3", 300), {300: LOGGED_IN})
        self.mbpoll(9600, 16, "4", 54, write=[7])
        self.assertEqual(self.mbpoll(9600, 16, "4", 54), {54: 7})
        self.mbpoll(9600, 16, "0", 100, write=[1])
        self.assertEqual(self.mbpoll(9600, 16, "0", 100), {100: 1})
        self.mbpoll(9600, 16, "0", 200, write=[1])
        self.assertEqual(self.mbpoll(9600, 16, "0", 200), {200: 0})
        self.assertEqual(self.mbpoll(9600, 16, "0", 100), {100: 0})

    def test_every_address_of_the_list_and_no_other(self):
        self.run_simulator()
        client = self.connect()
        read = {COIL: client.coils, INPUT: client.inputs, REGISTER: client.input_registers, HOLDING: client.holding}
        for table, first, last, whole in BLOCKS:
            if (table, first) == (HOLDING, 200):
                continue  # the password: below
            with self.subTest(table=table, first=first):
                self.assertEqual(len(read[table](first, last - first + 1)), last - first + 1)
                for wrong in (lambda: read[table](first, last - first + 2), lambda: read[table](last + 1)):
                    self.refused(ADDRESS, wrong)
                if whole:
                    with self.assertRaises(Refused):
                        read[table](first)
                else:
                    self.assertEqual(read[table](last), read[table](first, last - first + 1)[-1:])
        self.assertEqual(client.holding(100, 8), [0] * 8)  # "[NULL (0x00)] of 16 characters is read"

    def test_error_codes_and_login(self):
        self.run_simulator()
        client = self.connect()
        self.assertEqual(client.raw([16, 0x07], 5), with_crc([16, 0x87, FUNCTION]))
        self.assertEqual(client.raw([16, 0x11], 6), with_crc([16, 0x11, 0x02, 0x1F]))  # guideline 12: no byte count
        self.refused(LOGIN, lambda: client.write_coil(100, 1))
        self.refused(LOGIN, lambda: client.write_register(54, 9))
        self.refused(LOGIN, lambda: client.holding(200, 8))
        self.refused(ADDRESS, lambda: client.write_coil(99, 1))  # 02 is discovered before 04
        self.refused(LOGIN, lambda: client.write_registers(100, characters("wrong-one", 8)))
        self.refused(DATA, lambda: client.write_registers(100, characters("short", 8)))
        self.assertEqual(client.input_registers(300), [0x0000])
        client.write_registers(100, characters("password", 8))
        self.assertEqual(client.input_registers(300), [LOGGED_IN])
        self.assertEqual(client.holding(200, 8), characters("password", 8))
        self.assertEqual(client.raw([16, 0x05, 0, 100, 0x12, 0x34], 5), with_crc([16, 0x85, DATA]))
        client.write_registers(0, [10000] * 8)
        self.assertEqual(client.holding(0, 8), [10000] * 8)
        self.set_simulated(self.config, "rs485-0", "gm1", power="cycle")
        self.assertEqual(client.input_registers(300), [0x0000], "logged out whatever it was before")
        self.assertEqual(client.holding(0), [10000])

    def test_a_trip_and_its_logs(self):
        self.run_simulator()
        client = self.connect()
        self.set_simulated(self.config, "rs485-0", "gm1", trip="excessive_shock")
        self.set_simulated(self.config, "rs485-0", "gm1", reset_trip="now", power="cycle")
        self.set_simulated(self.config, "rs485-0", "gm1", trip="overheat")
        self.assertEqual(client.input_registers(200, 5), [2, 0x20, 0x20, 0x40, 0])
        for log, voltage in ((1, 2200), (2, 2200), (3, 0)):
            samples = client.input_registers(1000 * log, SAMPLES)
            self.assertEqual(samples[SAMPLES - 1], voltage, f"log {log} {samples}")
        client.write_registers(100, characters("password", 8))
        client.write_coil(200, 1)  # "it will not restart when tripped"
        self.assertEqual(self.simulated(self.config, "rs485-0")["devices"]["gm1"]["motor"], "tripped")
        client.write_coil(0, 1)
        self.assertEqual(client.input_registers(200, 5), [0, 0x20, 0x20, 0x40, 0])
        self.assertEqual(client.coils(0), [0])

    def test_what_comes_too_soon_is_dropped(self):
        self.run_simulator("reading: A")
        client = self.connect(timeout=0.4)
        self.assertEqual(client.inputs(0), [1])
        with self.assertRaises(NoAnswer):
            client.inputs(0)  # within 0.1 s of the reply
        time.sleep(0.12)
        self.assertEqual(client.inputs(0), [1])
        time.sleep(0.12)
        client.address(15)
        with self.assertRaises(NoAnswer):
            client.inputs(0)  # nobody's address


class SaaModbusEncoders(Clients):
    def run_simulator(self, bits, extra=""):
        self.port = self.simulate(f"""    family: saa_modbus
    simulate:
      axis1: {{start_deg: 195.31{extra}}}
    devices:
      axis1: {{address: 1, bits: {bits}}}
""")
        self.client = Client(self.port, 19200, 0.5)
        self.addCleanup(self.client.close)
        self.client.address(1)

    def test_one_register_with_mbpoll(self):
        self.run_simulator(14)
        self.assertEqual(self.mbpoll(19200, 1, "4", 0), {0: int(195.31 / 360 * 2**14)})
        time.sleep(0.01)
        with self.assertRaises(NoAnswer):
            self.client.input_registers(0)  # the manual has function 03 only

    def test_two_registers_with_mbpoll(self):
        self.run_simulator(26)
        counts = int(195.31 / 360 * 2**26)
        self.assertEqual(self.mbpoll(19200, 1, "4", 0, 2), {0: counts >> 16, 1: counts & 0xFFFF})

    def test_the_functions_of_the_manual(self):
        """5.1.7 (5), items 3 to 5: address, zero, direction, rate."""
        self.run_simulator(14)
        client = self.client
        pause = lambda: time.sleep(0.01)  # 3.5 characters at 19,200 Bd are 1.8 ms
        self.assertEqual(client.raw([0xFF, 0xA0], 5), with_crc([0xFF, 0xA0, 1], msb_first=True))
        pause()
        self.assertEqual(client.raw([1, 0xA1, 2], 4), with_crc([2, 0xA1]))  # from the new address
        pause()
        client.address(2)
        before = client.holding(0)[0]
        pause()
        self.assertEqual(client.raw([2, 0xCC, 2], 5), with_crc([2, 0xCC, 2]))  # negative
        pause()
        self.assertAlmostEqual(client.holding(0)[0], 2**14 - before, delta=1)
        pause()
        self.assertEqual(client.raw([2, 0xCC, 0], 5), with_crc([2, 0xCC, 0]))  # zero
        pause()
        self.assertEqual(client.holding(0), [0])
        pause()
        self.assertEqual(client.raw([2, 0xCC, 0x96], 5), with_crc([2, 0xCC, 0x96]))  # 9,600 Bd
        pause()
        client.close()
        client = Client(self.port, 9600, 0.5)
        client.address(2)
        self.assertEqual(client.holding(0), [0])
        client.close()


if __name__ == "__main__":
    unittest.main(verbosity=2)
