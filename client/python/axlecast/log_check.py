"""What can be proven about a log: its seals, the numbers and times of its events, and the sequence numbers of axlecast's messages. The same
answers as `axlecast log verify`: docs/log.md."""

from __future__ import annotations

import dataclasses
import struct

from axlecast.crc32c import crc32c
from axlecast.log_reader import LogReader, Record, Skipped
from axlecast.message_types import MessageTypes

SEAL = b"AXLECAST/seal"

_SEAL = struct.Struct(">QQI")  # bytes, events and CRC-32C of the records since the seal before
_NUMBERS = struct.Struct(">qq")  # boot_id and seq in the head of a message
_HEAD = ["utime", "mono_ns", "boot_id", "seq", "machine_id", "clock_id"]  # the fields that published types begin with
_HEAD_SIZE = 56  # bytes, with the fingerprint
_GREATEST = 2**63 - 1
_LARGEST_GAP = 1_000_000_000_000  # a greater one is a damaged number


@dataclasses.dataclass(frozen=True, slots=True)
class BadSeal:
    """A seal that does not match the events before it: some are missing, added or changed."""

    offset: int
    """Of the seal, bytes."""
    events_sealed: int
    """As the seal states; 0: it is no seal."""
    events_found: int


@dataclasses.dataclass(slots=True)
class Verification:
    """The findings about a log."""

    events: int = 0
    proven_events: int = 0
    """Under a seal that matches: they are as they were recorded."""
    broken_events: int = 0
    """Under a seal that does not match."""
    unsealed_events: int = 0
    """Behind the last seal, or of a log without seals."""
    seals: int = 0
    bad_seals: int = 0
    first_bad_seals: list[BadSeal] = dataclasses.field(default_factory=list)
    """The first 10."""
    missing_events: int = 0
    """By gaps in their numbers."""
    wrong_numbers: int = 0
    """Numbers that fit neither neighbour."""
    new_beginnings: int = 0
    """Of the numbers: `lcm-logger -a` appends in this way."""
    backward: int = 0
    """Events that are earlier than the one before."""
    max_backward_us: int = 0
    """The most, us."""
    lost: dict[str, int] = dataclasses.field(default_factory=dict)
    """Messages of axlecast's types, by channel, that were lost before they were recorded."""
    skipped: Skipped = dataclasses.field(default_factory=Skipped)
    """Bytes of the log that are no event."""
    not_decompressed: int = 0
    """Bytes of a compressed file that are damaged: a part of the log is missing."""
    truncated: bool = False
    """The file became smaller while it was read."""

    @property
    def whole(self) -> bool:
        """Whether nothing is missing or contradictory. Events without a seal may still be changed."""
        return not (self.bad_seals or self.missing_events or self.wrong_numbers or self.lost or self.skipped.count
                    or self.not_decompressed or self.truncated)


class _SequenceCount:
    """Messages of one channel that are missing, by their sequence numbers. A late one is not missing any more."""

    GAPS = 32  # the newest gaps of each publisher are remembered
    PUBLISHERS = 64
    LARGEST_SEQ = 2**53

    def __init__(self) -> None:
        self.lost = 0
        self._newest: dict[int, int] = {}  # by boot_id
        self._gaps: dict[int, dict[int, int]] = {}  # by boot_id: the last missing number by the first

    def add(self, boot_id: int, seq: int) -> None:
        """Counts a message."""
        if not 0 <= seq <= self.LARGEST_SEQ:
            return
        newest = self._newest.get(boot_id)
        if newest is None:
            self._begin(boot_id, seq)
        elif seq <= newest:
            self._fill(self._gaps.get(boot_id, {}), seq)
        else:
            if seq > newest + 1:
                self.lost += seq - newest - 1
                gaps = self._gaps.setdefault(boot_id, {})
                gaps[newest + 1] = seq - 1
                if len(gaps) > self.GAPS:
                    del gaps[min(gaps)]
            self._newest[boot_id] = seq

    def _begin(self, boot_id: int, seq: int) -> None:
        self._newest[boot_id] = seq
        if len(self._newest) > self.PUBLISHERS:
            forgotten = min(known for known in self._newest if known != boot_id)
            del self._newest[forgotten]
            self._gaps.pop(forgotten, None)

    def _fill(self, gaps: dict[int, int], seq: int) -> None:
        begin = max((first for first in gaps if first <= seq), default=None)
        if begin is None or seq > gaps[begin]:
            return  # it was received
        self.lost -= 1
        end = gaps.pop(begin)
        if begin < seq:
            gaps[begin] = seq - 1
        if seq < end:
            gaps[seq + 1] = end


class _Stretch:
    """The records since the last seal."""

    PIECE = 1 << 18  # bytes of which the CRC is calculated at once: that of a short record takes about as long

    def __init__(self) -> None:
        self.events = 0
        self._bytes = 0
        self._crc = 0
        self._waiting = bytearray()

    def add(self, record: bytes) -> None:
        """Adds a record that is no seal."""
        self.events += 1
        self._bytes += len(record)
        self._waiting += record
        if len(self._waiting) >= self.PIECE:
            self._calculate()

    def seal(self) -> tuple[int, int, int]:
        """Returns what a seal at this place states: bytes, events and CRC-32C."""
        self._calculate()
        return self._bytes, self.events, self._crc

    def _calculate(self) -> None:
        self._crc = crc32c(bytes(self._waiting), self._crc)
        self._waiting.clear()


def verify(reader: LogReader) -> Verification:
    """Reads the log to its end."""
    check = _Check()
    while (record := reader.next()) is not None:
        check.add(record, reader)
    return check.finish(reader.skipped)


class _Check:
    def __init__(self) -> None:
        self._found = Verification()
        self._number: int | None = None  # the last accepted one
        self._doubtful: int | None = None  # the one after it, if it does not follow: the next one decides
        self._utime: int | None = None
        self._open = _Stretch()
        self._sequences: dict[bytes, _SequenceCount] = {}
        self._types = MessageTypes()
        self._headed: dict[type, bool] = {}

    def add(self, record: Record, reader: LogReader) -> None:
        self._found.events += 1
        self._check_number(record.number)
        if self._utime is not None and 0 < (back := self._utime - record.utime) <= _GREATEST:
            self._found.backward += 1
            self._found.max_backward_us = max(self._found.max_backward_us, back)
        self._utime = record.utime
        data = reader.data(record)
        if record.channel == SEAL:
            self._check_seal(record, data)
            return
        self._open.add(reader.bytes(record))
        if self._has_head(data):
            sequence = self._sequences.setdefault(record.channel, _SequenceCount())
            sequence.add(*_NUMBERS.unpack_from(data, 24))

    def finish(self, skipped: Skipped) -> Verification:
        """Returns the findings behind the last event."""
        if self._doubtful is not None:
            self._resolve(None)
        found = self._found
        found.unsealed_events = self._open.events
        found.lost = {channel.decode("utf-8", "replace"): sequence.lost for channel, sequence in sorted(self._sequences.items())
                      if sequence.lost}
        found.skipped = skipped
        return found

    def _has_head(self, data: bytes) -> bool:
        """Returns whether the message begins with the numbers of its publisher."""
        known = self._types.find(data)
        if known is None or len(data) < _HEAD_SIZE:
            return False
        if known not in self._headed:
            self._headed[known] = list(known.__slots__[:len(_HEAD)]) == _HEAD
        return self._headed[known]

    def _check_number(self, number: int) -> None:
        if self._doubtful is not None:
            self._resolve(number)
        if self._number is None or number == self._number + 1:
            self._number = number
        else:
            self._doubtful = number

    def _resolve(self, following: int | None) -> None:
        """Decides about the number that did not follow, by the next one; None at the end of the log."""
        doubtful, self._doubtful = self._doubtful, None
        gap = doubtful - self._number - 1
        confirmed = following is not None and following == doubtful + 1
        if doubtful > self._number and gap <= _LARGEST_GAP and (following is None or following > doubtful):
            self._found.missing_events += gap
            self._number = doubtful
        elif confirmed:
            self._found.new_beginnings += 1
            self._number = doubtful
        else:
            self._found.wrong_numbers += 1
            self._number = min(self._number + 1, _GREATEST)

    def _check_seal(self, record: Record, data: bytes) -> None:
        found = self._found
        found.seals += 1
        sealed = _SEAL.unpack(data) if len(data) == _SEAL.size else None
        events = self._open.events
        if sealed == self._open.seal():
            found.proven_events += events
        else:
            found.bad_seals += 1
            found.broken_events += events
            if len(found.first_bad_seals) < 10:
                found.first_bad_seals.append(BadSeal(record.offset, sealed[1] if sealed else 0, events))
        self._open = _Stretch()
