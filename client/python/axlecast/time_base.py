"""Instants of several hosts: where an instant on the clock of one host lies on the time base of the machine, and on the clock of another
host, always as an interval that contains it. The same answers as client/axlecast/time_base.h.

    time_base = TimeBase()
    time_base.on_time(message, time.monotonic_ns())          # each TIME message
    instant = time_base.on_clock(own_clock_id(), position.clock_id, position.mono_ns, time.monotonic_ns())
    if instant.known:
        use(instant.ns, instant.half_width_ns)               # CLOCK_MONOTONIC of this host
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import os
import pathlib
from collections import deque
from typing import Self

from axlecast import time_quality_t

_LATEST = (2**63 - 1) // 16  # ns: later instants are ignored
_WIDEST = 86_400_000_000_000  # ns: wider claims are ignored
_MOST_GROWTH = 1_000_000_000  # ppb
_WORD = 2**64 - 1


def id_of_name(text: str) -> int:
    """Returns FNV-1a, 64 bits, of the text, never 0: the `machine_id` of a machine is that of its name."""
    value = 0xCBF29CE484222325
    for byte in text.encode():
        value = ((value ^ byte) * 0x100000001B3) & _WORD
    value = value or 1
    return value - 2**64 if value >= 2**63 else value


@functools.cache
def own_clock_id() -> int:
    """Returns the clock_id of this process: `mono_ns` of messages with this clock_id is comparable with time.monotonic_ns(). 0: not
    known. A service that does not see /proc/sys (ProcSubset=pid of systemd) needs Environment=AXLECAST_BOOT_ID=%b."""
    try:
        boot = pathlib.Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        boot = os.environ.get("AXLECAST_BOOT_ID", "")
    boot = boot.replace("-", "")
    if not boot:
        return 0
    try:
        space = os.readlink("/proc/self/ns/time")
    except OSError:
        space = ""
    return id_of_name(boot + space)


class TimeAnswer(enum.Enum):
    """Whether an instant is known, else why not."""

    KNOWN = "the instant is known"
    NO_TIME = "no TIME message of that host has arrived: does `axlecast time` run there?"
    NO_CLAIM = "that host has no bound on the time base at the moment: see `axlecast status`"
    EXPIRED = "the instant is too far from the TIME messages of that host"
    EPOCH_CHANGED = "the clock or its time base broke at about that instant"
    DIFFERENT_BASE = "the two hosts have different time bases"


@dataclasses.dataclass(frozen=True, slots=True)
class Instant:
    """An instant that lies within ns ± half_width_ns. The numbers are valid only if it is known."""

    answer: TimeAnswer
    ns: int = 0
    half_width_ns: int = 0
    base_id: int = 0
    era: object = None
    """Of one host: instants of different eras are not comparable."""

    @property
    def known(self) -> bool:
        """Whether the numbers are valid."""
        return self.answer is TimeAnswer.KNOWN

    def is_before(self, other: Self) -> bool:
        """Returns True if this instant is known to be before the other one."""
        return (self.known and other.known and self.base_id == other.base_id
                and self.ns + self.half_width_ns < other.ns - other.half_width_ns)


@dataclasses.dataclass(frozen=True, slots=True)
class _Claim:
    """What a host states about its clock in one TIME message."""

    mono_ns: int
    base_ns: int
    half_width_ns: int  # -1: no bound
    growth_ppb: int
    valid_ns: int
    era: tuple[int, int, int]  # boot_id, base_id, epoch

    def at(self, mono_ns: int) -> Instant:
        """Returns the instant on the time base at `mono_ns` of the host."""
        base_id = self.era[1]
        if self.half_width_ns < 0 or base_id == 0:
            return Instant(TimeAnswer.NO_CLAIM)
        distance = mono_ns - self.mono_ns
        if abs(distance) > self.valid_ns:
            return Instant(TimeAnswer.EXPIRED)
        half_width = self.half_width_ns + _growth(distance, self.growth_ppb)
        return Instant(TimeAnswer.KNOWN, self.base_ns + distance, half_width, base_id, self.era)


@dataclasses.dataclass(slots=True)
class _Clock:
    received_ns: int
    claims: deque[_Claim]  # the newest one last


class TimeBase:
    """The clocks of the hosts of a machine, by their TIME messages. Not thread-safe."""

    CLOCKS = 32
    """Hosts. The one that was silent longest is forgotten."""
    HISTORY = 32
    """Messages of a host."""

    def __init__(self, machine_id: int = 0) -> None:
        """`machine_id`: messages that state another machine are ignored. 0: all machines are taken."""
        self._machine_id = machine_id
        self._clocks: dict[int, _Clock] = {}  # by clock_id, the one that sent last is the last

    def on_time(self, message: time_quality_t, now_ns: int) -> None:
        """Takes a TIME message. `now_ns`: its arrival, on CLOCK_MONOTONIC of this host."""
        if self._machine_id and message.machine_id and message.machine_id != self._machine_id or not _is_sane(message):
            return
        clock = self._clocks.get(message.clock_id)
        if clock is None:
            if len(self._clocks) >= self.CLOCKS:
                del self._clocks[next(iter(self._clocks))]
            clock = _Clock(now_ns, deque(maxlen=self.HISTORY))
        elif message.mono_ns <= clock.claims[-1].mono_ns:
            return
        else:
            del self._clocks[message.clock_id]
        self._clocks[message.clock_id] = clock
        clock.received_ns = now_ns
        clock.claims.append(_Claim(
            mono_ns=message.mono_ns,
            base_ns=message.base_ns,
            half_width_ns=message.half_width_ns if message.grade == time_quality_t.GRADE_PROVEN else -1,
            growth_ppb=message.growth_ppb,
            valid_ns=message.valid_ms * 1_000_000,
            era=(message.boot_id, message.base_id, message.epoch)))

    def on_base(self, clock_id: int, mono_ns: int, now_ns: int) -> Instant:
        """Returns the instant of the time base at `mono_ns`, an instant on the clock `clock_id`. After the newest TIME message of that
        host, this is known only while such messages arrive."""
        clock = self._clocks.get(clock_id)
        if clock is None:
            return Instant(TimeAnswer.NO_TIME)
        if not 0 <= mono_ns < _LATEST:
            return Instant(TimeAnswer.EXPIRED)
        newest = clock.claims[-1]
        if mono_ns >= newest.mono_ns:
            return Instant(TimeAnswer.EXPIRED) if now_ns - clock.received_ns > newest.valid_ns else newest.at(mono_ns)
        after = newest
        for before in reversed(clock.claims):
            if before.mono_ns <= mono_ns:
                if before.era != after.era:
                    return Instant(TimeAnswer.EPOCH_CHANGED)
                return _both(before.at(mono_ns), after.at(mono_ns))
            after = before
        return Instant(TimeAnswer.EXPIRED)  # older than all: whether the epoch changed since then is not known

    def on_clock(self, clock_id: int, of: int, mono_ns: int, now_ns: int) -> Instant:
        """Returns the instant on the clock `clock_id` that corresponds to `mono_ns` on the clock `of`. Equal clocks need no TIME
        message."""
        if clock_id == of and of != 0:
            return Instant(TimeAnswer.KNOWN, mono_ns)
        base = self.on_base(of, mono_ns, now_ns)
        if not base.known:
            return base
        clock = self._clocks.get(clock_id)
        if clock is None:
            return Instant(TimeAnswer.NO_TIME)
        # A first guess by the newest claim. Then the claims next to that instant decide.
        newest = clock.claims[-1]
        guess = newest.mono_ns + base.ns - newest.base_ns
        there = self.on_base(clock_id, guess, now_ns)
        if not there.known:
            return there
        if there.base_id != base.base_id:
            return Instant(TimeAnswer.DIFFERENT_BASE)
        correction = base.ns - there.ns
        width = base.half_width_ns + there.half_width_ns
        return Instant(TimeAnswer.KNOWN, guess + correction, width + _growth(abs(correction) + width, newest.growth_ppb), base.base_id,
                       (base.era, there.era))


def _growth(distance: int, ppb: int) -> int:
    """By how much the half width has grown at that distance, ns, rounded up."""
    return (abs(distance) // 1_000_000 + 1) * ppb // 1_000 + 1


def _is_sane(message: time_quality_t) -> bool:
    return (message.clock_id != 0 and 0 <= message.mono_ns < _LATEST and 0 <= message.base_ns < _LATEST
            and -1 <= message.half_width_ns < _WIDEST and 0 <= message.growth_ppb <= _MOST_GROWTH and message.valid_ms >= 0)


def _both(a: Instant, b: Instant) -> Instant:
    """Both intervals contain the instant, so that it lies in their intersection."""
    if not a.known:
        return b if b.known else a
    if not b.known:
        return a
    first = max(a.ns - a.half_width_ns, b.ns - b.half_width_ns)
    last = min(a.ns + a.half_width_ns, b.ns + b.half_width_ns)
    if first > last:
        return Instant(TimeAnswer.EPOCH_CHANGED)
    middle = first + (last - first) // 2
    return dataclasses.replace(a, ns=middle, half_width_ns=last - middle)
