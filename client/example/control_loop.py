#!/usr/bin/python3
"""Reads an axis in a loop with a fixed period, as a controller does: control_loop.py DEVICE [--url URL] [--prefix PREFIX]"""

import argparse
import time

import axlecast
from axlecast.position_tracker import Freshness, PositionTracker
from axlecast.lcm_url import DEFAULT
from axlecast.receiver import Receiver

PERIOD_NS = 10_000_000

parser = argparse.ArgumentParser()
parser.add_argument("device")
parser.add_argument("--url", default=DEFAULT)
parser.add_argument("--prefix", default="")
arguments = parser.parse_args()

axis = PositionTracker()
with Receiver(arguments.url, prefix=arguments.prefix) as receiver:
    cycle = time.monotonic_ns()
    while True:
        cycle += PERIOD_NS
        # Take what arrives until the next cycle.
        while (left_ns := cycle - time.monotonic_ns()) > 0:
            for message in receiver.messages(left_ns / 1e9):
                if message.channel == "POSITION/" + arguments.device and (position := receiver.decode(message)):
                    axis.on_position(position, time.monotonic_ns())
                elif message.channel == "DEVICE/" + arguments.device and (info := receiver.decode(message)):
                    axis.on_device(info)
                break
        freshness = axis.check(cycle)
        if freshness is Freshness.FRESH and (at := axis.at(cycle)).known and at.flags & axlecast.position_t.FLAG_TURNS_VALID:
            print(f"{at.value:.3f} ± {at.timing_error_counts:.1f} counts", flush=True)
        else:
            print(f"no position: {freshness.value}", flush=True)
