"""SAA encoders end to end: both families' examples, zero verified, and the writes of the Modbus encoders."""

import os
import pathlib
import unittest

from machine import BIN, Machine, wait_for

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
DONE, REJECTED, FAILED, NOT_VERIFIED = 0, 3, 4, 7
ONLINE, OFFLINE = 1, 3
VALID, SIMULATED = 0x1, 0x2000
NOT_STANDING_STILL, NOT_PERMITTED, WEAR = 13, 18, 19


class Saa(Machine):
    def up(self, config, *devices):
        self.config = config
        self.data = self.watch(config)
        self.running = self.start("up", BIN / "axlecast", "up", config, "--no-table")
        for device in devices:
            self.wait_online(self.data, device)
            wait_for(lambda: self.position(device), f"a position of {device}")

    def example(self, family):
        """The family's example, with commands allowed."""
        text = (SOURCE / f"drivers/{family}/example.yaml").read_text()
        return self.write(text + "bridge: {unsigned_commands: allow}\n")

    def position(self, device):
        position = self.data.last(f"POSITION/{device}")
        return position if position and position["flags"] & VALID else None

    def angle(self, device):
        position = self.position(device)
        return position["raw_counts"] / position["counts_per_turn"] * 360

    def do(self, device, *words):
        return self.outcome("do", device, *words, "--yes")

    def encoder(self, bus, device):
        return self.simulated(self.config, bus)["devices"][device]

    def at_rest(self, device, *words):
        """A command that needs a standstill, repeated until the driver has seen that the shaft stands still."""
        def tried():
            code, outcome = self.do(device, *words)
            return None if outcome["reason_code"] in (NOT_STANDING_STILL, WEAR) else (code, outcome)
        return wait_for(tried, f"{device} {words}")

    def zeroed(self, device):
        """Carries out `zero` and looks at what the reading is then."""
        code, outcome = self.at_rest(device, "zero")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        wait_for(lambda: min(self.angle(device), 360 - self.angle(device)) <= 0.21,
                 lambda: f"0, not {self.angle(device)} deg")

    def turns_at(self, device, deg_s):
        """The positions of half a second show this speed; less than a turn in that time."""
        def seen():
            found = [p for p in self.data.of(f"POSITION/{device}") if p["flags"] & VALID]
            last = found[-1]
            first = next(p for p in found if p["mono_ns"] > last["mono_ns"] - 500_000_000)
            seconds = (last["mono_ns"] - first["mono_ns"]) / 1e9
            moved = (last["raw_counts"] - first["raw_counts"]) / last["counts_per_turn"] * 360 % 360
            return seconds > 0.3 and abs(moved / seconds - deg_s) < 0.05 * deg_s
        wait_for(seen, f"{device} turning at {deg_s} deg/s")

    # -- serial

    def test_every_mode_of_the_serial_line_reads_and_clears_to_zero(self):
        self.up(self.example("saa_serial"), "turntable", "radar", "gimbal", "joint1", "joint2", "joint3",
                "valve")
        self.assertAlmostEqual(self.angle("joint1"), 8.4155, delta=0.03)
        self.assertAlmostEqual(self.angle("joint3"), 195, delta=0.001)
        self.assertTrue(self.position("joint1")["flags"] & SIMULATED)
        self.turns_at("turntable", 360)

        code, outcome = self.do("turntable", "zero")
        self.assertEqual((code, outcome["reason_code"]), (REJECTED, NOT_STANDING_STILL), outcome)
        for bus, device in (("timing", "turntable"), ("handshake", "gimbal")):  # by CLR
            self.set_simulated(self.config, bus, device, speed_rpm=0)
            self.zeroed(device)
            self.assertEqual(self.encoder(bus, device)["zeroings"], 1)
        self.zeroed("joint1")  # by BC AA C1
        self.zeroed("joint3")
        self.assertEqual([self.encoder("bus", f"joint{n}")["zeroings"] for n in (1, 2, 3)], [1, 0, 1])
        # Without a CLR line, and on a bus without zero clearing.
        for device in ("radar", "valve"):
            code, outcome = self.do(device, "zero")
            self.assertEqual(code, REJECTED, outcome)

    def test_a_stream_that_is_cut_off_is_silence_and_not_an_old_value(self):
        self.up(self.example("saa_serial"), "turntable")
        self.set_simulated(self.config, "timing", "turntable", power="off")
        self.wait_state(self.data, OFFLINE, "turntable")
        mark = self.data.mark()
        wait_for(lambda: len(self.data.of("DEVICE/turntable", mark)) >= 2, "two more seconds")
        self.assertEqual([p for p in self.data.of("POSITION/turntable", mark) if p["flags"] & VALID], [])
        self.set_simulated(self.config, "timing", "turntable", power="on")
        self.wait_state(self.data, ONLINE, "turntable")

    # -- Modbus

    MODBUS = """machine: test
bridge: {unsigned_commands: allow}
buses:
  rs485-0:
    family: saa_modbus
    simulate:
      boom: {start_deg: 100}
      mast: {start_deg: 200}
    devices:
      boom: {bits: 14, address: 3, unit: deg, permit: not_required, write_interval_s: 1, limits: {speed_rpm: 100}}
      mast: {bits: 20, address: 4, unit: deg, permit: not_required, write_interval_s: 60, limits: {speed_rpm: 100}}
  rs485-1:
    family: saa_modbus
    simulate:
      table: {start_deg: 30}
    devices:
      table: {bits: 16, unit: deg, permit: not_required, write_interval_s: 1}
"""

    def test_the_modbus_example_reads_and_zeroes(self):
        self.up(self.example("saa_modbus"), "turret", "hoist", "boom", "table")
        self.assertAlmostEqual(self.angle("boom"), 8.4155, delta=0.03)
        self.zeroed("boom")
        code, outcome = self.do("hoist", "zero")
        self.assertEqual((code, outcome["reason_code"]), (REJECTED, NOT_STANDING_STILL), outcome)
        self.turns_at("table", 60)
        # 2 rpm, although each instant is known to milliseconds only.
        wait_for(lambda: abs((self.position("turret")["speed_rad_s"] or 0) - 2 / 60 * 6.2832) < 0.03, "2 rpm")

    def test_address_direction_and_interval_of_writes(self):
        self.up(self.write(self.MODBUS), "boom", "mast", "table")
        code, outcome = self.at_rest("boom", "set_direction", "direction=negative")
        self.assertEqual(code, NOT_VERIFIED, outcome)
        wait_for(lambda: abs(self.angle("boom") - 260) < 0.1, lambda: f"360 - 100, not {self.angle('boom')}")

        code, outcome = self.at_rest("boom", "set_address", "address=4")
        self.assertEqual((code, outcome["reason_code"]), (REJECTED, NOT_PERMITTED), outcome)
        code, outcome = self.at_rest("boom", "set_address", "address=9")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        self.assertEqual(self.encoder("rs485-0", "boom")["address"], 9)
        mark = self.data.mark()
        wait_for(lambda: [p for p in self.data.of("POSITION/boom", mark) if p["flags"] & VALID], "positions from there")
        code, outcome = self.at_rest("boom", "set_baud", "baud=9600")
        self.assertEqual((code, outcome["reason_code"]), (REJECTED, NOT_PERMITTED), "the others would not follow")

        # One write a minute: the second is refused, and the encoder does not get it.
        self.zeroed("mast")
        code, outcome = self.do("mast", "zero")
        self.assertEqual((code, outcome["reason_code"]), (REJECTED, WEAR), outcome)
        self.assertEqual(self.encoder("rs485-0", "mast")["writes"], 1)

    def test_the_driver_follows_a_new_rate(self):
        self.up(self.write(self.MODBUS), "table")
        for baud in (57600, 2400, 19200):
            code, outcome = self.at_rest("table", "set_baud", f"baud={baud}")
            self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
            self.assertEqual(self.encoder("rs485-1", "table")["baud"], baud)
            mark = self.data.mark()
            wait_for(lambda: [p for p in self.data.of("POSITION/table", mark) if p["flags"] & VALID],
                     f"positions at {baud} Bd")
        code, outcome = self.do("table", "query_address")
        self.assertEqual(code, DONE, outcome)


if __name__ == "__main__":
    unittest.main(verbosity=2)
