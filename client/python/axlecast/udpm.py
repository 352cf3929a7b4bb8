"""Datagrams of LCM's UDP multicast to messages, and the messages that are missing. No socket and no clock.

Wire format: LCM 1.3.1, "UDP Multicast Protocol Description". Big-endian. Short: u32 0x4C433032, u32 number, channel, NUL, data. Fragment:
u32 0x4C433033, u32 number, u32 size of the message, u32 offset, u16 fragment, u16 fragments, then in fragment 0 channel and NUL, then
data. A sender numbers its messages of all channels from 0, so that a gap is a message of some channel.
"""

from __future__ import annotations

import struct
from collections import OrderedDict
from typing import NamedTuple

SHORT = 0x4C433032  # "LC02"
FRAGMENT = 0x4C433033  # "LC03"
LONGEST_CHANNEL = 63  # bytes, without the NUL
SELF_TEST = "LCM_SELF_TEST"  # liblcm sends it to itself

_HEAD = struct.Struct(">II")
_FRAGMENT_HEAD = struct.Struct(">IIIIHH")

# The network address of a sender: (host, port), with IPv6 also scope and flow.
Address = tuple


class Message(NamedTuple):
    """A complete message."""

    channel: str
    data: bytes
    utime: int  #: us, UNIX time at which it was read from the socket
    sender: Address


class MessageNumbers:
    """The numbers of one sender: which messages came, and how many are missing. They wrap around at 2**32.

    The first number is the begin; earlier messages are not missing. A number among the newest REMEMBERED is late if it was missing (it
    is not lost any more), and otherwise repeated. A number further back, a larger jump ahead, and 0 after a silence begin a new
    numbering, because senders of LCM start at 0.
    """

    REMEMBERED = 4096
    FARTHEST_AHEAD = 1 << 24
    STRAGGLERS = 64  # late ones from before the begin
    SILENCE_US = 50_000  # a copy by the network comes sooner, a new program later

    __slots__ = ("lost", "repeated", "_next", "_span", "_missing", "_last_utime")

    def __init__(self) -> None:
        self.lost = 0  #: messages that did not come
        self.repeated = 0  #: messages that came twice
        self._next: int | None = None
        self._span = 0  # remembered numbers before _next
        self._missing: OrderedDict[int, None] = OrderedDict()  # of these, oldest first
        self._last_utime = 0

    def receive(self, number: int, utime: int) -> None:
        """Counts a message that was received at `utime` (us, UNIX time)."""
        behind = self._place(number, utime)
        if behind == 0 or behind > self._span:
            return
        if number in self._missing:
            del self._missing[number]
            self.lost -= 1
        else:
            self.repeated += 1

    def expect(self, number: int, utime: int) -> None:
        """Counts a part of a message: the message is lost unless `receive` follows."""
        if self._place(number, utime) == 0:
            self._missing[number] = None
            self.lost += 1

    def _place(self, number: int, utime: int) -> int:
        """Returns 0 if the number is new, else how far it is behind the next one."""
        if self._next is None:
            self._begin(number)
        behind = _signed(self._next - number)
        restarted = number == 0 and behind > 0 and utime - self._last_utime >= self.SILENCE_US
        if restarted or behind > self._span + self.STRAGGLERS or behind <= -self.FARTHEST_AHEAD:
            self._begin(number)
            behind = 0
        self._last_utime = utime
        if behind > 0:
            return behind
        skipped = -behind
        self.lost += skipped
        for missing in range(max(0, skipped - self.REMEMBERED), skipped):
            self._missing[(self._next + missing) & 0xFFFFFFFF] = None
        self._next = (number + 1) & 0xFFFFFFFF
        self._span = min(self._span + skipped + 1, self.REMEMBERED)
        while self._missing and _signed(self._next - next(iter(self._missing))) > self._span:
            self._missing.popitem(last=False)
        return 0

    def _begin(self, number: int) -> None:
        self._next = number
        self._span = 0
        self._missing.clear()


def _signed(difference: int) -> int:
    """The difference of two numbers of 32 bits, -2**31 to 2**31 - 1."""
    return ((difference + 0x80000000) & 0xFFFFFFFF) - 0x80000000


class _Partial:
    """A message of which fragments are missing."""

    __slots__ = ("size", "count", "channel", "pieces", "bytes", "begin")

    def __init__(self, size: int, count: int, utime: int) -> None:
        self.size = size
        self.count = count
        self.channel: bytes | None = None
        self.pieces: dict[int, tuple[int, bytes]] = {}
        self.bytes = 0
        self.begin = utime

    def add(self, number: int, offset: int, payload: bytes) -> None:
        if number not in self.pieces:
            self.pieces[number] = (offset, payload)
            self.bytes += len(payload)

    def joined(self) -> bytes | None:
        """The whole message; None while fragments are missing. Raises ValueError if they do not fit together."""
        if len(self.pieces) < self.count:
            return None
        data = bytearray()
        for _, (offset, payload) in sorted(self.pieces.items()):
            if offset != len(data):
                raise ValueError("fragments do not follow each other")
            data += payload
        if len(data) != self.size or self.channel is None:
            raise ValueError("fragments are not the message")
        return bytes(data)


class Assembler:
    """Converts datagrams, in any order, to messages. Its memory is bounded, whatever arrives."""

    MAX_SENDERS = 1024
    MAX_BYTES = 64 << 20  # of incomplete messages, and of one message
    AGE_US = 2_000_000  # an incomplete message that is older is lost

    def __init__(self) -> None:
        self.received = 0  #: messages
        self.malformed = 0  #: datagrams that are not LCM's
        self._senders: OrderedDict[Address, MessageNumbers] = OrderedDict()  # the one that is silent for longest is first
        self._partials: OrderedDict[tuple[Address, int], _Partial] = OrderedDict()  # oldest first
        self._bytes = 0
        self._removed = [0, 0]  # lost and repeated of removed senders

    @property
    def lost(self) -> int:
        """Messages of all senders that are missing."""
        return self._removed[0] + sum(numbers.lost for numbers in self._senders.values())

    @property
    def repeated(self) -> int:
        """Messages of all senders that came twice."""
        return self._removed[1] + sum(numbers.repeated for numbers in self._senders.values())

    def lost_by_sender(self) -> dict[Address, int]:
        """Missing messages of each sender that has any."""
        return {sender: numbers.lost for sender, numbers in self._senders.items() if numbers.lost > 0}

    def add(self, datagram: bytes, sender: Address, utime: int) -> Message | None:
        """Returns the message that the datagram completes, or None. `utime`: us, UNIX time of the reception."""
        if len(datagram) < _HEAD.size:
            self.malformed += 1
            return None
        magic, number = _HEAD.unpack_from(datagram)
        if magic == SHORT:
            end = datagram.find(b"\0", 8, 8 + LONGEST_CHANNEL + 1)
            if end <= 8:
                self.malformed += 1
                return None
            return self._take(sender, number, datagram[8:end], datagram[end + 1:], utime)
        if magic == FRAGMENT and len(datagram) >= _FRAGMENT_HEAD.size:
            return self._add_fragment(datagram, sender, utime)
        self.malformed += 1
        return None

    def _take(self, sender: Address, number: int, channel: bytes, data: bytes, utime: int) -> Message | None:
        self._numbers(sender).receive(number, utime)
        name = channel.decode("utf-8", "replace")
        if name == SELF_TEST:
            return None
        self.received += 1
        return Message(name, data, utime, sender)

    def _numbers(self, sender: Address) -> MessageNumbers:
        numbers = self._senders.get(sender)
        if numbers is None:
            if len(self._senders) >= self.MAX_SENDERS:
                _, gone = self._senders.popitem(last=False)
                self._removed[0] += gone.lost
                self._removed[1] += gone.repeated
            numbers = self._senders[sender] = MessageNumbers()
        else:
            self._senders.move_to_end(sender)
        return numbers

    def _add_fragment(self, datagram: bytes, sender: Address, utime: int) -> Message | None:
        _, number, size, offset, fragment, count = _FRAGMENT_HEAD.unpack_from(datagram)
        payload, channel = datagram[_FRAGMENT_HEAD.size:], None
        if fragment == 0:
            end = payload.find(b"\0", 0, LONGEST_CHANNEL + 1)
            channel, payload = (payload[:end], payload[end + 1:]) if end > 0 else (None, b"")
        if fragment >= count or size > self.MAX_BYTES or offset + len(payload) > size or (fragment == 0) != (channel is not None):
            self.malformed += 1
            return None
        self._numbers(sender).expect(number, utime)
        self._expire(utime)
        key = (sender, number)
        partial = self._partials.get(key)
        if partial is None:
            partial = self._partials[key] = _Partial(size, count, utime)
        elif (partial.size, partial.count) != (size, count):
            self.malformed += 1
            return None
        before = partial.bytes
        partial.add(fragment, offset, payload)
        self._bytes += partial.bytes - before
        if channel is not None:
            partial.channel = channel
        try:
            data = partial.joined()
        except ValueError:
            self.malformed += 1
            self._drop(key)
            return None
        if data is None:
            while self._bytes > self.MAX_BYTES:
                self._drop(next(iter(self._partials)))
            return None
        self._drop(key)
        return self._take(sender, number, partial.channel, data, utime)

    def _expire(self, utime: int) -> None:
        while self._partials:
            key, partial = next(iter(self._partials.items()))
            if abs(utime - partial.begin) < self.AGE_US:
                return
            self._drop(key)

    def _drop(self, key: tuple[Address, int]) -> None:
        self._bytes -= self._partials.pop(key).bytes
