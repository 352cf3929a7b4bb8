"""For consumers of POSITION/<device>: age, staleness, loss, restart, change of datum, and the position at an instant between or shortly
after the readings. The same answers as client/axlecast/position_tracker.h; it reads no clock.

    axis = PositionTracker()
    axis.on_position(message, time.monotonic_ns())    # each POSITION/axis1
    axis.on_device(message)                           # each DEVICE/axis1
    now = time.monotonic_ns()                         # in the control loop
    if axis.check(now) is Freshness.FRESH and (position := axis.at(now)).known:
        use(position.value)

Positions are advisory to safety systems: LCM has no authentication.
"""

from __future__ import annotations

import dataclasses
import enum
import math
from collections import deque
from typing import NamedTuple

from axlecast import device_info_t, position_t
from axlecast.time_base import TimeBase, own_clock_id

_FUTURE_NS = 1_000_000  # of a reading that counts as lying in the future
_LEAST_EXTRAPOLATION_NS = 5_000_000
_LEAST_GAP_NS = 50_000_000


class Freshness(enum.Enum):
    """Whether the newest reading may be used, else why not."""

    FRESH = "the position is fresh"
    STALE = "the newest valid reading is too old"
    NOT_VALID = "the driver marks the newest reading as not valid"
    NO_READING = "no valid reading has arrived yet: does the driver run?"
    LIMIT_UNKNOWN = "no DEVICE message has arrived yet, which states the maximum age"
    WRONG_CLOCK = "the reading lies in the future: give time.monotonic_ns() of this host"
    OTHER_CLOCK = "the driver runs on another host: give a TimeBase, and the TIME messages to it"
    TIME_UNKNOWN = ("the driver runs on another host, and the instants of its readings are not known well enough: see "
                    "`axlecast status`")
    TWO_PUBLISHERS = "two drivers publish this device, or two machines have a device of this name"


class Answer(enum.Enum):
    """What a position rests on, else the reason why nothing is known."""

    READ = "a reading of just that instant"
    INTERPOLATED = "between two readings"
    EXTRAPOLATED = "after the newest reading, at its speed"
    NO_READING = "no reading has arrived yet: does the driver run?"
    BEFORE_HISTORY = "the instant is older than the readings that are kept"
    TOO_FAR_AHEAD = "the instant is too long after the newest reading"
    STALE = Freshness.STALE.value
    LIMIT_UNKNOWN = Freshness.LIMIT_UNKNOWN.value
    NOT_VALID = "a reading at this instant is not valid"
    DATUM_CHANGED = "the datum changed between the two readings"
    GAP = "the two readings are too far apart"
    SPEED_UNKNOWN = "the speed after the newest reading is not known yet"
    WRONG_CLOCK = Freshness.WRONG_CLOCK.value
    OTHER_CLOCK = Freshness.OTHER_CLOCK.value
    TIME_UNKNOWN = Freshness.TIME_UNKNOWN.value
    TWO_PUBLISHERS = Freshness.TWO_PUBLISHERS.value


class InstantOf(enum.Enum):
    """What counts as the instant of a reading."""

    SAMPLED = "mono_ns, converted by the TimeBase if the publisher runs on another host"
    RECEIVED = "the arrival of the message: an age is the least that it can be, and instants of axes are not comparable"
    GIVEN = "the second argument of on_position is the sampling instant: from a log"


@dataclasses.dataclass(frozen=True, slots=True)
class Options:
    """Limits of a tracker, ns."""

    max_age_ns: int = 0
    """Older readings are stale. 0: device_info_t.max_age_us, as soon as a DEVICE message came."""
    max_extrapolation_ns: int = -1
    """`at` answers up to this long after the newest reading. -1: two periods of the device (DEVICE: the longest of poll_us, publish_us
    and, if poll_us is 0, a third of max_age_us), at least 5 ms."""
    max_gap_ns: int = -1
    """`at` does not interpolate between readings further apart. -1: three periods of the device, at least 50 ms."""
    machine_id: int = 0
    """Messages that state another machine are ignored: id_of_name(name). 0: the machine of the first message."""
    clock_id: int = dataclasses.field(default_factory=own_clock_id)
    """Messages with this clock_id have instants on the clock of the caller."""
    time: TimeBase | None = None
    """Converts the instants of readings of other hosts to the clock of the caller. Pass the TIME messages to it. None: readings of
    other hosts are not used."""
    max_time_half_width_ns: int = 0
    """A reading of another host is used if its instant is known to ± this. There is no default: it depends on the axis."""
    instant: InstantOf = InstantOf.SAMPLED


@dataclasses.dataclass(frozen=True, slots=True)
class Position:
    """The position at an instant. The numbers are valid only if it is known; else they are NaN, and `answer` states why."""

    answer: Answer
    counts: float = math.nan
    """Absolute, after direction and datum."""
    value: float = math.nan
    """In the unit of DEVICE. NaN before the DEVICE message of this boot."""
    timing_error_counts: float = math.nan
    """By the time uncertainty of the readings."""
    flags: int = 0
    """position_t.FLAG_* that both readings have."""
    datum_epoch: int = 0

    @property
    def known(self) -> bool:
        """Whether the numbers are valid."""
        return self.answer in _KNOWN


_KNOWN = frozenset((Answer.READ, Answer.INTERPOLATED, Answer.EXTRAPOLATED))


class News(NamedTuple):
    """What one message changed."""

    used: bool = False
    """False: it came late, twice, out of its time's order, or from another machine or clock."""
    restarted: bool = False
    """Another boot_id: counts of before and after do not belong together."""
    datum_changed: bool = False
    """datum_epoch differs from the message before."""
    lost: int = 0
    """Messages between it and the one before."""


@dataclasses.dataclass(slots=True)
class Totals:
    """Counters since the start."""

    received: int = 0
    lost: int = 0
    """By gaps in seq."""
    late: int = 0
    """They came after a newer one, were counted as lost, and are not used."""
    restarts: int = 0
    datum_changes: int = 0
    missed_readings: int = 0
    """As the driver counts them: readings that failed or were withheld."""
    two_publishers: bool = False
    """An earlier boot_id came back, or another machine: two drivers publish this device name."""
    other_machine: int = 0
    """Messages ignored because they state another machine than Options.machine_id."""


class _Reading(NamedTuple):
    at: int
    half_width: int
    counts: int
    counts_per_ns: float  # where FLAG_SPEED_VALID
    flags: int
    epoch: int

    @property
    def valid(self) -> bool:
        return bool(self.flags & position_t.FLAG_VALID)


class PositionTracker:
    """The readings of one device. Not thread-safe."""

    HISTORY = 64
    """Messages that are kept."""
    ALONE_AFTER_NS = 3_000_000_000
    """Without messages of one of two publishers for this time, the other one is used again."""

    def __init__(self, options: Options | None = None) -> None:
        self._options = options or Options()
        self.totals = Totals()
        self.newest_message: position_t | None = None
        self._previous_boot = 0
        self._contested = False  # two publishers
        self._contested_at = 0  # arrival of the newest message that showed it
        self._wrong_clock = False  # the newest reading lay in the future when it arrived
        self._located = True  # the instant of the newest message is known
        self._era: object = None  # of the readings that are kept
        self._valid_at: int | None = None
        self._valid_half_width = 0
        self._readings: deque[_Reading] = deque(maxlen=self.HISTORY)  # the newest one last
        self._device_boot: int | None = None
        self._device_max_age_ns = 0
        self._device_period_ns = 0
        self._unit_per_count = 0.0
        self._modulo = 0.0

    # -- messages

    def on_position(self, message: position_t, received_ns: int) -> News:
        """Takes a POSITION message. `received_ns`: its arrival, on CLOCK_MONOTONIC of this host; with InstantOf.GIVEN its instant."""
        machine = self._options.machine_id
        if machine and message.machine_id and message.machine_id != machine:
            self.totals.other_machine += 1
            return News()
        self.totals.received += 1
        if self._contested and received_ns - self._contested_at > self.ALONE_AFTER_NS:
            self._contested = False
        restarted = datum_changed = False
        lost = 0
        newest = self.newest_message
        if newest is not None:
            if message.boot_id != newest.boot_id or message.machine_id != newest.machine_id:
                self._replace(newest, message, received_ns)
                restarted = not self._contested
            elif message.seq <= newest.seq:
                self.totals.late += 1
                return News()
            else:
                lost = lost_between(newest.seq, message.seq)
                datum_changed = message.datum_epoch != newest.datum_epoch
                self.totals.lost += lost
                self.totals.datum_changes += datum_changed
        self.newest_message = message
        self.totals.missed_readings += message.missed
        return News(self._keep(message, received_ns), restarted, datum_changed, lost)

    def on_device(self, message: device_info_t) -> None:
        """Takes a DEVICE message: unit, period and maximum age."""
        machine = self._options.machine_id
        if machine and message.machine_id and message.machine_id != machine:
            return
        has_unit = message.ratio_den != 0 and message.counts_per_turn > 0
        self._device_boot = message.boot_id if has_unit else None
        self._device_max_age_ns = message.max_age_us * 1_000
        # A device that sends by itself, or is read as fast as the bus allows, states no period. Its maximum age is at least three.
        readings = message.poll_us if message.poll_us > 0 else int(message.max_age_us / 3)
        self._device_period_ns = max(readings, message.publish_us) * 1_000
        self._modulo = message.modulo
        self._unit_per_count = (message.per_turn * message.ratio_num / message.ratio_den / message.counts_per_turn if has_unit else 0.0)

    def _replace(self, newest: position_t, message: position_t, received_ns: int) -> None:
        """Another publisher. A restarted driver has a new boot_id and the same machine. It never returns to the earlier boot_id."""
        if message.boot_id == self._previous_boot or message.machine_id != newest.machine_id:
            self.totals.two_publishers = True
            self._contested = True
            self._contested_at = received_ns
        self.totals.restarts += not self._contested
        self._previous_boot = newest.boot_id
        self._forget()

    def _forget(self) -> None:
        self._readings.clear()
        self._valid_at = None

    def _keep(self, message: position_t, received_ns: int) -> bool:
        """Adds the reading if its instant is known and later than that of the one before."""
        other_clock = self._on_other_clock(message)
        at, half_width = self._locate(message, received_ns, other_clock)
        self._located = at is not None or not other_clock
        self._wrong_clock = at is not None and at - half_width > received_ns + _FUTURE_NS
        if at is None or (self._readings and at <= self._readings[-1].at):
            return False
        speed = message.speed_rad_s / (2 * math.pi) * message.counts_per_turn * 1e-9
        reading = _Reading(at, half_width, message.counts, speed, message.flags, message.datum_epoch)
        self._readings.append(reading)
        if reading.valid:
            self._valid_at = at
            self._valid_half_width = half_width if other_clock else 0
        return True

    def _on_other_clock(self, message: position_t) -> bool:
        return (self._options.instant is InstantOf.SAMPLED
                and (message.clock_id == 0 or message.clock_id != self._options.clock_id))

    def _locate(self, message: position_t, received_ns: int, other_clock: bool) -> tuple[int | None, int]:
        """Returns the instant of the reading on the clock of the caller, None if it is not known, and by how much it is uncertain."""
        half_width = message.time_uncertainty_ns
        if not other_clock:
            at = message.mono_ns if self._options.instant is InstantOf.SAMPLED else received_ns
            return (at if at >= 0 else None), half_width
        if self._options.time is None or message.clock_id == 0:
            return None, half_width
        here = self._options.time.on_clock(self._options.clock_id, message.clock_id, message.mono_ns, received_ns)
        if not here.known or here.half_width_ns + half_width > self._options.max_time_half_width_ns:
            return None, half_width
        if here.era != self._era:  # instants of before and after are not comparable
            self._forget()
        self._era = here.era
        return (here.ns if here.ns >= 0 else None), half_width + here.half_width_ns

    # -- answers

    def check(self, now_ns: int) -> Freshness:
        """Returns whether the newest reading may be used at `now_ns`."""
        if (contradiction := self._contradiction()) is not None:
            return contradiction
        if self._valid_at is None:
            return Freshness.NO_READING
        max_age = self._max_age_ns()
        if max_age <= 0:
            return Freshness.LIMIT_UNKNOWN
        age = now_ns - self._valid_at
        if age < -_FUTURE_NS - self._valid_half_width:
            return Freshness.WRONG_CLOCK
        if age + self._valid_half_width > max_age:
            return Freshness.STALE
        return Freshness.FRESH if self._readings[-1].valid else Freshness.NOT_VALID

    def age_ns(self, now_ns: int) -> int:
        """Returns the time since the newest valid reading; -1 without a valid reading."""
        return -1 if self._valid_at is None else now_ns - self._valid_at

    def newest_instant_ns(self) -> int:
        """Returns the instant of the newest reading that is used, on the clock of the caller; 0 before the first."""
        return self._readings[-1].at if self._readings else 0

    def newest(self, now_ns: int) -> Position:
        """Returns the newest reading, at its own instant newest_instant_ns(), if it is fresh at `now_ns`."""
        freshness = self.check(now_ns)
        if freshness is not Freshness.FRESH:
            return self._refuse(Answer[freshness.name])
        last = self._readings[-1]
        return self._make(Answer.READ, last, last.flags, 0, 0.0, 0)

    def at(self, instant_ns: int) -> Position:
        """Returns the position at an instant. After the newest reading, it answers only where check(instant_ns) returns FRESH."""
        if (contradiction := self._contradiction()) is not None:
            return self._refuse(Answer[contradiction.name])
        if not self._readings:
            return self._refuse(Answer.NO_READING)
        if instant_ns > self._readings[-1].at:
            return self._extrapolate(instant_ns)
        after = self._readings[-1]
        for before in reversed(self._readings):
            if before.at == instant_ns:
                return self._make(Answer.READ, before, before.flags, 0, 0.0, 0) if before.valid else self._refuse(Answer.NOT_VALID)
            if before.at < instant_ns:
                return self._interpolate(before, after, instant_ns)
            after = before
        return self._refuse(Answer.BEFORE_HISTORY)

    def _contradiction(self) -> Freshness | None:
        """Why no reading can be used, whatever its age."""
        if self._contested:
            return Freshness.TWO_PUBLISHERS
        newest = self.newest_message
        if newest is not None and self._options.time is None and self._on_other_clock(newest):
            return Freshness.OTHER_CLOCK
        if newest is not None and not self._located:
            return Freshness.TIME_UNKNOWN
        return Freshness.WRONG_CLOCK if self._wrong_clock else None

    def _interpolate(self, before: _Reading, after: _Reading, instant_ns: int) -> Position:
        joined = self._joined(before, after)
        if joined is not Answer.INTERPOLATED:
            return self._refuse(joined)
        return self._make(joined, before, before.flags & after.flags, instant_ns - before.at, _slope(before, after),
                          max(before.half_width, after.half_width))

    def _extrapolate(self, instant_ns: int) -> Position:
        last = self._readings[-1]
        if not last.valid:
            return self._refuse(Answer.NOT_VALID)
        max_age = self._max_age_ns()
        ahead = instant_ns - last.at
        if max_age <= 0:
            return self._refuse(Answer.LIMIT_UNKNOWN)
        if ahead + self._valid_half_width > max_age:
            return self._refuse(Answer.STALE)
        if ahead > self._max_extrapolation_ns():
            return self._refuse(Answer.TOO_FAR_AHEAD)
        if last.flags & position_t.FLAG_SPEED_VALID:
            speed = last.counts_per_ns
        elif len(self._readings) > 1 and self._joined(self._readings[-2], last) is Answer.INTERPOLATED:
            speed = _slope(self._readings[-2], last)
        else:
            return self._refuse(Answer.SPEED_UNKNOWN)
        return self._make(Answer.EXTRAPOLATED, last, last.flags, ahead, speed, last.half_width)

    def _joined(self, a: _Reading, b: _Reading) -> Answer:
        """Returns INTERPOLATED if a straight line joins the two, else why not."""
        if not a.valid or not b.valid:
            return Answer.NOT_VALID
        if a.epoch != b.epoch or (a.flags ^ b.flags) & position_t.FLAG_TURNS_VALID:
            return Answer.DATUM_CHANGED
        return Answer.GAP if b.at - a.at > self._max_gap_ns() else Answer.INTERPOLATED

    def _refuse(self, answer: Answer) -> Position:
        return Position(answer, datum_epoch=self.newest_message.datum_epoch if self.newest_message else 0)

    def _make(self, answer: Answer, base: _Reading, flags: int, ahead_ns: int, counts_per_ns: float, half_width: int) -> Position:
        counts = base.counts + counts_per_ns * ahead_ns
        return Position(answer, counts, self._value(counts), abs(counts_per_ns) * half_width, flags, base.epoch)

    def _value(self, counts: float) -> float:
        if self._device_boot is None or self.newest_message is None or self._device_boot != self.newest_message.boot_id:
            return math.nan
        value = counts * self._unit_per_count
        if not self._modulo > 0:
            return value
        if not math.isfinite(value):
            return math.nan
        wrapped = math.fmod(value, self._modulo)
        positive = wrapped + self._modulo if wrapped < 0 else wrapped
        return positive if positive < self._modulo else 0.0

    def _max_age_ns(self) -> int:
        return self._options.max_age_ns if self._options.max_age_ns > 0 else self._device_max_age_ns

    def _max_extrapolation_ns(self) -> int:
        given = self._options.max_extrapolation_ns
        return given if given >= 0 else max(2 * self._device_period_ns, _LEAST_EXTRAPOLATION_NS)

    def _max_gap_ns(self) -> int:
        given = self._options.max_gap_ns
        return given if given >= 0 else max(3 * self._device_period_ns, _LEAST_GAP_NS)


def lost_between(seq: int, later: int) -> int:
    """Messages between two sequence numbers, at most 2^31: a wild number, which anybody on the network can send, is no larger loss."""
    return min((later - seq - 1) % 2**64, 2**31)


def _slope(a: _Reading, b: _Reading) -> float:
    return (float(b.counts) - float(a.counts)) / float(b.at - a.at)
