"""BiSS-C: a Python encoder against our driver and our decoder, a Python master against our simulator."""

import json
import random
import subprocess
import time
import unittest

from biss import Encoder, Master, check, frame, position, transfer
from lcm_listener import Listener
from machine import BIN, Machine, wait_for

VALID = 0x1


class ManualsExample(unittest.TestCase):
    def test_the_peer_agrees_with_the_manual(self):
        """5.6: 100010101110001110 has the CRC 110101, in negative logic 001010."""
        self.assertEqual(check("100010101110001110"), "001010")
        self.assertEqual(frame(35555, 16, warning=True), "100010101110001110001010")
        self.assertEqual(position(transfer(frame(35555, 16, warning=True), 40, delay=3), 16), (35555, "10"))


class Decoder(unittest.TestCase):
    def decode(self, frames, *settings):
        options = [word for setting in settings for word in ("--set", setting)]
        done = subprocess.run([BIN / "axlecast", "decode", "biss", *options, "--bits"], input="\n".join(frames),
                              stdout=subprocess.PIPE, text=True, check=False)
        return [json.loads(line) for line in done.stdout.splitlines()]

    def test_frames_of_every_resolution(self):
        chance = random.Random(7)
        for bits in range(10, 33):
            sent = [(chance.getrandbits(bits), chance.random() < 0.5, chance.random() < 0.5) for _ in range(20)]
            frames = [frame(counts, bits, error=error, warning=warning) for counts, error, warning in sent]
            for (counts, error, warning), json_ in zip(sent, self.decode(frames, f"bits={bits}"), strict=True):
                self.assertEqual(json_["counts"], counts)
                self.assertAlmostEqual(json_["angle_deg"], 360 * counts / 2**bits, places=9)
                self.assertEqual(json_["alarms"], ["error"] * error + ["warning"] * warning)

    def test_turns_and_a_crc_of_16_bits(self):
        polynomial = f"{0x190D9:b}"
        frames = [frame(77, 20, turns=turns, turn_bits=12, polynomial=polynomial) for turns in (0, 1, 4095)]
        found = self.decode(frames, "bits=20", "turn_bits=12", "crc_bits=16", "crc_poly=0x190D9")
        self.assertEqual([(json_["counts"], json_["turns"]) for json_ in found], [(77, 0), (77, 1), (77, 4095)])

    def test_transfers_of_any_delay(self):
        cases = [(delay, busy) for delay in range(12) for busy in range(1, 12)]
        frames = [transfer(frame(54321, 17), 64, delay, busy) for delay, busy in cases]
        found = self.decode(frames, "bits=17", "frame=transfer")
        self.assertEqual([(json_["counts"], json_["ack_at"], json_["start_at"]) for json_ in found],
                         [(54321, 2 + delay, 2 + delay + busy) for delay, busy in cases])


class Lines(Machine):
    def configure(self, keys, device):
        self.config = self.write(f"""machine: test
buses:
  spi0:
    family: biss
    {keys}
    simulate: {{axis1: {{start_deg: 195.3095}}}}
    devices:
      axis1: {{{device}, unit: deg, publish_hz: 200}}
""")
        return self.run_dir / "test" / "spi0.spi"

    def test_our_driver_reads_the_peer(self):
        def samples(n, clocks):
            if n % 10 == 9:
                return "1" * clocks  # the encoder was away
            return transfer(frame(2_000_000 + n, 23, turns=3, turn_bits=8), clocks, delay=n % 4, busy=2 + n % 7)

        path = self.configure("poll_hz: 200\n    line_delay_ns: 2000", "model: custom, max_speed_rpm: 6000, bits: 23, turn_bits: 8, busy_jitter_us: 10")
        encoder = Encoder(path, samples)
        self.addCleanup(encoder.close)
        listener = Listener()
        self.addCleanup(listener.close)
        self.driver(self.config, "spi0", family="biss")
        wait_for(lambda: len(listener.of("POSITION/axis1")) > 200, "200 positions")
        positions = [m for m in listener.of("POSITION/axis1") if m.flags & VALID]
        counts = [m.raw_counts for m in positions]
        self.assertEqual(counts, sorted(counts))
        self.assertTrue(all((n - 2_000_000) % 10 != 9 for n in counts))
        self.assertEqual({m.raw_turns for m in positions}, {3})
        self.assertEqual(set(encoder.settings), {(2, 8, 1_000_000)}, "mode, bits of a word, clock")

    def test_the_peer_reads_our_simulator(self):
        path = self.configure("poll_hz: 200", "bits: 16")
        self.start("simulator", BIN / "axlecast", "simulate", self.config, "--bus", "spi0")
        wait_for(path.exists, "the simulator's socket")
        master = Master(path)
        self.addCleanup(master.close)
        for mode in (2, 3):
            samples = master.clock(6, mode)
            self.assertEqual(samples, transfer(frame(35555, 16), 48))
            self.assertEqual(position(samples, 16), (35555, "11"))
            time.sleep(0.001)  # more than its time-out
        self.assertEqual(master.clock(6, mode=0), "1" * 48, "its clock idles high")


if __name__ == "__main__":
    unittest.main()
