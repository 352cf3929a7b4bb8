"""Permits of a control process: "the machine is in a state in which this may be done". Needs the package python3-nacl.

    with PermitIssuer(machine="press1", key_file="/etc/axlecast/plc.key") as issuer:
        while at_rest():
            issuer.allow("axis1", ["zero_single_turn"], 200)    # in each cycle; it ends by itself
            ...
        issuer.withdraw("axis1")

docs/client.md, "Permits", has the rules. An issuer belongs to one thread, and sends only within its methods.
"""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Sequence
from typing import Self

from axlecast import permit_body_t, permit_t
from axlecast.command_client import DEFAULT_URL
from axlecast.origin import Origin
from axlecast.receiver import Sender
from axlecast.signing import PERMIT, Keys, key_id, sign
from axlecast.time_base import TimeBase, own_clock_id

_LONGEST_NAME = 64  # bytes
_MAX_PERMIT = 1_200  # bytes, permit_t.permit_size


@dataclasses.dataclass(slots=True)
class _Sent:
    """The permit of a device that was sent last."""

    operations: tuple[str, ...]
    valid_ms: int
    renew_ns: int  # it need not be sent again before


class PermitIssuer:
    """Signs and sends permits. A context manager: permits that were sent lapse by themselves."""

    MAX_VALID_MS = 500
    MAX_OPERATIONS = 24

    def __init__(self, url: str = DEFAULT_URL, *, machine: str = "", prefix: str = "", key_file: str | os.PathLike | None = None,
                 time_base: TimeBase | None = None) -> None:
        """As CommandClient. The key must have the role control. `time_base`: permits then also state their instant on the time base, so
        that drivers on other hosts need no agreement of UNIX time.

        Raises ValueError if an argument or the key is not valid, and OSError if nothing can be sent or the key cannot be read.
        """
        self._key = Keys.load(key_file, "").own
        self._origin = Origin(machine)
        self._time_base = time_base
        self._issue = 0
        self._sent: dict[str, _Sent] = {}
        self._sender = Sender(url, prefix=prefix)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the socket."""
        self._sender.close()

    def allow(self, device: str, operations: Sequence[str], valid_ms: int) -> None:
        """Permits exactly these operations until `valid_ms` (1 to 500) after this call. It replaces the earlier permit of the device. Call
        it in every cycle in which that is true: a change is sent at once, a renewal a quarter of `valid_ms` after the last message.

        Raises ValueError if a name, the number of operations or `valid_ms` is out of range, and OSError if the kernel refuses.
        """
        if not 1 <= valid_ms <= self.MAX_VALID_MS:
            raise ValueError(f"valid_ms is {valid_ms}: give 1 to {self.MAX_VALID_MS}")
        now = time.monotonic_ns()
        sent = self._sent.get(device)
        renews = sent is not None and sent.operations == tuple(operations) and sent.valid_ms == valid_ms
        if sent is not None and renews and now < sent.renew_ns:
            return
        self._send(device, operations, valid_ms, now)
        self._sent[device] = _Sent(tuple(operations), valid_ms, now + valid_ms * 1_000_000 // 4)

    def withdraw(self, device: str) -> None:
        """Permits nothing any more. A driver that receives it refuses every permit of an earlier call. If nothing was permitted, it does
        nothing. If the message is lost, the last permit lapses by itself. Raises OSError if the kernel refuses."""
        if device in self._sent:
            self._send(device, (), self.MAX_VALID_MS, time.monotonic_ns())
            del self._sent[device]

    def _send(self, device: str, operations: Sequence[str], valid_ms: int, now_ns: int) -> None:
        self._issue += 1
        body = permit_body_t()
        body.device = device
        body.issuer_boot_id = self._origin.boot_id
        body.issue = self._issue
        body.issued_utime = time.time_ns() // 1_000
        body.clock_id = own_clock_id()
        body.issued_mono_ns = now_ns
        if self._time_base is not None and (at := self._time_base.on_base(body.clock_id, now_ns, now_ns)).known:
            body.base_id, body.issued_base_ns, body.issued_half_width_ns = at.base_id, at.ns, at.half_width_ns
        body.valid_ms = valid_ms
        body.operations = list(operations)
        body.n_operations = len(operations)
        body.key_id = key_id(self._key)
        self._check(device, operations)
        message = permit_t()
        message.permit = body.encode()
        if len(message.permit) > _MAX_PERMIT:
            raise ValueError(f"the names of the operations are longer than a permit: {_MAX_PERMIT} bytes in all")
        message.permit_size = len(message.permit)
        message.sig = sign(self._key, PERMIT, message.permit)
        channel = "PERMIT/" + device
        self._origin.stamp(message, channel)
        self._sender.publish(channel, message)

    def _check(self, device: str, operations: Sequence[str]) -> None:
        if isinstance(operations, str) or len(operations) > self.MAX_OPERATIONS:
            raise ValueError(f"give a list of at most {self.MAX_OPERATIONS} operations")
        for name in (device, *operations):
            if not 0 < len(name.encode()) <= _LONGEST_NAME or "\0" in name:
                raise ValueError(f"a name of a device or an operation has 1 to {_LONGEST_NAME} bytes, not {len(name.encode())}: {name!r}")
