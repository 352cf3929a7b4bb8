"""/dev/spidev in the guest: the program that appears as one (tests/vm/cuse_spidev.cpp), and its ioctls as spidev's
documentation has them (Documentation/spi/spidev.rst, linux/spi/spidev.h)."""

import ctypes
import fcntl
import os
import pathlib
import struct

from machine import wait_for

PROGRAMS = pathlib.Path(os.environ["AXLECAST_VM_PROGRAMS"])
RD_MODE, WR_MODE = 0x80016B01, 0x40016B01
RD_BITS, WR_BITS = 0x80016B03, 0x40016B03
RD_SPEED, WR_SPEED = 0x80046B04, 0x40046B04
RD_MODE32, WR_MODE32 = 0x80046B05, 0x40046B05


def message(count):
    return 0x40006B00 | count * 32 << 16


def stand_as(machine, name, socket):
    """/dev/<name>, whose transfers go to the simulator behind `socket`; ends with the test."""
    device = pathlib.Path("/dev", name)
    wait_for(lambda: not device.exists(), f"the end of the last {device}")
    process = machine.start(name, PROGRAMS / "cuse_spidev", name, socket)
    wait_for(lambda: opens(device), lambda: f"{device}; {machine.log(name)}")
    return process


def opens(device):
    try:
        Spidev(device).close()
    except OSError:
        return False
    return True


class Spidev:
    def __init__(self, path):
        self.file = os.open(path, os.O_RDWR)

    def close(self):
        os.close(self.file)

    def read(self, command, size):
        return int.from_bytes(fcntl.ioctl(self.file, command, bytes(size)), "little")

    def write(self, command, value, size):
        fcntl.ioctl(self.file, command, value.to_bytes(size, "little"))

    def transfer(self, *parts):
        """One message of transfers (bytes out or a length to clock zeros, clock in Hz, bits per word): the bytes in."""
        array, received, kept = b"", [], []
        for sent, hz, bits in parts:
            length = sent if isinstance(sent, int) else len(sent)
            tx = None if isinstance(sent, int) else ctypes.create_string_buffer(sent, length)
            rx = ctypes.create_string_buffer(length)
            kept.append(tx)
            received.append(rx)
            array += struct.pack("=QQIIHB5x", ctypes.addressof(tx) if tx else 0, ctypes.addressof(rx), length, hz, 0, bits)
        buffer = ctypes.create_string_buffer(array, len(array))
        total = ctypes.CDLL(None, use_errno=True).ioctl(self.file, ctypes.c_ulong(message(len(parts))), buffer)
        if total < 0:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
        return total, [rx.raw for rx in received]


def machine_file(bus, family, devices, link=None, simulate=None, keys=""):
    """A machine of one bus: with `simulate` the simulator's file, with `link` that of a driver on a real device."""
    place = f"simulate: {simulate}" if simulate else f"link: {link}"
    return f"""machine: test
bridge: {{unsigned_commands: allow}}
buses:
  {bus}:
    family: {family}
    {place}
    {keys}
    devices: {devices}
"""
