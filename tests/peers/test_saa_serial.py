"""SAA encoders on a serial line: a Python encoder against our driver, a Python reader against our simulator."""

import json
import os
import select
import termios
import time
import tty
import unittest

from lcm_listener import Listener
from machine import Machine, wait_for
from saa_serial import PolledEncoders, Streamer, data_bytes, frame, positions

VALID = 0x1
ONLINE = 1


class ManualsExamples(unittest.TestCase):
    def test_the_peer_agrees_with_the_manual(self):
        """5.1.1 (4): FF 81 01 7F 00 is 383 at 14 bits."""
        self.assertEqual(frame(383, 14), bytes.fromhex("FF 81 01 7F 00"))
        self.assertEqual(positions(bytes.fromhex("FF 81 01 7F 00"), 14), [383])
        self.assertAlmostEqual(360 * 383 / 2**14, 8.4155, delta=5e-5)


class FixedEncoder:
    def __init__(self, counts, second=0x81):
        self.value, self.second, self.origin = counts, second, 0

    def counts(self):
        return (self.value - self.origin) % 2**20

    def zero(self):
        self.origin = self.value


class SaaSerial(Machine):
    def setUp(self):
        super().setUp()
        self.listener = Listener()
        self.addCleanup(self.listener.close)

    def run_driver(self, port, bus, devices):
        lines = "".join(f"      {name}: {{{keys}, permit: not_required}}\n" for name, keys in devices.items())
        self.config = self.write(f"""machine: test
bridge: {{unsigned_commands: allow}}
buses:
  rs485-0:
    family: saa_serial
    link: {{port: {port}, pty: true, baud: 115200}}
    {bus}
    devices:
{lines}""")
        self.driver(self.config, "rs485-0", family="saa-serial")

    def valid(self, axis):
        return [m for m in self.listener.of(f"POSITION/{axis}") if m.flags & VALID]

    # -- an encoder that streams

    def stream(self, bits, counts_of, noise=lambda n: b"", frames=600):
        """Our driver's valid positions of such a stream, and what was sent from its first one on."""
        encoder = Streamer(bits, 200, counts_of, noise)
        self.addCleanup(encoder.close)
        self.run_driver(encoder.path, "mode: timing\n    refresh_hz: 200", {"axis1": f"bits: {bits}, unit: deg, publish_hz: 20000"})
        wait_for(lambda: len(self.valid("axis1")) >= frames, lambda: f"{frames} positions, not {len(self.valid('axis1'))}")
        ours = self.valid("axis1")
        sent = {counts: when for when, counts in encoder.sent}
        self.assertEqual(len(sent), len(encoder.sent), "the test's frames are told apart by their counts")
        for message in ours:
            self.assertIn(message.raw_counts, sent)
            self.assertAlmostEqual(message.value, message.counts / 2**bits * 360, places=9)
            self.assertEqual((message.counts_per_turn, message.raw_turns), (2**bits, 0))
        order = [counts for _, counts in encoder.sent]
        first = order.index(ours[0].raw_counts)
        return ours, encoder.sent[first:]

    def test_every_frame_becomes_a_position(self):
        step = 5
        ours, sent = self.stream(14, lambda n: step * n % 2**14)
        self.assertEqual([m.raw_counts for m in ours], [counts for _, counts in sent[:len(ours)]])
        self.assertEqual([m.seq for m in ours], list(range(ours[0].seq, ours[0].seq + len(ours))))
        # The sampling instant is before the frame; the driver knows of it to within its uncertainty. What it cannot
        # know is how late this process was with writing.
        for message, (when, _) in zip(ours, sent):
            self.assertLessEqual(message.mono_ns - message.time_uncertainty_ns, when + 5_000_000)
            self.assertGreaterEqual(message.mono_ns + message.time_uncertainty_ns, when - 5_000_000)

    def test_the_longest_frames(self):
        ours, sent = self.stream(26, lambda n: (2**26 - 300_000 + 1024 * n) % 2**26, frames=400)
        self.assertEqual([m.raw_counts for m in ours], [counts for _, counts in sent[:len(ours)]])

    def test_noise_between_frames_costs_no_frame(self):
        """Look-alike headers, half frames and stray bytes; the frames beside them are whole."""
        pieces = (b"", b"\xFF", b"", b"\xFF\x81", b"\x00\x81\x12", b"", frame(77, 17)[:-2], b"\xFF\xFF\xFF")
        ours, sent = self.stream(17, lambda n: 40 * n % 2**17, lambda n: pieces[n % len(pieces)])
        got = [m.raw_counts for m in ours]
        expected = [counts for _, counts in sent[:sent.index(next(s for s in sent if s[1] == got[-1])) + 1]]
        # A frame next to bad bytes may be lost (the stream does not mark its beginning); none else may.
        clean = [counts for index, counts in enumerate(expected) if not pieces[(counts // 40) % len(pieces)]
                 and not pieces[(counts // 40 - 1) % len(pieces)]]
        self.assertEqual([counts for counts in expected if counts in set(got)], got)
        self.assertEqual(set(clean) - set(got), set())
        self.assertGreater(len(got), 0.9 * len(expected))
        self.assertGreater(sum(self.listener.last("BUS/rs485-0").errors), 0, "what was skipped is counted")

    def test_a_stream_that_falls_silent_and_comes_back(self):
        quiet = [False]

        class Encoder(Streamer):
            def _stream(self):
                n = 0
                while not self.stopped.wait(0.005):
                    if not quiet[0]:
                        os.write(self.master, frame(n % 2**14, 14))
                    n += 1

        encoder = Encoder(14, 200, None)
        self.addCleanup(encoder.close)
        self.run_driver(encoder.path, "mode: timing\n    refresh_hz: 200", {"axis1": "bits: 14"})
        self.listener.wait("DEVICE/axis1", lambda d: d.state == ONLINE, "online")
        quiet[0] = True
        silent = self.listener.wait("DEVICE/axis1", lambda d: d.errors[15] > 0 and d.state != ONLINE, "silence noticed")
        quiet[0] = False
        self.listener.wait("DEVICE/axis1", lambda d: d.seq > silent.seq and d.state == ONLINE, "online again")

    # -- encoders that are asked

    def test_three_encoders_on_a_polled_bus(self):
        units = {0xB1: FixedEncoder(12345), 0xB2: FixedEncoder(2**20 - 1, second=0xB2), 0xB5: FixedEncoder(77)}
        encoders = PolledEncoders(20, units)
        self.addCleanup(encoders.close)
        self.run_driver(encoders.path, "mode: bus\n    zero_clearing: true",
                        {f"axis{x & 15}": f"address: {x & 15}, bits: 20, unit: turn, limits: {{speed_rpm: 60}}" for x in units})
        for control, unit in units.items():
            axis = f"axis{control & 15}"
            wait_for(lambda: len(self.valid(axis)) > 100, f"positions of {axis}")
            self.assertEqual({m.raw_counts for m in self.valid(axis)}, {unit.value})
            self.assertAlmostEqual(self.valid(axis)[-1].value, unit.value / 2**20, places=12)
        # BC AA C1 zeroes the first and no other.
        self.bridge(self.config)
        code, out, err = self.axlecast("zero", "axis1", "--yes", "--json", "--config", self.config)
        self.assertEqual((code, json.loads(out)["verified"]), (0, 1), out + err)
        self.assertEqual([unit.origin for unit in units.values()], [12345, 0, 0])
        wait_for(lambda: self.valid("axis1")[-1].raw_counts == 0, "0 after the zero")
        self.assertEqual(self.valid("axis5")[-1].raw_counts, 77)
        self.assertEqual(encoders.unknown, [])

    def test_an_answer_with_anothers_address_is_an_error(self):
        encoders = PolledEncoders(16, {0xB1: FixedEncoder(111, second=0xB1), 0xB2: FixedEncoder(222, second=0xB1)})
        self.addCleanup(encoders.close)
        self.run_driver(encoders.path, "mode: bus", {"axis1": "address: 1, bits: 16", "axis2": "address: 2, bits: 16"})
        wait_for(lambda: len(self.valid("axis1")) > 20, "positions of the right one")
        self.listener.wait("DEVICE/axis2", lambda d: d.errors[4] > 0, "wrong echoes counted")
        self.assertEqual(self.valid("axis2"), [])

    # -- our simulator, read by Python

    def simulate(self, bus, device, simulate):
        config = self.write(f"""machine: test
buses:
  rs485-0:
    family: saa_serial
    link: {{baud: 115200}}
    {bus}
    simulate:
      axis1: {simulate}
    devices:
      axis1: {device}
""")
        self.simulator(config, "rs485-0")
        port = os.open(next(self.run_dir.glob("**/rs485-0.pty")), os.O_RDWR | os.O_NOCTTY)
        self.addCleanup(os.close, port)
        tty.setraw(port)
        mode = termios.tcgetattr(port)
        mode[4] = mode[5] = termios.B115200  # at another rate both receive noise
        termios.tcsetattr(port, termios.TCSANOW, mode)
        return port

    def read(self, port, size, limit=20.0):
        data = b""
        deadline = time.monotonic() + limit
        while len(data) < size:
            self.assertTrue(select.select([port], [], [], max(0.0, deadline - time.monotonic()))[0],
                            f"{size} bytes, not {data.hex(' ')}")
            data += os.read(port, size - len(data))
        return data

    def test_the_simulators_stream_is_the_manuals(self):
        port = self.simulate("mode: timing\n    refresh_hz: 100", "{bits: 18}", "{start_deg: 100, speed_rpm: 60}")
        size = data_bytes(18) + 3
        stream = self.read(port, 4 * size)
        begin = next(n for n in range(size) if stream[n:n + 2] == b"\xFF\x81" and stream[n + size:n + size + 2] == b"\xFF\x81")
        self.read(port, begin)
        counts = positions(self.read(port, 200 * size), 18)
        # 60 rpm at 100 Hz: 2^18 / 100 counts a frame.
        steps = [(b - a) % 2**18 for a, b in zip(counts, counts[1:])]
        self.assertLessEqual(max(abs(step - 2**18 / 100) for step in steps), 30)

    def test_the_simulators_answers_are_the_manuals(self):
        port = self.simulate("mode: bus\n    zero_clearing: true", "{bits: 14, address: 3}", "{start_deg: 8.42}")
        os.write(port, b"\xBC\xAA\xB3")
        self.assertEqual(self.read(port, 5), frame(int(8.42 / 360 * 2**14), 14))
        os.write(port, b"\xBC\xAA\xC3")
        os.write(port, b"\xBC\xAA\xB4")  # nobody
        self.assertEqual(select.select([port], [], [], 0.3)[0], [], "neither is answered")
        os.write(port, b"\xBC\xAA\xB3")
        self.assertEqual(self.read(port, 5), frame(0, 14))


if __name__ == "__main__":
    unittest.main(verbosity=2)
