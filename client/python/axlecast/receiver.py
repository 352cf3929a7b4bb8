"""Receives and sends LCM messages over UDP multicast, without any other package.

    from axlecast.receiver import Receiver

    with Receiver("udpm://239.255.76.67:7667?ttl=0") as receiver:
        for message in receiver.messages():
            print(message.channel, receiver.decode(message))

Or within asyncio: `async for message in receiver: ...`. A receiver belongs to one thread.
"""

from __future__ import annotations

import asyncio
import select
import socket
import struct
import time
import types
from collections.abc import AsyncIterator, Callable, Iterable, Iterator
from typing import Any, Self

from axlecast.lcm_url import DEFAULT, LcmUrl, interface_index, parse
from axlecast.message_types import MessageTypes
from axlecast.udpm import FRAGMENT, LONGEST_CHANNEL, SHORT, Assembler, Message

_BUFFER = 32 << 20  # bytes
_LARGEST_DATAGRAM = 65_535
_LARGEST_SHORT = 65_499  # bytes of channel, NUL and data in one datagram, as liblcm
_SO_RCVBUFFORCE = 33


class _Port:
    """A socket for the group of a URL. A context manager: afterwards the socket is closed."""

    def __init__(self, url: str, prefix: str, set_up: Callable[[socket.socket, LcmUrl, int], None]) -> None:
        self._url = parse(url)
        self._prefix = prefix
        self._socket = socket.socket(socket.AF_INET6 if self._url.is_ipv6 else socket.AF_INET, socket.SOCK_DGRAM)
        try:
            set_up(self._socket, self._url, interface_index(self._url.interface))
        except OSError:
            self._socket.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the socket: nothing is received or sent any more."""
        self._socket.close()


class Receiver(_Port):
    """The messages of a URL's group, from all senders. Construct it before the messages that must not be missed are sent."""

    def __init__(self, url: str = DEFAULT, *, prefix: str = "") -> None:
        """`prefix`: of the machine's channels (`lcm: {prefix: press3.}`): only these are returned, without the prefix.

        Raises ValueError if the URL is not valid, and OSError if the group cannot be joined.
        """
        super().__init__(url, prefix, _join)
        self._assembler = Assembler()
        self._types = MessageTypes()

    def fileno(self) -> int:
        """For `select`: readable if `messages(0)` may return something."""
        return self._socket.fileno()

    def messages(self, timeout: float | None = None) -> Iterator[Message]:
        """Returns messages one by one, in the order in which they are complete. `timeout`: ends after so many seconds without a message;
        None: never."""
        while (message := self._next(timeout)) is not None:
            yield message

    async def __aiter__(self) -> AsyncIterator[Message]:
        loop = asyncio.get_running_loop()
        while True:
            while (message := self._next(0)) is not None:
                yield message
            ready = loop.create_future()
            loop.add_reader(self._socket, lambda: ready.done() or ready.set_result(None))
            try:
                await ready
            finally:
                loop.remove_reader(self._socket)

    def _next(self, timeout: float | None) -> Message | None:
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            try:
                datagram, sender = self._socket.recvfrom(_LARGEST_DATAGRAM)
            except BlockingIOError:
                left = None if deadline is None else deadline - time.monotonic()
                if left is not None and left <= 0:
                    return None
                select.select([self._socket], [], [], left)
                continue
            message = self._assembler.add(datagram, sender, time.time_ns() // 1000)
            if message is None or not message.channel.startswith(self._prefix):
                continue
            return message._replace(channel=message.channel[len(self._prefix):]) if self._prefix else message

    # -- types

    def register(self, *definitions: type | types.ModuleType) -> None:
        """Makes types of `lcm-gen -p` known to `decode`: classes, or packages with all their types. Those of axlecast are known."""
        self._types.register(*definitions)

    def decode(self, message: Message) -> Any:
        """Returns the message as an object of its type, for example axlecast.position_t; None if no known type has its fingerprint, or
        if it is damaged."""
        return self._types.decode(message.data)

    # -- what was lost

    @property
    def received(self) -> int:
        """Messages since the start, also of other channels."""
        return self._assembler.received

    @property
    def lost(self) -> int:
        """Messages that senders have sent and this receiver has not received, by the gaps in their numbers."""
        return self._assembler.lost

    def lost_by_sender(self) -> dict[tuple, int]:
        """The lost messages of each sender (address, port) that has any."""
        return self._assembler.lost_by_sender()


class Sender(_Port):
    """Sends messages to the group of a URL."""

    def __init__(self, url: str = DEFAULT, *, prefix: str = "") -> None:
        """Raises ValueError if the URL is not valid, and OSError if this host has no such interface."""
        super().__init__(url, prefix, _select_interface)
        self._number = 0

    def publish(self, channel: str, message: bytes | Any) -> None:
        """Sends bytes, or an object of a type of `lcm-gen -p`. Raises ValueError if the channel has no or more than 63 bytes, and OSError
        if the kernel refuses."""
        name = (self._prefix + channel).encode()
        if not 0 < len(name) <= LONGEST_CHANNEL or b"\0" in name:
            raise ValueError(f"a channel has 1 to {LONGEST_CHANNEL} bytes, not {len(name)}: {channel}")
        data = message if isinstance(message, bytes) else message.encode()
        for datagram in _datagrams(self._number, name, data):
            self._socket.sendto(datagram, (self._url.group, self._url.port))
        self._number = (self._number + 1) & 0xFFFFFFFF


def _datagrams(number: int, channel: bytes, data: bytes) -> Iterable[bytes]:
    if len(channel) + 1 + len(data) <= _LARGEST_SHORT:
        return [struct.pack(">II", SHORT, number) + channel + b"\0" + data]
    size = _LARGEST_DATAGRAM - 8 - 40 - 20  # of the payload: without the heads of UDP, IP and the fragment
    first = size - len(channel) - 1
    offsets = [0, *range(first, len(data), size)]
    ends = [*offsets[1:], len(data)]
    return [struct.pack(">IIIIHH", FRAGMENT, number, len(data), begin, index, len(offsets))
            + (channel + b"\0" if index == 0 else b"") + data[begin:end] for index, (begin, end) in enumerate(zip(offsets, ends))]


def _join(receiving: socket.socket, url: LcmUrl, index: int) -> None:
    """Lets the socket receive the group, on the interface of that index."""
    receiving.setblocking(False)
    receiving.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    size = url.recv_buf_size or _BUFFER
    try:
        receiving.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, size)  # with CAP_NET_ADMIN, beyond net.core.rmem_max
    except PermissionError:
        receiving.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, size)
    # The group's address: with another one, all groups of the port would arrive.
    receiving.bind((url.group, url.port))
    if url.is_ipv6:
        group = socket.inet_pton(socket.AF_INET6, url.group)
        receiving.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_JOIN_GROUP, group + struct.pack("@I", index))
    else:
        group = struct.pack("@4s4si", socket.inet_aton(url.group), bytes(4), index)
        receiving.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)


def _select_interface(sending: socket.socket, url: LcmUrl, index: int) -> None:
    """Lets the socket send by the interface of that index, with the URL's ttl."""
    if url.is_ipv6:
        sending.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_MULTICAST_HOPS, url.ttl)
        if index:
            sending.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_MULTICAST_IF, index)
    else:
        sending.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, url.ttl)
        if index:
            sending.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, struct.pack("@4s4si", bytes(4), bytes(4), index))
