"""The head of each message that a process publishes."""

from __future__ import annotations

import secrets
import time
from collections import Counter
from typing import Any

from axlecast.time_base import id_of_name, own_clock_id


class Origin:
    """What the messages of one process have in common, and their sequence numbers."""

    def __init__(self, machine: str = "") -> None:
        """`machine`: the name of the machine; empty: not stated."""
        self.boot_id = secrets.randbits(62) + 1
        self.machine_id = id_of_name(machine) if machine else 0
        self._seq: Counter[str] = Counter()

    def stamp(self, message: Any, channel: str) -> None:
        """Sets utime, mono_ns, boot_id, seq, machine_id and clock_id of a message that is published now."""
        message.utime = time.time_ns() // 1_000
        message.mono_ns = time.monotonic_ns()
        message.boot_id = self.boot_id
        message.seq = self._seq[channel]
        message.machine_id = self.machine_id
        message.clock_id = own_clock_id()
        self._seq[channel] += 1

    def is_foreign(self, message: Any) -> bool:
        """Returns True if the message states another machine."""
        return bool(self.machine_id and message.machine_id and message.machine_id != self.machine_id)
