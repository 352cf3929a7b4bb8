"""Reads an LCM event log by its published format and by stock liblcm, and decodes messages with the Python that lcm-gen
makes: all independent of axlecast's own code."""

import ctypes
import os
import pathlib
import socket
import struct
import subprocess
import sys
import tempfile

SYNC = 0xEDA1DA01


def events(path):
    """(channel, data) of every event; raises ValueError where the file is damaged."""
    data = pathlib.Path(path).read_bytes()
    offset = 0
    while offset < len(data):
        sync, _, _, channel_size, data_size = struct.unpack_from(">IqqII", data, offset)
        if sync != SYNC:
            raise ValueError(f"no event at byte {offset}")
        offset += 28
        channel = data[offset:offset + channel_size].decode()
        offset += channel_size
        yield channel, data[offset:offset + data_size]
        offset += data_size


def whole_records(data):
    """The bytes of each record, up to where no whole one follows."""
    offset = 0
    while len(data) - offset >= 28:
        sync, _, _, channel_size, data_size = struct.unpack_from(">IqqII", data, offset)
        end = offset + 28 + channel_size + data_size
        if sync != SYNC or end > len(data):
            return
        yield data[offset:end]
        offset = end


class StockEvent(ctypes.Structure):
    """lcm_eventlog_event_t of lcm/eventlog.h."""
    _fields_ = [("number", ctypes.c_int64), ("utime", ctypes.c_int64), ("channel_size", ctypes.c_int32),
                ("data_size", ctypes.c_int32), ("channel", ctypes.c_char_p), ("data", ctypes.c_void_p)]


def stock_events(path):
    """(channel, data) of every event, read by stock liblcm."""
    lcm = ctypes.CDLL("liblcm.so.1")
    lcm.lcm_eventlog_create.restype = ctypes.c_void_p
    lcm.lcm_eventlog_read_next_event.restype = ctypes.POINTER(StockEvent)
    log = ctypes.c_void_p(lcm.lcm_eventlog_create(str(path).encode(), b"r"))
    while event := lcm.lcm_eventlog_read_next_event(log):
        yield event.contents.channel.decode(errors="replace"), ctypes.string_at(event.contents.data, event.contents.data_size)
        lcm.lcm_eventlog_free_event(event)
    lcm.lcm_eventlog_destroy(log)


def record(utime, channel, data=b"", number=0):
    """One event as lcm-logger writes it."""
    name = channel.encode()
    return struct.pack(">IqqII", SYNC, number, utime, len(name), len(data)) + name + data


def write(path, events, begin=1_790_000_000_000_000):
    """A log of (us since `begin`, channel, data)."""
    path = pathlib.Path(path)
    path.write_bytes(b"".join(record(begin + us, channel, data, number)
                              for number, (us, channel, data) in enumerate(events)))
    return path


def generated_types():
    """The axlecast package as lcm-gen writes it for Python."""
    definitions = sorted(pathlib.Path(os.environ["AXLECAST_SOURCE"], "lcmtypes").glob("*.lcm"))
    with tempfile.TemporaryDirectory(prefix="axlecast-lcm-gen-") as folder:
        subprocess.run(["lcm-gen", "-p", "--ppath", folder, *definitions], check=True)
        sys.path.insert(0, folder)
        import axlecast  # noqa: PLC0415 (made just now)
        sys.path.remove(folder)
    return axlecast


def datagram(number, channel, data=b""):
    """A short message in LCM's wire protocol: header, channel, NUL, payload."""
    return struct.pack(">II", 0x4C433032, number) + channel.encode() + b"\0" + data


def publish(port, channel, data, group="239.255.76.67"):
    """Sends one LCM message."""
    packet = datagram(publish.sequence, channel, data)
    publish.sequence += 1
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        sender.sendto(packet, (group, port))


publish.sequence = 0
