"""axlecast record against stock lcm-logger and a bare receive loop, in the same run: what each loses of bursts and of
steady traffic, and what a message costs; what the recorder tells of losses that are the kernel's; how fast logs are mended."""

import dataclasses
import json
import pathlib
import random
import signal
import statistics
import struct
import subprocess
import time

import lcm_log  # tests/e2e
import machine
from process_cost import cpu_seconds

GROUP, PORT = "239.255.76.67", 7667
URL = f"udpm://{GROUP}:{PORT}?ttl=0"
ELSEWHERE = f"udpm://{GROUP}:7668?ttl=0"  # where the recorder's own health goes
BUFFER = 32 << 20  # bytes, asked of the kernel by all three
SMALL_BUFFER = 65_536
BYTES = 200
BURSTS = (30, 100, 300, 1_000, 3_000, 10_000)
RATES = (1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 100_000, 200_000)
COST_RATE = 20_000
SETTLE = 0.2  # s, from the socket to a process that has finished its start
KINDS = ("record", "lcm-logger", "bare")


@dataclasses.dataclass
class Run:
    sent: int
    recorded: int
    cpu_us: float  # of a recorded message

    @property
    def lost(self):
        return self.sent - self.recorded


def waiting():
    """Bytes that wait in the sockets of the port; None without any socket."""
    sizes = [int(fields[4].split(":")[1], 16) for fields in map(str.split, open("/proc/net/udp").readlines()[1:])
             if fields[1].endswith(f":{PORT:04X}")]
    return sum(sizes) if sizes else None


def wait_quiet(process):
    """Until it has taken all there is and rests."""
    rests = 0
    while rests < 2:
        before = cpu_seconds(process.pid)
        time.sleep(0.05)
        rests = rests + 1 if waiting() == 0 and cpu_seconds(process.pid) - before < 1e-3 else 0


def send(bench, messages, rate):
    """The sender's truth."""
    done = subprocess.run([bench.programs / "record_sender", GROUP, str(PORT), str(messages), str(rate), str(BYTES)],
                          stdout=subprocess.PIPE, stderr=bench.log, text=True, check=True)
    return json.loads(done.stdout)


def numbers(log):
    """Of the sender's messages in a log."""
    return [struct.unpack_from(">I", data)[0] for channel, data in lcm_log.events(log) if channel == "LOAD"]


def start(bench, kind, log):
    log.unlink(missing_ok=True)
    if kind == "bare":
        process = bench.listener("bare_receive", GROUP, str(PORT), str(BUFFER))
    elif kind == "record":
        process = bench.start(machine.BIN / "axlecast", "record", log, "--url", f"{URL}&recv_buf_size={BUFFER}")
    else:
        process = bench.start("lcm-logger", "-q", f"--lcm-url={URL}&recv_buf_size={BUFFER}", log)
    machine.wait_for(lambda: waiting() is not None, f"{kind} to listen")
    time.sleep(SETTLE)
    return process


def run(bench, kind, messages, rate):
    """One clean process for one load."""
    log = bench.folder / "run.lcm"
    process = start(bench, kind, log)
    wait_quiet(process)
    before = cpu_seconds(process.pid)
    sent = send(bench, messages, rate)["sent"]
    wait_quiet(process)
    cpu = cpu_seconds(process.pid) - before
    if kind == "bare":
        recorded = bench.heard(process)["messages"]
    else:
        process.send_signal(signal.SIGINT)
        process.wait(60)
        recorded = len(set(numbers(log)))
    return Run(sent, recorded, cpu / max(recorded, 1) * 1e6)


def rotated(turn, one):
    """One result of each kind, each turn in another order."""
    order = [KINDS[(turn + k) % len(KINDS)] for k in range(len(KINDS))]
    results = {kind: one(kind) for kind in order}
    return {kind: results[kind] for kind in KINDS}


def lost(turns, kind):
    return sum(turn[kind].lost for turn in turns)


def bursts(bench, sizes, turns):
    for size in sizes:
        seen = [rotated(turn, lambda kind: run(bench, kind, size, 0)) for turn in range(turns)]
        bench.report.add(f"record, burst of {size}: lost", "", lost(seen, "record"), 0, lost(seen, "lcm-logger"),
                         note=f"of {sum(turn['record'].sent for turn in seen)}; a bare loop {lost(seen, 'bare')}")


def loss_free(seen, kind):
    """The highest rate up to which nothing is lost."""
    highest = 0
    for rate, turns in seen.items():
        if lost(turns, kind) > 0:
            break
        highest = rate
    return highest


def sustained(bench, rates, turns, seconds):
    seen = {rate: [rotated(turn, lambda kind: run(bench, kind, int(rate * seconds), rate)) for turn in range(turns)]
            for rate in rates}
    ours, stock = (loss_free(seen, kind) for kind in ("record", "lcm-logger"))
    for rate, results in seen.items():
        bench.report.add(f"record, {rate}/s: lost", "", lost(results, "record"), 0, lost(results, "lcm-logger"),
                         judged=None if rate <= 3 * stock else False,
                         note=f"of {sum(turn['record'].sent for turn in results)}; a bare loop {lost(results, 'bare')}")
    # A logger that loses nothing at a third of the highest rate leaves no room for three times as much.
    wanted = min(3, rates[-1] / stock) if stock else 3
    bench.report.add("record, highest loss-free rate", "/s", ours, wanted, stock, [ours / (stock or rates[0])],
                     at_most=False, note=f"a bare loop {loss_free(seen, 'bare')}; up to {rates[-1]} tried")


def cost(bench):
    turns = [rotated(turn, lambda kind: run(bench, kind, int(COST_RATE * bench.options.seconds), COST_RATE))
             for turn in range(bench.options.pairs)]
    ours = [turn["record"].cpu_us for turn in turns]
    for kind in KINDS[1:]:
        peer = [turn[kind].cpu_us for turn in turns]
        bench.report.add(f"record, CPU of a message / {kind}", "us", statistics.median(ours), None,
                         statistics.median(peer), [a / b for a, b in zip(ours, peer)])


def told(bench, at_end):
    """A recorder with a small buffer stops for a while, and again until the sender has ended: what it reports of the
    loss, against what the loss is."""
    log = bench.folder / "drops.lcm"
    log.unlink(missing_ok=True)
    process = bench.start(machine.BIN / "axlecast", "record", log, "--json", "--url", ELSEWHERE, "--url",
                          f"{URL}&recv_buf_size={SMALL_BUFFER}", stdout=subprocess.PIPE, text=True)
    process.stdout.readline()  # that it listens
    sender = bench.start(bench.programs / "record_sender", GROUP, PORT, COST_RATE, COST_RATE, BYTES,
                         stdout=subprocess.PIPE, text=True)
    for last in (False, True) if at_end else (False,):
        time.sleep(0.2)
        process.send_signal(signal.SIGSTOP)
        if last:
            sender.wait(60)
        else:
            time.sleep(0.2)
            process.send_signal(signal.SIGCONT)
    sender.wait(60)
    truth = json.loads(sender.stdout.read())
    process.send_signal(signal.SIGINT)
    process.send_signal(signal.SIGCONT)
    summary = json.loads(process.communicate(timeout=60)[0].splitlines()[-1])
    kept = numbers(log)
    behind_the_last = truth["last"] - kept[-1]
    wrong = abs(summary["lost_by_number"] - (truth["sent"] - len(kept) - behind_the_last))
    wrong += abs(summary["kernel_dropped"] - summary["lost_by_number"] - behind_the_last)
    bench.report.add(f"record, losses{' at the end' if at_end else ''} not told", "", wrong, 0,
                     note=f"lost {truth['sent'] - len(kept)} of {truth['sent']}, {behind_the_last} behind the last heard; "
                          f"by number {summary['lost_by_number']}, dropped by the kernel {summary['kernel_dropped']}")


def write_damaged(path, megabytes):
    """A log of so many MB with ten bytes overwritten in each."""
    chance = random.Random(1)
    per_block = (1 << 20) // (28 + 4 + BYTES)
    data = bytes(BYTES)
    with open(path, "wb") as log:
        for block in range(megabytes):
            first = block * per_block
            records = bytearray(b"".join(lcm_log.record(1_790_000_000_000_000 + i, "LOAD", data, i)
                                         for i in range(first, first + per_block)))
            at = chance.randrange(len(records) - 10)
            records[at:at + 10] = chance.randbytes(10)
            log.write(records)
    return path


def timed(bench, code, *command):
    began = time.monotonic()
    done = subprocess.run([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=bench.log, check=False)
    if done.returncode != code:
        raise RuntimeError(f"{command} ended with {done.returncode}:\n{bench.said()}")
    return time.monotonic() - began


def mending(bench, megabytes):
    log = write_damaged(bench.folder / "damaged.lcm", megabytes)
    size = pathlib.Path(log).stat().st_size * 1e-6
    axlecast = machine.BIN / "axlecast"
    peer = size / timed(bench, 0, "cat", log)
    for what, command in (("verify", ("verify", log)), ("repair", ("repair", log, "--output", bench.folder / "whole.lcm"))):
        bench.report.add(f"log {what}, damaged", "MB/s", size / timed(bench, 3, axlecast, "log", *command), None, peer,
                         note=f"{size:.0f} MB; the peer is cat FILE >/dev/null")


def measure(bench):
    quick = bench.options.pairs <= 3
    bursts(bench, (100, 1_000, 10_000) if quick else BURSTS, 1 if quick else 3)
    if quick:
        sustained(bench, (2_000, 20_000, 100_000), 1, 0.5)
    else:
        sustained(bench, RATES, 3, 2)
    cost(bench)
    for at_end in (False, True):
        told(bench, at_end)
    mending(bench, 128 if quick else 1_024)
