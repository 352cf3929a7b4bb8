#!/usr/bin/env python3
"""How much of a paced Modbus line's theoretical rate the driver of motor monitors reaches (bench/README.md).

Started by bench/run --only poll. The machines run side by side: each needs about 1 % of a processor, because the line
is slow. The peer is arithmetic: the time that the requests, the replies and the pauses of the maker's guideline take."""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import threading
import time

BIN = pathlib.Path(os.environ["AXLECAST_BIN"])
CHARACTER = 11 / 9600  # s: start, 8 bits, parity, stop
# Two requests of 8 characters and replies of 19 and 15, 5 ms of silence before each reply, 0.1 s after it (reading A).
LIVE_CYCLE = (8 + 19 + 8 + 15) * CHARACTER + 2 * (0.005 + 0.1)
# A share of damaged bits that damages 1 % of the replies (their mean length is 17 characters).
ONE_PERCENT = 0.01 / (17 * 8)


class Case:
    def __init__(self, name, units, target, simulate="", without=None):
        self.name, self.units, self.target, self.simulate, self.without = name, units, target, simulate, without

    def start(self, folder, port, cycles):
        devices = "".join(f"      gm{i}: {{address: {i}}}\n" for i in range(1, self.units + 1))
        config = folder / f"{self.name}.yaml"
        config.write_text(f"""machine: {self.name}
lcm: {{url: "udpm://239.255.76.67:{port}?ttl=0", command_url: "udpm://239.255.76.67:{port + 1}?ttl=0"}}
buses:
  motors:
    family: tsubaki_sc
    simulate: {{{self.simulate}}}
    devices:
{devices}""")
        self.processes = [subprocess.Popen([BIN / "axlecast", "simulate", config], stdout=subprocess.DEVNULL)]
        self.processes.append(subprocess.Popen([BIN / "axlecast", "driver", "motors", "--config", config],
                                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        self.watch = subprocess.Popen([BIN / "axlecast", "watch", config, "--json"], stdout=subprocess.PIPE, text=True)
        self.processes.append(self.watch)
        self.cycles = cycles
        self.readings = {}
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.watch.stdout:
            message = json.loads(line)
            if message["channel"].startswith("MOTOR/"):
                self.readings.setdefault(message["channel"], []).append(message["mono_ns"])

    def counted(self):
        """Instants of the readings of every unit that is there, without those of the start."""
        channels = [f"MOTOR/gm{i}" for i in range(1, self.units + 1) if i != self.without]
        skip = 60 // (self.units * LIVE_CYCLE) if self.units > 1 else 60
        return [self.readings.get(channel, [])[int(skip):] for channel in channels]

    def done(self):
        return all(len(instants) > self.cycles for instants in self.counted())

    def mean_cycle(self):
        return statistics.mean((instants[-1] - instants[0]) / (len(instants) - 1) * 1e-9 for instants in self.counted())

    def stop(self):
        for process in self.processes:
            process.terminate()
        for process in self.processes:
            process.wait()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--cycles", type=int, default=20, help="live cycles of every unit that are measured")
    options = parser.parse_args()
    cases = [Case("one", 1, 0.99), Case("four", 4, 0.99), Case("sixteen", 16, 0.99),
             Case("one-of-16-gone", 16, 0.95, "gm7: {power: off}", without=7),
             Case("damaged", 16, 0.95, ", ".join(f'gm{i}: {{fault: "bit_flip:{ONE_PERCENT:.7f}"}}' for i in range(1, 17)))]
    with tempfile.TemporaryDirectory(prefix="axlecast-poll-") as name:
        folder = pathlib.Path(name)
        os.environ["AXLECAST_RUN_DIR"] = str(folder / "run")
        try:
            for i, case in enumerate(cases):
                case.start(folder, 7700 + 2 * i, options.cycles)
            deadline = time.monotonic() + 100 + 2 * options.cycles * 16 * LIVE_CYCLE
            while not all(case.done() for case in cases) and time.monotonic() < deadline:
                time.sleep(0.5)
            for case in cases:
                if not case.done():
                    print(f"poll {case.name}: only {[len(i) for i in case.counted()]} readings", file=sys.stderr)
                    return 1
                ideal, seen = case.units * LIVE_CYCLE, case.mean_cycle()
                print(f"poll, {case.name:16} {case.units:2} units  cycle {seen:7.4f} s  theory {ideal:7.4f} s  "
                      f"ratio {ideal / seen:.4f}  >= {case.target}  {'met' if ideal / seen >= case.target else 'missed'}")
        finally:
            for case in cases:
                case.stop()
    return 0


if __name__ == "__main__":
    sys.exit(main())
