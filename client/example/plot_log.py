#!/usr/bin/python3
"""Draws the positions of axes over time, from a log: plot_log.py LOG DEVICE... [--prefix PREFIX] [-o FILE.png]

A line has a gap where a position is not valid, where messages are lost, and where the driver was restarted. Needs python3-matplotlib, and
for compressed logs python3-zstandard."""

import argparse
import datetime
import math

import axlecast
import matplotlib
from axlecast.log import Log

P = axlecast.position_t
LATEST = 4_102_444_800_000_000  # us, UNIX time: 2100
UNITS = ("count", "turn", "rad", "deg", "mm", "m", "um", "inch")  # by position_t.UNIT_*


class Curve:
    """The line of one axis."""

    def __init__(self) -> None:
        self.times: list[datetime.datetime] = []  # UTC
        self.values: list[float] = []  # in the unit of the axis; NaN: a gap
        self.unit = ""
        self._before: P | None = None

    def add(self, position: P) -> None:
        """Appends a position, and a gap before it if messages are missing."""
        if not 0 <= position.utime < LATEST:
            return  # damaged
        time = datetime.datetime.fromtimestamp(position.utime / 1e6, datetime.timezone.utc)
        before, self._before = self._before, position
        if before is not None and (before.boot_id != position.boot_id or before.seq + 1 != position.seq):
            self._append(time, math.nan)
        self._append(time, position.value if position.flags & P.FLAG_VALID else math.nan)
        self.unit = UNITS[position.unit] if 0 <= position.unit < len(UNITS) else "unknown unit"

    def _append(self, time: datetime.datetime, value: float) -> None:
        self.times.append(time)
        self.values.append(value)


def curves(log: Log, devices: list[str], prefix: str = "") -> dict[str, Curve]:
    """Returns the line of each axis, by its name."""
    found = {f"{prefix}POSITION/{device}": Curve() for device in devices}
    for event in log:
        curve = found.get(event.channel)
        if curve is not None and isinstance(position := log.decode(event), P):
            curve.add(position)
    return dict(zip(devices, found.values()))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("log")
    parser.add_argument("devices", nargs="+", metavar="DEVICE")
    parser.add_argument("--prefix", default="")
    parser.add_argument("-o", "--output", metavar="FILE", help="write a picture and open no window")
    arguments = parser.parse_args()
    if arguments.output:
        matplotlib.use("Agg")
    from matplotlib import pyplot  # after the choice of the window

    with Log(arguments.log) as log:
        drawn = curves(log, arguments.devices, arguments.prefix)
    figure, axes = pyplot.subplots(len(drawn), sharex=True, squeeze=False, layout="constrained")
    for (device, curve), panel in zip(drawn.items(), axes[:, 0]):
        panel.plot(curve.times, curve.values, marker=".", markersize=2)  # a single position between gaps is a dot
        panel.set_ylabel(f"{device} [{curve.unit}]")
        panel.grid(True)
    axes[-1, 0].set_xlabel("UTC")
    figure.autofmt_xdate()
    if arguments.output:
        figure.savefig(arguments.output, dpi=150)
    else:
        pyplot.show()


if __name__ == "__main__":
    main()
