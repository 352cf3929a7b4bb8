"""The records of an LCM event log, also of a damaged one: after bytes that are no record, reading continues at the next plausible one.

Format: LCM 1.3.1, "LCM Log File Format", big-endian: u32 0xEDA1DA01, i64 number, i64 utime, u32 channel length, u32 data length, channel,
data. The same answers as tools/log/log_reader.h, which describes what damage can be detected.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from axlecast.log_file import LogFile, Windows

SYNC = 0xEDA1DA01
HEADER = 28  # bytes before the channel
LONGEST_CHANNEL = 255  # bytes
LARGEST_DATA = 64 << 20  # bytes: a greater length counts as damage

_HEAD = struct.Struct(">IqqII")
_SYNC = SYNC.to_bytes(4, "big")
_SMALLEST = HEADER + 1
_WORD = 2**64 - 1
_PIECE = 1 << 20
_CONVINCING = 16  # records: such a sequence is accepted even if its numbers confirm nothing
_BACK_US, _AHEAD_US = 1_000_000, 60_000_000  # of the time of an event from the one before
_FIRST_LINKS, _LINKS_PER_EVENT = LARGEST_DATA // _SMALLEST, 4  # limit the work on a hostile log
SEEK_SLACK_US = 200_000  #: times of a log may run back by this much where a time is searched for


class Damage(NamedTuple):
    """A place of the log that is no event."""

    offset: int  #: bytes from the begin of the log
    size: int  #: bytes


class Record(NamedTuple):
    """A record in the log."""

    offset: int  #: bytes from the begin of the log
    end: int  #: offset behind it
    number: int
    utime: int  #: us, UNIX time
    channel: bytes


class Skipped:
    """What a reader has skipped because it was no event."""

    MOST_PLACES = 10_000

    def __init__(self) -> None:
        self.count = 0  #: places
        self.bytes = 0
        self.places: list[Damage] = []  #: the first MOST_PLACES of them, in order
        self.torn = 0  #: bytes at the end of the log that are no complete event, also counted in `bytes`

    def __repr__(self) -> str:
        return f"Skipped(count={self.count}, bytes={self.bytes}, torn={self.torn})"

    def add(self, place: Damage, torn: bool) -> None:
        """Counts a place. `torn`: it is the end of the log."""
        self.count += 1
        self.bytes += place.size
        if torn:
            self.torn = place.size
        if len(self.places) < self.MOST_PLACES:
            self.places.append(place)


def _fits(before: int, end: int, number: int, offset: int) -> bool:
    """Returns whether an event with `number` is possible at `offset` after the event `before`, which ended at `end`: there must be room
    for the events between them."""
    return before < number and end <= offset and number - before - 1 <= (offset - end) // _SMALLEST


def _follows(before: int, number: int, steps: int = 1) -> bool:
    return (number - before) & _WORD == steps


def _is_near(before: int, utime: int) -> bool:
    return (utime - before + _BACK_US) & _WORD <= _BACK_US + _AHEAD_US


def _is_not_before(before: int, utime: int) -> bool:
    return utime >= before or _is_near(before, utime)


class LogReader:
    """Reads the records from `begin` to `end`, bytes. If no record begins at `begin`, the bytes up to the next one are no damage."""

    def __init__(self, file: LogFile, begin: int = 0, end: int | None = None) -> None:
        self._windows = Windows(file)
        self._size = file.size if end is None else end
        self.position = min(begin, self._size)  #: behind the last record; at the end: the size of the log
        self.skipped = Skipped()
        # The last event of which the neighbours confirm the number: the number, and the offset behind its record.
        self._anchor: tuple[int, int] | None = (-1, 0) if begin == 0 else None
        self._utime: int | None = None  # of the event before
        self._links = _FIRST_LINKS  # steps that _follow may still take
        self._ahead: Record | None = None  # the record at self.position, if it is known
        self._looked = False

    def next(self) -> Record | None:
        """Returns the next record of the log; None at its end."""
        record = self._ahead if self._looked else self._at(self.position)
        if record is not None and self._anchor == (record.number - 1, record.offset):
            ahead = self._at(record.end)
            if ahead is not None and ahead.number == record.number + 1:  # nothing to doubt
                self._anchor = (record.number, record.end)
                self._accept(record, ahead)
                return record
        return self._search(record)

    def data(self, record: Record) -> bytes:
        """Returns the data of the event."""
        begin = record.offset + HEADER + len(record.channel)
        piece, first = self._windows.at(begin, record.end - begin)
        return piece[begin - first:record.end - first]

    def bytes(self, record: Record) -> bytes:
        """Returns the whole record."""
        piece, first = self._windows.at(record.offset, record.end - record.offset)
        return piece[record.offset - first:record.end - first]

    def _accept(self, record: Record, ahead: Record | None) -> None:
        self.position = record.end
        self._utime = record.utime
        self._links += _LINKS_PER_EVENT
        self._ahead, self._looked = ahead, True

    def _search(self, record: Record | None) -> Record | None:
        """Returns the next record that belongs to the log. `record`: at the present position."""
        offset = self.position
        if record is None or self._belongs_to_data(record):
            record = self._find_next(offset)
        while record is not None and (swallowed := self._find_swallowed(record)) is not None:
            record = swallowed
        found = self._size if record is None else record.offset
        if found > offset and (self._utime is not None or self._anchor is not None):
            self.skipped.add(Damage(offset, found - offset), torn=record is None)
        if record is None:
            self.position, self._looked = self._size, False
            return None
        ahead = self._at(record.end)
        confirmed = ahead is not None and _follows(record.number, ahead.number)
        if confirmed or (self._anchor is not None and _fits(*self._anchor, record.number, record.offset)):
            self._anchor = (record.number, record.end)
        self._accept(record, ahead)
        return record

    def _at(self, offset: int) -> Record | None:
        """Returns the record at `offset`; None if no complete, plausible record begins there."""
        rest = self._size - offset
        if rest < _SMALLEST:
            return None
        piece, first = self._windows.at(offset, min(HEADER + LONGEST_CHANNEL, rest))
        sync, number, utime, channel_size, data_size = _HEAD.unpack_from(piece, offset - first)
        if sync != SYNC or not 0 < channel_size <= LONGEST_CHANNEL or data_size > LARGEST_DATA:
            return None
        size = HEADER + channel_size + data_size
        if size > rest:
            return None
        begin = offset - first + HEADER
        channel = piece[begin:begin + channel_size]
        return None if b"\0" in channel else Record(offset, offset + size, number, utime, channel)

    def _find_sync(self, begin: int, end: int) -> int:
        """Returns the offset of the first sync word that begins in [begin, end), else `end`."""
        while begin < end:
            size = min(end - begin + len(_SYNC) - 1, self._size - begin)
            piece, first = self._windows.at(begin, min(size, len(_SYNC)))
            size = min(size, first + len(piece) - begin)
            found = piece.find(_SYNC, begin - first, begin - first + size)
            if found >= 0:
                return first + found
            if size < len(_SYNC):
                break
            begin += size - len(_SYNC) + 1
        return end

    def _is_plausible(self, record: Record) -> bool:
        """Returns whether number and time are plausible after the records that were read."""
        if self._anchor is None:
            return False
        if _fits(*self._anchor, record.number, record.offset):
            return True
        return record.number > self._anchor[0] and self._utime is not None and _is_near(self._utime, record.utime)

    def _leads_behind(self, number: int, offset: int) -> bool:
        """Returns whether one of the next records from `offset` on has the number after `number`."""
        for _ in range(_CONVINCING):
            link = self._at(offset)
            if link is None:
                return False
            if _follows(number, link.number):
                return True
            offset = link.end
        return False

    def _belongs_to_data(self, record: Record) -> bool:
        """Returns whether the record after the last event is a part of that event's data, of which the length is damaged: the record with
        the next number follows later."""
        if self._anchor is None or self._anchor[1] != self.position or self._is_plausible(record):
            return False
        if self._utime is None or record.utime >= self._utime:
            return False
        return self._leads_behind(self._anchor[0], self.position)

    def _belongs_to_log(self, record: Record) -> bool:
        """Returns whether a record behind damage belongs to the log, and is not inside the data of another record."""
        if self._anchor is not None and self._utime is None:
            return True  # the first event of the log
        link = record
        for steps in range(_CONVINCING):
            if self._is_plausible(link):
                return _follows(record.number, link.number, steps)
            if link.end == self._size:
                return self._utime is None or (steps > 0 and _is_not_before(self._utime, record.utime))
            following = self._at(link.end)
            if following is None:
                return False
            link = following
        return True

    def _find_next(self, begin: int) -> Record | None:
        """Returns the next record from `begin` on that belongs to the log."""
        offset = self._find_sync(begin, self._size)
        while offset < self._size:
            record = self._at(offset)
            if record is not None and self._belongs_to_log(record):
                return record
            offset = self._find_sync(offset + 1, self._size)
        return None

    def _follow(self, record: Record, limit: int) -> tuple[int, int, bool]:
        """Follows the records without a gap up to the first one that begins at `limit` or later. Returns its offset, the number of steps,
        and whether the records end with the log."""
        last, steps, to_end = record.offset, 0, False
        link: Record | None = record
        while link is not None and last < limit:
            to_end = link.end == self._size
            behind = link.end
            link = self._at(behind)
            if link is None or self._links == 0:
                break
            self._links -= 1
            last = behind
            steps += 1
        return last, steps, to_end

    def _find_swallowed(self, record: Record) -> Record | None:
        """Returns a record of the log inside the given one, of which the length is then damaged."""
        if self._leads_behind(record.number, record.end):
            return None
        candidate = self._find_sync(record.offset + _SMALLEST, record.end)
        while candidate < record.end:
            inner = self._at(candidate)
            behind = candidate
            if inner is not None:
                last, steps, to_end = self._follow(inner, record.end)
                while inner is not None and candidate < record.end:
                    if self._disproves(record, inner, (last, steps, to_end)):
                        return inner
                    behind = candidate
                    candidate = inner.end
                    steps -= 1
                    inner = self._at(candidate) if candidate <= last else None
            candidate = self._find_sync(behind + 1, record.end)
        return None

    def _disproves(self, record: Record, inner: Record, chain: tuple[int, int, bool]) -> bool:
        """Returns whether the record inside another one, a part of `chain`, belongs to the log.

        Data may contain records, even a complete log. But those were written before the event, their chain does not continue behind the
        event, and if it ends with the event, their numbers are not between those of the event and the next one.
        """
        last, steps, to_end = chain
        later = inner.utime >= record.utime
        in_time = _is_not_before(record.utime, inner.utime) or (self._utime is not None and _is_not_before(self._utime, inner.utime))
        follows = in_time and (_fits(record.number, record.offset + _SMALLEST, inner.number, inner.offset)
                               or (self._anchor is not None and _fits(*self._anchor, inner.number, inner.offset)))
        if later and follows:
            return True
        if record.end == self._size:
            return to_end and (follows or later)
        following = self._at(record.end)
        behind = last >= record.end or to_end
        if following is None:
            return follows or (later and behind)
        if record.number < inner.number < following.number:
            return behind and (later or follows)
        return behind and (follows or (in_time and last == record.end and _follows(inner.number, following.number, steps)))


def seek(file: LogFile, utime: int) -> int:
    """Returns an offset before which no event is at `utime` (us, UNIX time) or later, by bisection. Times may run back by at most
    SEEK_SLACK_US."""
    low, high = 0, file.size
    while high - low > _PIECE:
        middle = low + (high - low) // 2
        reader = LogReader(file, middle, high)
        records = [record for _ in range(3) if (record := reader.next()) is not None]
        # The time of a single record may be damaged.
        if len(records) == 3 and sorted(record.utime for record in records)[1] < utime - SEEK_SLACK_US:
            low = records[0].offset
        else:
            high = middle
    return low
