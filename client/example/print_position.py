#!/usr/bin/python3
"""Prints the positions of one machine's axes: print_position.py [URL] [PREFIX]"""

import sys

import axlecast
from axlecast.receiver import Receiver

with Receiver(*sys.argv[1:2], prefix=sys.argv[2] if len(sys.argv) > 2 else "") as receiver:
    for message in receiver.messages():
        position = receiver.decode(message)
        if isinstance(position, axlecast.position_t):
            valid = position.flags & axlecast.position_t.FLAG_VALID
            print(message.channel, f"{position.value:.3f}" if valid else "not valid", f"{receiver.lost} lost", flush=True)
