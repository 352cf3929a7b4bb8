"""The types of messages that a program knows, by their fingerprints."""

from __future__ import annotations

import struct
import types
from typing import Any

import axlecast


class MessageTypes:
    """Decodes messages. The types of axlecast are known from the start."""

    def __init__(self) -> None:
        self._types: dict[bytes, type] = {}
        self.register(axlecast)

    def register(self, *definitions: type | types.ModuleType) -> None:
        """Makes types of `lcm-gen -p` known: classes, or packages with all their types."""
        for definition in definitions:
            for known in vars(definition).values() if isinstance(definition, types.ModuleType) else (definition,):
                if isinstance(known, type) and hasattr(known, "_get_packed_fingerprint"):
                    self._types[known._get_packed_fingerprint()] = known  # pylint: disable=protected-access

    def find(self, data: bytes) -> type | None:
        """Returns the type of which the message has the fingerprint, or None. The rest of the message is not read."""
        return self._types.get(data[:8])

    def decode(self, data: bytes) -> Any:
        """Returns the message as an object of its type, for example axlecast.position_t; None if no known type has its fingerprint, or
        if it is damaged."""
        known = self.find(data)
        if known is None:
            return None
        try:
            return known.decode(data)
        except (struct.error, ValueError, IndexError, OverflowError, MemoryError):
            return None
