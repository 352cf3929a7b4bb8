"""Our driver of SC units against pymodbus as the units, whose registers are written from the maker's document."""

import json
import struct
import unittest

from cable import Cable
from lcm_listener import Listener
from machine import Machine, wait_for
from sc_unit import HOLDING, QUANTITIES, REGISTER, ScUnit, physical, serve, word

ANALOG_VALID, STATUS_VALID, TRIPPED = 0x1, 0x2, 0x4  # lcmtypes/motor_health_t.lcm
TRIP_BITS = {0x01: "power upper A", 0x02: "power upper B", 0x04: "power lower A", 0x08: "power lower B",
             0x20: "overheat", 0x40: "excessive shock"}  # guideline 10, note 1
ONLINE, DEGRADED = 1, 2
PATIENT = ", timeout_us: 1000000"  # with a unit in Python on a host that is busy
PAUSE = 0.1  # s, guideline 3
SILENCE = 0.005  # s, guideline 4, note 1


def float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def unit_at(address):
    """A unit unlike all others: the ends of every register's range are among them."""
    unit = ScUnit(mfg_number=f"MFG{address:07d}", product_code=f"GM{address:02d}", version=(address, 0x10 * address % 256),
                  mains_60hz=address % 2 == 0)
    extreme = {1: 0x7FFF, 2: -0x8000, 3: -1, 4: 0}
    unit.set_live(voltage=65535 if address == 1 else 2000 + address, current=65535 if address == 2 else 1234 * address,
                  power=65535 if address == 3 else 777 * address, temperature=extreme.get(address, -400 + 37 * address),
                  accel_x=extreme.get(address, -981 + address), accel_y=extreme.get(address, 12 * address),
                  accel_z=extreme.get(address, -30000 + 1000 * address))
    status = list(TRIP_BITS)[address % 6] if address >= 11 else 0
    unit.put(REGISTER, 200, [0 if address < 5 else 60000 + address, status])
    unit.put(REGISTER, 300, [0xFF00 if address % 3 == 0 else 0])
    unit.tables[1][100] = int(address % 4 == 0)
    return unit


def log_of(trip):
    """Seven rows of twenty registers that identify trip, quantity and sample."""
    return [[word((-1 if quantity >= 3 else 1) * (1000 * trip + 100 * quantity + sample)) for sample in range(20)]
            for quantity in range(7)]


class ScBus(Machine):
    def setUp(self):
        super().setUp()
        self.cable = Cable()
        self.addCleanup(self.cable.close)
        self.listener = Listener()
        self.addCleanup(self.listener.close)

    def run_bus(self, units, pacing, device="", poll_hz=0):
        self.units = units
        self.server = serve(self.cable.peer, units)
        self.addCleanup(self.server.close)
        devices = "".join(f"      gm{address}: {{address: {address}{device}}}\n" for address in units)
        self.config = self.write(f"""machine: test
bridge: {{unsigned_commands: allow}}
buses:
  rs485-0:
    family: tsubaki_sc
    link: {{port: {self.cable.host}, pty: true}}
    pacing: {pacing}
    poll_hz: {poll_hz}
    devices:
{devices}""")
        self.driver(self.config, "rs485-0", family="tsubaki-sc")

    def motor(self, address, condition, what):
        return self.listener.wait(f"MOTOR/gm{address}", condition, what)

    def whole(self, address):
        return self.motor(address, lambda m: m.flags & ANALOG_VALID and m.flags & STATUS_VALID and m.mains_hz and
                          m.stop_coil >= 0 and m.logged_in >= 0, "a whole reading")

    def command(self, *words):
        code, out, err = self.axlecast(*words, "--config", self.config, "--json", "--yes")
        self.assertTrue(out, err)
        return code, json.loads(out)

    # -- reading

    def check_motor(self, address, message):
        unit = self.units[address]
        live = {name: physical(name, register)
                for name, register in zip(QUANTITIES, unit.registers(REGISTER, 100, 7))}
        ours = {"voltage": message.voltage_v, "current": message.current_a, "power": message.power_w,
                "temperature": message.temperature_c, "accel_x": message.accel_mps2[0],
                "accel_y": message.accel_mps2[1], "accel_z": message.accel_mps2[2]}
        for name, value in live.items():
            self.assertAlmostEqual(ours[name], value, delta=abs(value) * 1e-6 + 1e-9, msg=f"gm{address} {name}")
        count, status, *factors = unit.registers(REGISTER, 200, 5)
        self.assertEqual((message.trip_count, message.status_bits, list(message.trip_factor)), (count, status, factors))
        self.assertEqual(message.stop_coil, unit.tables[1][100])
        self.assertEqual(message.logged_in, int(unit.logged_in))
        self.assertEqual(message.mains_hz, 60 if unit.tables[2][0] else 50)
        self.assertEqual(message.flags, ANALOG_VALID | STATUS_VALID | (TRIPPED if status else 0))
        self.assertNotEqual(message.analog_mono_ns, message.status_mono_ns)
        self.assertLess(abs(message.analog_mono_ns - message.status_mono_ns), 60_000_000_000)

    def test_sixteen_units_are_read_as_the_document_says(self):
        self.run_bus({address: unit_at(address) for address in range(1, 17)}, "per_unit", PATIENT)
        for address, unit in self.units.items():
            self.check_motor(address, self.whole(address))
            info = self.listener.wait(f"DEVICE/gm{address}", lambda d: d.firmware and d.serial and d.identity >= 0,
                                      "its identity")
            self.assertEqual(info.state, DEGRADED if unit.tables[REGISTER][201] else ONLINE, info.reason)
            self.assertEqual(info.serial, f"MFG{address:07d}")
            high, low = unit.registers(HOLDING, 300, 2)
            self.assertEqual(info.identity, high << 16 | low)
            self.assertEqual(sum(info.errors), 0, list(info.errors))
        # Guideline 12: 01 00 is Ver.1.0.0.
        self.assertEqual(self.listener.last("DEVICE/gm16").firmware, "16.0.0")
        for address in self.units:
            status = self.units[address].registers(REGISTER, 201, 1)[0]
            alarm = self.listener.last(f"ALARM/gm{address}")
            self.assertEqual(bool(alarm and alarm.n), bool(status), f"gm{address}: an alarm for each trip bit, no other")
        # What changes in a unit shows in its own message and in no other.
        mark = {address: self.listener.last(f"MOTOR/gm{address}").seq for address in self.units}
        self.server.do(lambda: self.units[9].set_live(power=3210, temperature=-123, accel_z=-4567))
        self.check_motor(9, self.motor(9, lambda m: m.seq > mark[9] and abs(m.power_w - 321) < 1, "the changed power"))
        for address in self.units:
            later = self.motor(address, lambda m: m.seq > mark[address] + 2, "two more readings")
            self.check_motor(address, later)
        self.check_pauses(per_unit=True)

    def check_pauses(self, per_unit):
        """The document's 0.1 s and 5 ms, as the cable saw them. It sees requests late and replies early: never less
        than the true pause."""
        replied = {}  # unit: when; None: of the whole bus
        requests = [(when, data) for when, sender, data in self.cable.passed if sender == "host"]
        self.assertTrue(all(len(data) >= 4 for _, data in requests), "requests in one piece")
        shortest = 1e9
        for when, sender, data in list(self.cable.passed):
            key = data[0] if per_unit else None
            if sender == "peer":
                replied[key] = replied[None] = when
                continue
            self.assertGreaterEqual(when - replied.get(None, 0), SILENCE)
            shortest = min(shortest, when - replied.get(key, 0))
        self.assertGreaterEqual(shortest, PAUSE)
        self.assertLess(shortest, 2 * PAUSE, "but not much more than that")

    def test_the_safe_pacing_pauses_for_the_whole_bus(self):
        self.run_bus({address: unit_at(address) for address in (3, 12)}, "after_reply")
        for address in self.units:
            self.check_motor(address, self.whole(address))
        self.check_pauses(per_unit=False)

    # -- trips

    def check_trip(self, message, trip, index, interval):
        self.assertEqual((message.log_index, message.interval_us, message.valid_mask), (index, interval, 0x7F))
        for quantity, name in enumerate(QUANTITIES):
            for sample, register in enumerate(log_of(trip)[quantity]):
                value = physical(name, register)
                self.assertAlmostEqual(message.samples[quantity][sample], value, delta=abs(value) * 1e-6,
                                       msg=f"trip {trip} {name} {sample}")

    def test_a_trip_comes_with_its_log_and_no_sample_of_another(self):
        unit = unit_at(1)
        unit.put(HOLDING, 54, [5])  # 0.5 s
        self.run_bus({1: unit}, "after_reply")
        self.motor(1, lambda m: m.flags & STATUS_VALID, "a reading")
        self.server.do(lambda: unit.trip(0x20, log_of(1)))
        first = self.listener.wait("TRIP/gm1", lambda t: t.trip_count == 1 and t.log_index == 1, "the log")
        self.check_trip(first, 1, 1, 500_000)
        self.assertEqual(first.factor_bits, 0x20)
        self.assertLess(0, first.not_before_utime)
        self.assertLessEqual(first.not_before_utime, first.not_after_utime)
        self.assertLessEqual(first.not_after_utime, first.utime)
        alarms = self.listener.wait("ALARM/gm1", lambda a: a.n > 0, "the alarm")
        self.assertEqual([entry.name for entry in alarms.entries], ["overheat"])
        # A second trip while the log of the first is being read.
        self.server.do(lambda: unit.trip(0x01, log_of(2)))
        logs_begin = len(self.cable.passed)
        wait_for(lambda: any(sender == "host" and data[1:3] == b"\x04\x04" for _, sender, data in
                             self.cable.passed[logs_begin:]), "a request for the log")  # 04 at 1000 is 03E8, at 1100 044C
        self.server.do(lambda: unit.trip(0x40, log_of(3)))
        self.listener.wait("TRIP/gm1", lambda t: t.trip_count == 3 and t.log_index == 1, "the newest log")
        self.listener.wait("TRIP/gm1", lambda t: t.trip_count == 2, "the log of the trip before it")
        for message in self.listener.of("TRIP/gm1"):
            self.check_trip(message, message.trip_count, message.log_index, 500_000)
            self.assertEqual(message.factor_bits, {1: 0x20, 2: 0x01, 3: 0x40}[message.trip_count])

    def test_the_trips_that_a_unit_remembers_are_read_at_the_start(self):
        unit = unit_at(2)
        for trip, factor in ((1, 0x08), (2, 0x02), (3, 0x04)):
            unit.trip(factor, log_of(trip))
        self.run_bus({2: unit}, "per_unit", poll_hz=1)  # what is past is read where the bus has nothing else to do
        for index, trip, factor in ((1, 3, 0x04), (2, 2, 0x02), (3, 1, 0x08)):
            message = self.listener.wait("TRIP/gm2", lambda t: t.log_index == index, f"log {index}")
            self.check_trip(message, trip, index, 100_000)
            self.assertEqual((message.factor_bits, message.not_before_utime), (factor, 0))

    # -- commands

    def test_parameters_are_read_and_written(self):
        secret = self.folder / "password"
        secret.write_text("Zq7#kV2!xW9m\n")
        secret.chmod(0o600)
        unit = ScUnit(mfg_number="9876543210", password="Zq7#kV2!xW9m")
        unit.put(HOLDING, 0, [100 * n + n for n in range(52)])
        unit.put(HOLDING, 52, [900, 15000, 100])
        self.run_bus({7: unit}, "per_unit", f", passwords: {{main: {{file: {secret}}}}}, password: main")
        self.bridge(self.config)
        self.motor(7, lambda m: m.flags & STATUS_VALID, "a reading")

        code, outcome = self.command("do", "gm7", "read_parameters")
        self.assertEqual((code, outcome["verified"]), (0, 1), outcome)
        digits = "".join(change["after"] for change in outcome["changes"])  # documented as 4 hex digits a register
        self.assertEqual(digits, "".join(f"{value:04X}" for value in unit.registers(HOLDING, 0, 55)))

        # 14: power upper limit A, DIP set 2, 60 Hz, in 0.1 W; 53: shock limit in 0.01 m/s^2.
        code, outcome = self.command("do", "gm7", "read_parameters", "names=power_upper_a_2_60hz,excessive_shock_limit")
        self.assertEqual(code, 0, outcome)
        self.assertEqual([change["after"] for change in outcome["changes"]], ["141.4", "150.00"])

        self.assertFalse(unit.logged_in)
        code, outcome = self.command("do", "gm7", "write_parameters", "overheat_limit=87.5", "shock_time_lower_b_4=30.0")
        self.assertEqual((code, outcome["verified"]), (0, 1), outcome)
        self.assertEqual((unit.registers(HOLDING, 52, 1), unit.registers(HOLDING, 51, 1)), ([875], [300]))
        self.assertFalse(unit.logged_in, "the driver logs out again")
        limits = self.listener.wait("LIMITS/gm7", lambda m: m.overheat_c == 87.5, "the new limit")
        self.assertAlmostEqual(limits.parameters[51], 30.0, places=5)
        self.assertAlmostEqual(limits.parameters[53], 150.0, places=5)
        self.assertIn("logged out again", outcome["text"])
        # Both ends of a range are taken, what is beyond is sent to nobody (guideline 11).
        written = len(unit.writes)
        for assignment in ("overheat_limit=125.1", "start_time_1=0", "log_interval=10.1", "shock_time_upper_a_1=30.1"):
            code, outcome = self.command("do", "gm7", "write_parameters", assignment)
            self.assertEqual(code, 3, outcome)
        self.assertEqual(len(unit.writes), written)
        code, outcome = self.command("do", "gm7", "write_parameters", "overheat_limit=0", "start_time_1=5.0")
        self.assertEqual(code, 0, outcome)
        self.assertEqual((unit.registers(HOLDING, 52, 1), unit.registers(HOLDING, 8, 1)), ([0], [50]))


if __name__ == "__main__":
    unittest.main(verbosity=2)
