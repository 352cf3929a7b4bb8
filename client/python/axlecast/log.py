"""Reads LCM event logs: of `axlecast record`, compressed or not, of lcm-logger, and damaged ones.

    from axlecast.log import Log

    with Log("press3-positions_20261121T070005Z.lcm") as log:
        for event in log.events("POSITION/axis1"):
            print(event.utime, log.decode(event))
        print(log.skipped)

The content of a log raises nothing: bytes that are no event are skipped and counted. A log may be larger than the memory.
"""

from __future__ import annotations

import json
import os
import re
import types
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, Self

import axlecast
from axlecast import log_check
from axlecast.log_check import Verification
from axlecast.log_file import LogFile
from axlecast.log_reader import SEEK_SLACK_US, Damage, LogReader, Record, Skipped, seek
from axlecast.message_types import MessageTypes

__all__ = ["Damage", "Log", "LogEvent", "Skipped", "Verification"]

_MACHINE, _SCHEMA, _RECORDER = b"AXLECAST/machine.yaml", b"AXLECAST/schema", b"AXLECAST/recorder"
_HEAD_EVENTS = 100  # among which the head of a log is: as in the C++ readers
_KNOWN_CHANNELS = 10_000  # a damaged log may contain any number
_LATE_EVENTS = 100  # in sequence end a range of time: the time of fewer may be damaged


class LogEvent(NamedTuple):
    """An event of a log."""

    number: int  #: in its log, from 0
    utime: int  #: us, UNIX time of its reception
    channel: str
    data: bytes


class Log:
    """A log. A context manager: afterwards the file is closed. Reads the file up to the size that it has now. Not thread-safe."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """If `path` does not exist and `path`.zst does, that file is read. A compressed log is decompressed to a temporary file in $TMPDIR.

        Raises OSError if the file cannot be read, or if there is no space for the temporary file, and ModuleNotFoundError if the log is
        compressed and the package python3-zstandard is missing.
        """
        self._file = LogFile(path)
        self._types = MessageTypes()
        self._skipped = Skipped()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[LogEvent]:
        return self.events()

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    # -- events

    def events(self, channel: str | None = None, regex: str | re.Pattern[str] | None = None, *, from_utime: int | None = None,
               until_utime: int | None = None) -> Iterator[LogEvent]:
        """Returns the events one by one, in the order of the log, also those of the recorder (channels AXLECAST/…).

        `channel`: only of this channel. `regex`: only of channels in which it is found. `from_utime` (included) and `until_utime` (not
        included): us, UNIX time of the reception; the place is found without reading the log from its begin, so that events may be missed
        where times run back by more than 0.2 s.

        Raises re.error if `regex` is not valid, and OSError while the events are read if the disk fails.
        """
        matches = _matcher(channel, regex)
        begin = 0 if from_utime is None else seek(self._file, from_utime - SEEK_SLACK_US)
        reader = LogReader(self._file, begin)
        self._skipped = reader.skipped
        return _selected(reader, matches, from_utime, until_utime)

    @property
    def skipped(self) -> Skipped:
        """What the newest `events` (or `for`) has skipped so far because it was no event: damage, and an incomplete end."""
        return self._skipped

    @property
    def truncated(self) -> bool:
        """Whether the file became smaller while it was read: the missing bytes count as skipped."""
        return self._file.truncated

    @property
    def compressed_damage(self) -> list[Damage]:
        """Places of a compressed file that could not be decompressed: a part of the log is missing."""
        return [Damage(*place) for place in self._file.damage]

    # -- types

    def register(self, *definitions: type | types.ModuleType) -> None:
        """Makes types of `lcm-gen -p` known to `decode`: classes, or packages with all their types. Those of axlecast are known."""
        self._types.register(*definitions)

    def decode(self, event: LogEvent) -> Any:
        """Returns the message as an object of its type, for example axlecast.position_t; None if no known type has its fingerprint, or
        if it is damaged."""
        return self._types.decode(event.data)

    # -- what the recorder states

    def machine(self) -> str | None:
        """Returns the text of the machine's file in the head of the log; None if the log has no such event: lcm-logger writes none."""
        return _text(self._head(_MACHINE))

    def schema(self) -> str | None:
        """Returns the text of all message types (lcmtypes/*.lcm) at the time of the recording, in the head of the log; None: none."""
        return _text(self._head(_SCHEMA))

    def recorder(self) -> dict[str, Any]:
        """Returns what the recorder states about itself in the head of the log: version, name, host, urls, channel, invert, start_utime
        (us, UNIX time), file_number. Empty if the log has no such event, or a damaged one."""
        try:
            recorder = json.loads(self._head(_RECORDER) or b"{}")
        except (ValueError, RecursionError):
            return {}
        return recorder if isinstance(recorder, dict) else {}

    def _head(self, channel: bytes) -> bytes | None:
        reader = LogReader(self._file)
        for _ in range(_HEAD_EVENTS):
            record = reader.next()
            if record is None:
                return None
            if record.channel == channel:
                return reader.data(record)
        return None

    def losses(self) -> dict[str, axlecast.recorder_health_t]:
        """Returns the newest statement of each recorder in the log, by channel (RECORDER/<name>): `lost` messages over all senders,
        `senders` with the losses of each, `kernel_dropped` datagrams. Reads the whole log.

        A recorder states its losses once a second. Those of the last second are not in the log.
        """
        statements = {}
        own = MessageTypes()
        reader = LogReader(self._file)
        while (record := reader.next()) is not None:
            data = reader.data(record)
            if own.find(data) is axlecast.recorder_health_t and (statement := own.decode(data)) is not None:
                statements[_name(record.channel)] = statement
        return statements

    def verify(self) -> Verification:
        """Reads the whole log and returns what its seals prove, what is damaged, and what is missing, as `axlecast log verify`. Takes
        about a minute for 1 GB."""
        found = log_check.verify(LogReader(self._file))
        found.not_decompressed = sum(size for _, size in self._file.damage)
        found.truncated = self._file.truncated
        return found


def _name(channel: bytes) -> str:
    return channel.decode("utf-8", "replace")


def _text(data: bytes | None) -> str | None:
    return None if data is None else data.decode("utf-8", "replace")


def _matcher(channel: str | None, regex: str | re.Pattern[str] | None) -> Callable[[str], bool]:
    expression = None if regex is None else re.compile(regex)
    return lambda name: (channel is None or name == channel) and (expression is None or expression.search(name) is not None)


def _selected(reader: LogReader, matches: Callable[[str], bool], from_utime: int | None, until_utime: int | None) -> Iterator[LogEvent]:
    names: dict[bytes, str | None] = {}  # of channels: None if they do not match
    late = 0
    while (record := reader.next()) is not None:
        if until_utime is not None and record.utime >= until_utime:
            late = late + 1 if record.utime > until_utime + SEEK_SLACK_US else 0
            if late == _LATE_EVENTS:
                return
            continue
        late = 0
        if from_utime is not None and record.utime < from_utime:
            continue
        if record.channel not in names:
            if len(names) >= _KNOWN_CHANNELS:
                names.clear()
            name = _name(record.channel)
            names[record.channel] = name if matches(name) else None
        if (name := names[record.channel]) is not None:
            yield LogEvent(record.number, record.utime, name, reader.data(record))
