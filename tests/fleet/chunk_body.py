"""Encodes bodies of chunks from the text of docs/fleet.md, independently of tools/fleet."""

import struct

T, COUNTS, FLAGS, SEQ, MISSED = 1, 2, 3, 4, 5
LINEAR, DELTA, DELTA_OF_DELTA, RUNS = range(4)


def wrapped(value):
    """Returns the value modulo 2^64 as a signed integer."""
    return (value + 2**63) % 2**64 - 2**63


def towards_zero(numerator, denominator):
    quotient = abs(numerator) // denominator
    return quotient if numerator >= 0 else -quotient


def residuals(mode, values):
    """Returns the two values at the head of a column (the second may be missing), and the residuals."""
    n = len(values)
    if mode == LINEAR:
        line = [values[0] + (towards_zero((values[-1] - values[0]) * i, n - 1) if n > 1 else 0) for i in range(n)]
        return [values[0], values[-1]], [wrapped(value - on_line) for value, on_line in zip(values, line)]
    steps = [wrapped(b - a) for a, b in zip(values, values[1:])]
    if mode == DELTA:
        return [values[0]], steps
    first_step = steps[0] if steps else 0
    return [values[0], first_step], [wrapped(b - a) for a, b in zip(steps, steps[1:])]


def packed(residual, width):
    """Returns the bytes of a residual, or None if it does not fit."""
    zigzag = residual * 2 if residual >= 0 else -residual * 2 - 1
    if width == 0:
        return b"" if zigzag == 0 else None
    greatest = 2 ** (8 * width) - 1
    if width in (1, 2) and zigzag >= greatest:
        return greatest.to_bytes(width, "big") + zigzag.to_bytes(8, "big")
    return zigzag.to_bytes(width, "big") if zigzag <= greatest else None


def column(number, mode, values, width):
    """Returns the bytes of one column, or None if the width is too small."""
    if mode == RUNS:
        runs = []
        for value in values:
            if runs and runs[-1][1] == value:
                runs[-1][0] += 1
            else:
                runs.append([1, value])
        data = b"".join(struct.pack(">Hq", *run) for run in runs)
    else:
        head, rest = residuals(mode, values)
        parts = [packed(residual, width) for residual in rest]
        if None in parts:
            return None
        data = b"".join(struct.pack(">q", value) for value in head) + b"".join(parts)
    return struct.pack(">BBBI", number, mode, width, len(data)) + data


def smallest(number, values):
    """Returns the smallest form of a column."""
    modes = [mode for mode in range(4) if mode != LINEAR or abs(values[-1] - values[0]) < 2**52]
    forms = [column(number, mode, values, width) for mode in modes for width in (0, 1, 2, 4, 8)]
    return min((form for form in forms if form), key=len)


def body(columns):
    """Returns a body of columns that are bytes already."""
    return bytes([1, len(columns)]) + b"".join(columns)


def chunk(times, counts, flags, missed=None, seq=None):
    """Returns the body of samples: times in us after t0."""
    given = {T: times, COUNTS: counts, FLAGS: flags, MISSED: missed, SEQ: seq}
    return body([smallest(number, values) for number, values in given.items() if values])
