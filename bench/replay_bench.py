"""axlecast replay against stock lcm-logplayer, a bare timer and liblcm's own reader, in the same run: timing at speed 1, rate
at full speed, seek in a large log."""

import statistics
import struct
import subprocess
import time

import machine  # tests/e2e

GROUP, PORT = "239.255.76.67", 7667
PERIOD_US = 1000  # of the log that is timed
BYTES = 200  # of a message's data
FULL_SPEED = 200_000  # messages
SEEK_BYTES = 66  # of data: records of 100 bytes
RELEVANT_P99 = 100  # us: the target holds where a bare timer reaches it


BEGIN = 1_790_000_000_000_000  # us, of a log


def write_log(path, messages, size=BYTES):
    record = struct.Struct(f">IqqII6sq{size - 8}x").pack
    with open(path, "wb") as log:
        for i in range(messages):
            at = i * PERIOD_US
            log.write(record(0xEDA1DA01, i, BEGIN + at, 6, size, b"REPLAY", at))
    return path


def heard(bench, *command):
    """What the receiver got from one sender, which ran to its end."""
    ear = bench.listener("replay_ear", GROUP, str(PORT))
    done = subprocess.run([str(word) for word in command], stdout=bench.log, stderr=bench.log, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{command[0]} ended with {done.returncode}:\n{bench.said()}")
    return bench.heard(ear)


def replay(bench, log, speed):
    return heard(bench, machine.BIN / "axlecast", "replay", log, "--speed", speed, "--url", bench.url)


def logplayer(bench, log, speed):
    return heard(bench, "lcm-logplayer", "-s", speed, "-l", bench.url, log)


def measure(bench):
    count = int(bench.options.seconds * 1e6 / PERIOD_US)
    timed = write_log(bench.folder / "timed.log", count)
    triples = []
    for i in range(bench.options.pairs):
        runs = [lambda: replay(bench, timed, 1), lambda: logplayer(bench, timed, 1),
                lambda: heard(bench, bench.programs / "bare_timer", bench.url, count, PERIOD_US, BYTES)]
        order = [(i + k) % 3 for k in range(3)]
        results = {k: runs[k]() for k in order}
        triples.append([results[k] for k in range(3)])
    for key in ("p50_us", "p99_us"):
        ours, stock, bare = ([triple[k]["late"][key] for triple in triples] for k in range(3))
        bare_median = statistics.median(bare)
        ratios = [a / b for a, b in zip(ours, stock)]
        bench.report.add(f"replay, lateness {key[:3]} / logplayer", "us", statistics.median(ours), 1,
                         statistics.median(stock), ratios)
        judged = None if bare_median <= RELEVANT_P99 else False
        bench.report.add(f"replay, lateness {key[:3]}", "us", statistics.median(ours), RELEVANT_P99, bare_median,
                         judged=judged, note="the peer is a bare timer"
                         + ("" if judged is None else ", which does not reach 100 us itself"))
    full = write_log(bench.folder / "full.log", FULL_SPEED)
    pairs = []
    for i in range(bench.options.pairs):
        if i % 2 == 0:
            first = replay(bench, full, 0)
            pairs.append((first, logplayer(bench, full, 0)))
        else:
            first = logplayer(bench, full, 0)
            pairs.append((replay(bench, full, 0), first))
    ours, stock = ([pair[k]["messages"] / pair[k]["seconds"] for pair in pairs] for k in range(2))
    bench.report.add("replay, full speed", "/s", statistics.median(ours), 1, statistics.median(stock),
                     [a / b for a, b in zip(ours, stock)], at_most=False,
                     note=f"{min(pair[0]['messages'] for pair in pairs)} of {FULL_SPEED} received at least")


def first_message_ms(bench, *command):
    """From the start of a process to its first message."""
    started = time.time_ns()
    return (heard(bench, *command)["first_ns"] - started) * 1e-6


def measure_seek(bench):
    events = 1_000_000 if bench.options.quick else 10_000_000
    log = write_log(bench.folder / "seek.log", events, SEEK_BYTES)
    at_us = (events - 1_000) * PERIOD_US
    runs = [lambda: first_message_ms(bench, machine.BIN / "axlecast", "replay", log, "--from", at_us * 1e-6, "--speed", 0,
                                     "--url", bench.url, "--allow-live", "--yes-allow-live"),
            lambda: first_message_ms(bench, bench.programs / "bare_seek", "seek", log, BEGIN + at_us, bench.url),
            lambda: first_message_ms(bench, bench.programs / "bare_seek", "read", log, BEGIN + at_us, bench.url)]
    triples = []
    for i in range(bench.options.pairs):
        results = {(i + k) % 3: runs[(i + k) % 3]() for k in range(3)}
        triples.append([results[k] for k in range(3)])
    ours, seek, read = ([triple[k] for triple in triples] for k in range(3))
    bench.report.add("seek / liblcm reads up to there", "ms", statistics.median(ours), 0.1, statistics.median(read),
                     [a / b for a, b in zip(ours, read)], note=f"{events} events, {log.stat().st_size * 1e-6:.0f} MB")
    bench.report.add("seek / liblcm's seek", "ms", statistics.median(ours), 1, statistics.median(seek),
                     [a / b for a, b in zip(ours, seek)], judged=False, note="whole processes, from their start")
