"""The guest itself: two controllers on one bus, seen by can-utils and by the kernel's own interface. If this fails,
what the other suites say of our drivers means nothing."""

import errno
import socket
import struct
import time
import unittest

import can_bus
from can_bus import Candump, cansend
from machine import wait_for

SO_TIMESTAMPNS = 35  # asm-generic/socket.h; Python names it not


class CanInterface(unittest.TestCase):
    def setUp(self):
        for interface in ("can0", "can1"):
            can_bus.up(interface)
            self.addCleanup(can_bus.down, interface)

    def raw(self, interface):
        raw = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.addCleanup(raw.close)
        raw.bind((interface,))
        raw.settimeout(10)
        return raw

    def test_frames_of_each_kind_pass_both_ways(self):
        frames = ["120#4726", "7FF#", "000#0102030405060708", "1FFFFFFF#AA", "00000120#55", "123#R"]
        for sender, receiver in (("can0", "can1"), ("can1", "can0")):
            dump = Candump(receiver, test=self)
            cansend(sender, *frames)
            self.assertEqual([f"{line.id}#{line.data}" for line in dump.wait(len(frames))], frames)

    def test_the_kernel_stamps_the_arrival(self):
        """However late a frame is read. The kernel begins with it some time after it was first asked to: a frame that
        has come before has the time at which it was read."""
        receiver, sender = self.raw("can0"), self.raw("can1")
        receiver.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)

        def stamped():
            before = time.time_ns()
            sender.send(struct.pack("=IB3x8s", 0x120, 2, bytes(8)))
            time.sleep(0.3)
            read = time.time_ns()
            _, ancillary, _, _ = receiver.recvmsg(16, 128)
            (level, kind, data), = ancillary
            self.assertEqual((level, kind), (socket.SOL_SOCKET, SO_TIMESTAMPNS))
            seconds, nanoseconds = struct.unpack("qq", data)
            return before <= seconds * 1_000_000_000 + nanoseconds < read
        wait_for(stamped, "a stamp of the arrival", limit=5)

    def test_an_own_frame_comes_back_when_it_was_acknowledged(self):
        sender = self.raw("can0")
        sender.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_RECV_OWN_MSGS, 1)
        frame = struct.pack("=IB3x8s", 0x123, 1, bytes([7]) + bytes(7))
        sender.send(frame)
        data, _, flags, _ = sender.recvmsg(16)
        self.assertEqual(data, frame)
        self.assertTrue(flags & socket.MSG_DONTROUTE or flags & socket.MSG_CONFIRM, flags)

    def test_an_interface_that_is_down_sends_nothing_and_comes_back(self):
        sender, dump = self.raw("can0"), Candump("can1", test=self)
        can_bus.down("can0")
        with self.assertRaises(OSError) as caught:
            sender.send(struct.pack("=IB3x8s", 0x120, 0, bytes(8)))
        self.assertEqual(caught.exception.errno, errno.ENETDOWN)
        can_bus.up("can0")
        sender.send(struct.pack("=IB3x8s", 0x121, 0, bytes(8)))
        self.assertEqual([line.id for line in dump.wait(1)], ["121"])

    def test_a_bit_rate_can_be_set_and_is_told(self):
        for rate in (125000, 250000, 500000, 1000000):
            can_bus.up("can0", rate)
            told = can_bus.details("can0")
            self.assertEqual((told["bittiming"]["bitrate"], told["state"]), (rate, "ERROR-ACTIVE"))
        can_bus.down("can0")
        self.assertEqual(can_bus.details("can0")["state"], "STOPPED")

    def test_this_bus_knows_no_bit_rates(self):
        """QEMU hands frames over whole. A wrong bit rate on the wire, a missing acknowledge and errors on the bus are
        the business of test_can_errors.py."""
        can_bus.up("can0", 125000)
        can_bus.up("can1", 1000000)
        dump = Candump("can1", test=self)
        cansend("can0", "120#01")
        self.assertEqual([line.data for line in dump.wait(1)], ["01"])
