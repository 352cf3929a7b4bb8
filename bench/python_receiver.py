"""python_receiver.py URL: receives and decodes positions with client/python until SIGTERM, then prints what came as one JSON object."""

import json
import signal
import sys
import time

import axlecast
from axlecast.receiver import Receiver


def main():
    stopped = []
    signal.signal(signal.SIGTERM, lambda *_: stopped.append(True))
    positions = 0
    with Receiver(sys.argv[1]) as receiver:
        print("ready", flush=True)
        begin = time.process_time()
        while not stopped:
            for message in receiver.messages(0.1):
                positions += isinstance(receiver.decode(message), axlecast.position_t)
        print(json.dumps({"messages": positions, "lost": receiver.lost, "cpu_s": time.process_time() - begin}))


main()
