#!/usr/bin/python3
"""Reads the positions of one axis from a log into a pandas DataFrame: log_to_pandas.py LOG DEVICE [--prefix PREFIX] [--csv FILE]

Needs python3-pandas, and for compressed logs python3-zstandard."""

import argparse

import axlecast
import pandas
from axlecast.log import Log

P = axlecast.position_t


def positions(log: Log, channel: str) -> pandas.DataFrame:
    """Returns one row for each message of the channel, by its sampling instant (UTC). `value`, in the unit of the axis, and `counts` are
    missing where the position is not valid. `lost`: messages between the row and the one before; -1: the driver was restarted."""
    rows = []
    before = None
    for event in log.events(channel):
        position = log.decode(event)
        if not isinstance(position, P):
            continue
        restarted = before is not None and before.boot_id != position.boot_id
        lost = -1 if restarted else max(position.seq - before.seq - 1, 0) if before else 0
        valid = bool(position.flags & P.FLAG_VALID)
        rows.append((position.utime, position.value if valid else None, position.counts if valid else None, valid,
                     bool(position.flags & P.FLAG_TURNS_VALID), bool(position.flags & P.FLAG_REFERENCED), lost, position.missed))
        before = position
    frame = pandas.DataFrame(rows, columns=["utime", "value", "counts", "valid", "turns_valid", "referenced", "lost", "missed"])
    frame = frame.astype({"value": "float64", "counts": "Int64"})
    return frame.set_index(pandas.to_datetime(frame.pop("utime"), unit="us", utc=True, errors="coerce"))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("log")
    parser.add_argument("device")
    parser.add_argument("--prefix", default="")
    parser.add_argument("--csv", metavar="FILE")
    arguments = parser.parse_args()
    with Log(arguments.log) as log:
        frame = positions(log, f"{arguments.prefix}POSITION/{arguments.device}")
        print(frame)
        print(f"{(~frame.valid).sum()} not valid, {frame.lost.clip(lower=0).sum()} lost, {log.skipped.bytes} bytes of the log damaged")
    if arguments.csv:
        frame.to_csv(arguments.csv)


if __name__ == "__main__":
    main()
