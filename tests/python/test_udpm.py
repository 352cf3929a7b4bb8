"""Datagrams of LCM to messages in Python: bytes of stock liblcm, loss, order, bounded memory, anything as input."""

import os
import random
import struct
import sys
import unittest

import lcm_log

sys.path.insert(0, os.environ["AXLECAST_PYTHON_PACKAGE"])
from axlecast.udpm import FRAGMENT, SHORT, Assembler, MessageNumbers  # noqa: E402 pylint: disable=wrong-import-position

SENDER = ("10.0.0.1", 40_001)
SECOND = 1_000_000  # us


def short(number):
    return lcm_log.datagram(number, "A")


def fragments(number, channel, data, size):
    """The fragments of a message, each with at most `size` bytes of data."""
    offsets = range(0, len(data), size)
    return [struct.pack(">IIIIHH", FRAGMENT, number, len(data), offset, index, len(offsets))
            + (channel.encode() + b"\0" if index == 0 else b"") + data[offset:offset + size] for index, offset in enumerate(offsets)]


class Numbers(unittest.TestCase):
    def counts(self, numbers, gap_us=1_000, start=0):
        counted, utime = MessageNumbers(), start
        for number in numbers:
            utime += gap_us
            counted.receive(number, utime)
        return counted.lost, counted.repeated

    def test_a_gap_is_lost_until_the_late_message_comes(self):
        self.assertEqual(self.counts([5, 6, 7]), (0, 0))
        self.assertEqual(self.counts([5, 8]), (2, 0))
        self.assertEqual(self.counts([5, 8, 6]), (1, 0))
        self.assertEqual(self.counts([5, 8, 6, 7, 7]), (0, 1))

    def test_numbers_wrap_around(self):
        self.assertEqual(self.counts([2**32 - 2, 2**32 - 1, 0, 1]), (0, 0))
        self.assertEqual(self.counts([2**32 - 2, 1]), (2, 0))
        self.assertEqual(self.counts([2**32 - 2, 1, 2**32 - 1, 0]), (0, 0))

    def test_messages_before_the_begin_are_not_missing(self):
        self.assertEqual(self.counts([100, 99, 60, 101]), (0, 0))

    def test_a_sender_that_starts_again_loses_nothing(self):
        self.assertEqual(self.counts([10_000, 10_001, 0, 1]), (0, 0), "further back than a late message")
        self.assertEqual(self.counts([10, 11, 12]), (0, 0))
        restarted = MessageNumbers()
        for number, utime in ((0, 0), (1, 10), (2, 20), (0, 20 + 50_000), (1, 60_000)):
            restarted.receive(number, utime)
        self.assertEqual((restarted.lost, restarted.repeated), (0, 0), "0 after a silence")
        self.assertEqual(self.counts([1, 2 + 2**24]), (0, 0), "a jump that no loss explains")

    def test_a_large_gap_counts_whole_and_remembers_its_newest_part(self):
        self.assertEqual(self.counts([0, 100_001]), (100_000, 0))
        self.assertEqual(self.counts([0, 100_001, 100_000, 100_001 - 4_095]), (99_998, 0))

    def test_random_streams_are_counted_exactly(self):
        chance = random.Random(3)
        for _ in range(200):
            begin = chance.randrange(2**32)
            numbers = list(range(begin, begin + 500))
            kept = [numbers[0]] + [number for number in numbers[1:-1] if chance.random() > 0.1] + [numbers[-1]]
            twice = chance.sample(kept[1:], 5)
            sent = [number & 0xFFFFFFFF for number in kept]
            for number in twice:
                sent.insert(min(len(sent), kept.index(number) + chance.randrange(1, 40)), number & 0xFFFFFFFF)
            self.assertEqual(self.counts(sent), (numbers[-1] - numbers[0] + 1 - len(kept), 5))


class Datagrams(unittest.TestCase):
    def setUp(self):
        self.assembler = Assembler()

    def add(self, datagram, sender=SENDER, utime=0):
        return self.assembler.add(datagram, sender, utime)

    def test_messages_of_stock_lcm(self):
        # liblcm 1.3.1 of Debian 12: lcm_publish of 5 bytes, and of none.
        message = self.add(bytes.fromhex("4c43303200000000504f534954494f4e2f6178697331000102030405"))
        self.assertEqual((message.channel, message.data), ("POSITION/axis1", bytes([1, 2, 3, 4, 5])))
        message = self.add(bytes.fromhex("4c43303200000001454d50545900"))
        self.assertEqual((message.channel, message.data), ("EMPTY", b""))
        # 150,000 bytes on BIG: the heads of its fragments as captured.
        data = bytes(range(250)) * 600
        for head, begin, end in (("4c43303300000002000249f0000000000000000342494700", 0, 65_483),
                                 ("4c43303300000002000249f00000ffcb00010003", 65_483, 130_970)):
            self.assertIsNone(self.add(bytes.fromhex(head) + data[begin:end]))
        message = self.add(bytes.fromhex("4c43303300000002000249f00001ff9a00020003") + data[130_970:])
        self.assertEqual((message.channel, message.data), ("BIG", data))
        self.assertEqual((self.assembler.received, self.assembler.lost, self.assembler.malformed), (3, 0, 0))

    def test_fragments_in_any_order_and_twice(self):
        chance = random.Random(5)
        for number in range(100):
            data = chance.randbytes(chance.randrange(1, 5_000))
            parts = fragments(number, "BIG", data, chance.randrange(1, 900))
            if len(parts) > 1:
                parts.insert(0, chance.choice(parts))
            chance.shuffle(parts)
            complete = [message for part in parts if (message := self.add(part)) is not None]
            self.assertEqual([(message.channel, message.data) for message in complete], [("BIG", data)])
        self.assertEqual((self.assembler.received, self.assembler.lost), (100, 0))

    def test_a_message_with_a_missing_fragment_is_lost(self):
        self.add(short(0))
        for part in fragments(1, "BIG", bytes(1_000), 100)[:-1]:
            self.assertIsNone(self.add(part))
        self.add(short(2))
        self.assertEqual(self.assembler.lost, 1)
        self.assertEqual(self.assembler.lost_by_sender(), {SENDER: 1})
        late = fragments(1, "BIG", bytes(1_000), 100)[-1]
        self.assertIsNone(self.add(late, utime=3 * SECOND), "its other fragments are too old")

    def test_senders_do_not_mix(self):
        other = ("10.0.0.2", 40_001)
        first, second = (fragments(7, "BIG", bytes([fill]) * 50, 30) for fill in (1, 2))
        self.assertIsNone(self.add(first[0]))
        self.assertIsNone(self.add(second[0], other))
        self.assertEqual(self.add(second[1], other).data, bytes([2]) * 50)
        self.assertEqual(self.add(first[1]).data, bytes([1]) * 50)

    def test_contradictory_fragments_are_no_message(self):
        parts = fragments(1, "BIG", bytes(100), 50)
        overlapping = struct.pack(">IIIIHH", FRAGMENT, 2, 100, 40, 1, 2) + bytes(50)
        other_size = struct.pack(">IIIIHH", FRAGMENT, 3, 99, 50, 1, 2) + bytes(49)
        for number, second in ((2, overlapping), (3, other_size)):
            self.assertIsNone(self.add(fragments(number, "BIG", bytes(100), 50)[0]))
            self.assertIsNone(self.add(second))
        for wrong in (struct.pack(">IIIIHH", FRAGMENT, 4, 100, 60, 1, 2) + bytes(50),  # behind its end
                      struct.pack(">IIIIHH", FRAGMENT, 4, 100, 0, 2, 2) + bytes(50),   # fragment 2 of 2
                      struct.pack(">IIIIHH", FRAGMENT, 4, 2**31, 0, 1, 2)):            # larger than any
            self.assertIsNone(self.add(wrong))
        self.assertEqual(self.assembler.received, 0)
        self.assertIsNone(self.add(parts[0]))
        self.assertIsNotNone(self.add(parts[1]))

    def test_memory_is_bounded(self):
        self.assembler.MAX_BYTES = 10_000
        for number in range(1_000):
            self.assertIsNone(self.add(fragments(number, "BIG", bytes(1_000), 500)[0]))
        held = sum(partial.bytes for partial in self.assembler._partials.values())  # pylint: disable=protected-access
        self.assertLessEqual(held, 10_000)
        for number in range(5_000):
            self.add(short(number), ("10.1.1.1", number))
        self.assertEqual(len(self.assembler._senders), 1_024)  # pylint: disable=protected-access

    def test_any_bytes(self):
        chance = random.Random(7)
        heads = [b"", struct.pack(">I", SHORT), struct.pack(">I", FRAGMENT)]
        for _ in range(50_000):
            self.add(chance.choice(heads) + chance.randbytes(chance.randrange(40)), ("h", chance.randrange(3)), chance.randrange(SECOND))
        self.add(struct.pack(">II", SHORT, 1) + b"\xff\xfe\0x")
        self.assertGreater(self.assembler.malformed, 10_000)


if __name__ == "__main__":
    unittest.main()
