"""The receiver of client/python beside a bare receive loop in C: which rates of positions it receives and decodes without loss."""

import pathlib
import statistics
import struct
import subprocess
import time

import machine  # tests/e2e
from record_bench import BUFFER, GROUP, PORT, URL, waiting

RATES = (5_000, 10_000, 20_000, 40_000, 60_000)
WANTED = 20_000
RUNS = 3
BEGIN = 1_790_000_000_000_000  # us


def write_log(path, messages, rate):
    """A log of positions, encoded by lcm-gen's Python."""
    import axlecast  # of the build

    message = axlecast.position_t()
    message.counts_per_turn, message.value, message.flags = 131_072, 1.5, axlecast.position_t.FLAG_VALID
    channel = b"POSITION/axis1"
    head = struct.Struct(">IqqII").pack
    with open(path, "wb") as log:
        for i in range(messages):
            message.seq = i
            data = message.encode()
            log.write(head(0xEDA1DA01, i, BEGIN + i * 1_000_000 // rate, len(channel), len(data)) + channel + data)
    return path


def play(bench, log, listener):
    """What a receiver has got of the log."""
    machine.wait_for(lambda: waiting() is not None, "the receiver to listen")
    subprocess.run([machine.BIN / "axlecast", "replay", log, "--url", bench.url], stdout=bench.log,
                   stderr=bench.log, check=True)
    machine.wait_for(lambda: waiting() == 0, "the receiver to take what waits")
    time.sleep(0.3)
    return bench.heard(listener)


def listen(bench):
    program = pathlib.Path(__file__).with_name("python_receiver.py")
    receiver = bench.start("/usr/bin/python3", program, f"{URL}&recv_buf_size={BUFFER}", stdout=subprocess.PIPE, text=True)
    if receiver.stdout.readline() != "ready\n":
        raise RuntimeError(f"{program} did not start")
    return receiver


def measure(bench):
    rates = RATES if not bench.options.quick else (WANTED,)
    highest, stopped = 0, False
    for rate in rates:
        sent = int(rate * 4 * bench.options.seconds)
        log = write_log(bench.folder / "positions.lcm", sent, rate)
        python = [play(bench, log, listen(bench)) for _ in range(RUNS)]
        bare = [play(bench, log, bench.listener("bare_receive", GROUP, str(PORT), str(BUFFER))) for _ in range(RUNS)]
        lost, bare_lost = (max(max(0, sent - run["messages"]) for run in runs) for runs in (python, bare))
        stopped = stopped or lost > 0
        highest = highest if stopped else rate
        cost = statistics.median(1e6 * run["cpu_s"] / max(run["messages"], 1) for run in python)
        bench.report.add(f"python, {rate}/s: lost", "", lost, 0 if rate <= WANTED else None, bare_lost,
                         note=f"of {sent}, the most of {RUNS} runs; {cost:.1f} us of CPU time for a message")
    bench.report.add("python, highest loss-free rate", "/s", highest, WANTED, at_most=False, note=f"up to {rates[-1]} tried")
