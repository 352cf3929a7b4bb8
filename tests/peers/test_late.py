"""Devices that answer late, against our drivers on real ptys: every valid position's interval holds the instant of its sample.

AXLECAST_LATE=N lets each family exchange N requests (tools/campaign); without it, some hundreds."""

import os
import unittest

from late_line import Behaviour, LateLine, LateStream
from late_stations import SaaBus, SaaModbus, Samples, ScBus, TFormat, shaft
from lcm_listener import Listener
from machine import LIMIT, Machine, wait_for
from saa_serial import frame

EXCHANGES = int(os.environ.get("AXLECAST_LATE", 0))
VALID = 0x1
ANALOG_VALID = 0x1
FEW = 10  # readings that a run needs at least
MS = 1_000_000  # ns
SECOND = 1_000 * MS
ROUNDED = 1_000  # ns: messages hold whole ns, the Python clock is asked before the value is computed


def character_ns(baud, bits=10):
    return bits * 1_000_000_000 // baud


class Late(Machine):
    def setUp(self):
        super().setUp()
        self.samples = Samples()
        self.listener = Listener()
        self.addCleanup(self.listener.close)

    def begin(self, family, line, devices, bus="poll_hz: 0", link=""):
        """Starts the driver of `devices` (name to keys) on the line."""
        self.line = line
        self.addCleanup(line.close)
        self.devices = devices
        lines = "".join(f"      {name}: {{{keys}}}\n" for name, keys in devices.items())
        self.family, self.config = family, self.write(f"""machine: test
buses:
  rs485-0:
    family: {family}
    link: {{port: {line.path}, pty: true{link}}}
    {bus}
    devices:
{lines}""")
        self.run_driver()

    def run_driver(self):
        self.process = self.driver(self.config, "rs485-0", family=self.family.replace("_", "-"))

    # -- what was published

    def positions(self):
        return [(name, m.raw_counts, m.mono_ns, m.time_uncertainty_ns) for name in self.devices
                for m in self.listener.of(f"POSITION/{name}") if m.flags & VALID]

    def voltages(self, timeout_ns):
        """Analog readings, each once. Their messages give the middle of the interval alone: its ends are at most half of an
        exchange away. An exchange is over within the timeout, or, where the host let the driver sleep, within the longest one
        that BUS names of that second."""
        longest = [(m.mono_ns - 1000 * m.window_us - SECOND, m.mono_ns + SECOND, int(1000 * m.exchange_us[3]))
                   for m in self.listener.of("BUS/rs485-0") if m.exchange_us[3] * 1000 > timeout_ns]
        found = {}
        for name in self.devices:
            for m in self.listener.of(f"MOTOR/{name}"):
                if m.flags & ANALOG_VALID:
                    exchange = max([timeout_ns] + [most for begin, end, most in longest if begin <= m.analog_mono_ns <= end])
                    found[name, m.analog_mono_ns] = (name, round(m.voltage_v * 10), m.analog_mono_ns, exchange // 2)
        return list(found.values())

    def missed(self, readings):
        """Those whose interval does not hold the instant at which the device had that value."""
        missed = []
        for name, value, instant, uncertainty in readings:
            distance = self.samples.distance(name, value, instant)
            if distance is None or distance > uncertainty + ROUNDED:
                missed.append(f"{name}: {value} at {instant} +- {uncertainty / MS:.3f} ms, "
                              f"{'never sent' if distance is None else f'{distance / MS:.3f} ms away'}")
        return missed

    def exchange(self, what, exchanges, readings):
        exchanges = EXCHANGES or exchanges
        wait_for(lambda: self.line.requests >= exchanges, lambda: f"{self.line.requests} of {exchanges} exchanges",
                 LIMIT + 0.15 * exchanges)
        wait_for(lambda: len(readings()) >= FEW, "readings to judge")
        found = readings()
        missed = self.missed(found)
        print(f"{what}: {self.line.requests} exchanges, {len(found)} readings, {len(missed)} missed"
              + (f", {self.line.lost} replies lost by a busy host" if self.line.lost else ""), flush=True)
        self.assertEqual(missed, [])

    def alarm(self, name):
        def raised():
            return any(entry.name == name for device in self.devices for m in self.listener.of(f"ALARM/{device}")
                       for entry in m.entries)
        wait_for(raised, f"the alarm {name}")

    # -- the families. Delays reach from 0 to 10 timeouts.

    def tformat(self, behaviour, bus="poll_hz: 0", timeout_ms=5):
        line = LateLine(TFormat(self.samples), character_ns(2_500_000), behaviour, 400 * MS)
        self.begin("tformat", line, {"axis1": f"model: ts5669n127, timeout_us: {1000 * timeout_ms}"}, bus)

    def saa_serial(self, behaviour, timeout_ms=5):
        units = {0xB1: ("axis1", 20, 0xB1), 0xB2: ("axis2", 16, 0xB2), 0xB5: ("axis5", 24, 0xB5)}
        line = LateLine(SaaBus(self.samples, units), character_ns(115_200), behaviour, 400 * MS)
        self.begin("saa_serial", line,
                   {name: f"address: {control & 15}, bits: {bits}, reply_header: address, timeout_us: {1000 * timeout_ms}"
                    for control, (name, bits, _) in units.items()}, "mode: bus", ", baud: 115200")

    def saa_modbus(self, behaviour, timeout_ms=10):
        units = {1: ("axis1", 16, 4), 2: ("axis2", 24, 3), 9: ("axis9", 26, 4)}
        line = LateLine(SaaModbus(self.samples, units), character_ns(57_600), behaviour, 400 * MS)
        self.begin("saa_modbus", line, {name: f"address: {address}, bits: {bits}, timeout_us: {1000 * timeout_ms}"
                                        for address, (name, bits, _) in units.items()}, link=", baud: 57600")

    def tsubaki_sc(self, behaviour, units=16, timeout_ms=100):
        names = {address: f"gm{address}" for address in range(1, units + 1)}
        line = LateLine(ScBus(self.samples, names), character_ns(9_600, 11), behaviour, 1_080 * MS)
        self.begin("tsubaki_sc", line, {name: f"address: {address}, timeout_us: {1000 * timeout_ms}"
                                        for address, name in names.items()}, "pacing: per_unit")

    @staticmethod
    def late(timeout_ms, share=0.5, **more):
        return Behaviour(share=share, longest_ns=10 * timeout_ms * MS, silent=0.01, garbage=0.01, **more)

    def test_tformat(self):
        self.tformat(self.late(5))
        self.exchange("tformat", 300, self.positions)
        self.alarm("late_replies")

    def test_saa_serial(self):
        self.saa_serial(self.late(5))
        self.exchange("saa_serial", 300, self.positions)
        self.alarm("late_replies")

    def test_saa_serial_where_replies_overtake(self):
        self.saa_serial(self.late(5, own_ways=True, seed=2))
        self.exchange("saa_serial, mixed up", 300, self.positions)
        self.alarm("late_replies")

    def test_saa_modbus(self):
        self.saa_modbus(self.late(10))
        self.exchange("saa_modbus", 300, self.positions)
        self.alarm("late_replies")

    def test_saa_modbus_where_replies_overtake(self):
        self.saa_modbus(self.late(10, own_ways=True, seed=2))
        self.exchange("saa_modbus, mixed up", 300, self.positions)
        self.alarm("late_replies")

    def test_tsubaki_sc(self):
        """One late reply holds up those of all units that are asked meanwhile."""
        self.tsubaki_sc(self.late(100, share=0.04))
        self.exchange("tsubaki_sc", 150, lambda: self.voltages(100 * MS))
        self.alarm("late_replies")

    def test_tsubaki_sc_where_replies_overtake(self):
        self.tsubaki_sc(self.late(100, share=0.3, own_ways=True, seed=2))
        self.exchange("tsubaki_sc, mixed up", 150, lambda: self.voltages(100 * MS))
        self.alarm("late_replies")

    def test_a_stream_that_stalls(self):
        """Of 10 ms a frame, for up to a fifth of a second."""
        turning = shaft(20)

        def sampled(now):
            counts = turning(now) % 2**20
            self.samples.add("axis1", counts, now)
            return frame(counts, 20)

        line = LateStream(sampled, 10 * MS, character_ns(115_200), Behaviour(share=0.1, longest_ns=200 * MS, garbage=0.01))
        self.begin("saa_serial", line, {"axis1": "bits: 20"}, "mode: timing\n    refresh_hz: 100", ", baud: 115200")
        self.exchange("saa_serial, stream", 300, self.positions)

    # -- a driver that is killed: the late replies to its requests are not the next driver's

    def killed(self):
        for _ in range(3):
            seen = self.line.requests
            wait_for(lambda: self.line.requests > seen + 40, "exchanges")
            self.kill(self.process)
            self.run_driver()
        before = len(self.positions())
        wait_for(lambda: len(self.positions()) >= before + FEW, "readings of the last driver")
        self.assertEqual(self.missed(self.positions()), [])

    def test_a_killed_tformat_driver(self):
        self.tformat(self.late(20), timeout_ms=20)
        self.killed()

    def test_a_killed_saa_serial_driver(self):
        self.saa_serial(self.late(20), timeout_ms=20)
        self.killed()

    def test_a_killed_saa_modbus_driver(self):
        self.saa_modbus(self.late(20), timeout_ms=20)
        self.killed()

    # -- what is promised up to late_us alone

    def test_beyond_late_us_the_judge_sees_misses(self):
        """The README: beyond late_us a reply can be taken for that to a newer request. So this test can fail."""
        self.tformat(self.late(5), "poll_hz: 0\n    late_us: 10000")
        wait_for(lambda: self.missed(self.positions()), "a position with a wrong interval")

    # -- devices that answer twice: a named alarm, and no wrong positions

    def twice(self, readings):
        self.alarm("unexpected_bytes")
        wait_for(lambda: len(readings()) >= FEW, "readings")
        self.assertEqual(self.missed(readings()), [])

    def test_a_tformat_encoder_that_answers_twice(self):
        self.tformat(Behaviour(twice=1), "poll_hz: 100", timeout_ms=50)
        self.twice(self.positions)

    def test_a_polled_saa_encoder_that_answers_twice(self):
        self.saa_serial(Behaviour(twice=1), timeout_ms=50)
        self.twice(self.positions)

    def test_an_saa_encoder_on_modbus_that_answers_twice(self):
        self.saa_modbus(Behaviour(twice=1), timeout_ms=50)
        self.twice(self.positions)

    def test_an_sc_unit_that_answers_twice(self):
        """Units are asked 30 times a second, so that the second answers come often enough to be named."""
        self.tsubaki_sc(Behaviour(twice=1), timeout_ms=500)
        self.twice(lambda: self.voltages(500 * MS))


if __name__ == "__main__":
    unittest.main(verbosity=2)
