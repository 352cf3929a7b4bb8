"""How much of a paced Modbus line's theoretical rate the driver of motor monitors reaches.

The machines run side by side: each needs about 1 % of a processor, because the line is slow. The peer is arithmetic:
the time that requests, replies and the pauses of the maker's guideline take."""

import json
import statistics
import subprocess
import threading
import time

import machine

CHARACTER = 11 / 9600  # s: start, 8 bits, parity, stop
# Two requests of 8 characters and replies of 19 and 15, 5 ms of silence before each reply, 0.1 s after it (reading A).
LIVE_CYCLE = (8 + 19 + 8 + 15) * CHARACTER + 2 * (0.005 + 0.1)
# A share of damaged bits that damages 1 % of the replies (their mean length is 17 characters).
ONE_PERCENT = 0.01 / (17 * 8)
START = 60  # s until everything that is read once after a start is read


class PolledUnits:
    """`units` simulated units on one bus, their driver, and the instants of their readings."""

    def __init__(self, name, units, target, simulate="", without=None):  # `name` also of the machine
        self.name, self.units, self.target, self.simulate, self.without = name, units, target, simulate, without
        self.readings = {}

    def start(self, bench, port):
        devices = "".join(f"      gm{i}: {{address: {i}}}\n" for i in range(1, self.units + 1))
        config = bench.folder / f"{self.name}.yaml"
        config.write_text(f"""machine: {self.name}
lcm: {{url: "udpm://239.255.76.67:{port}?ttl=0", command_url: "udpm://239.255.76.67:{port + 1}?ttl=0"}}
buses:
  motors:
    family: tsubaki_sc
    simulate: {{{self.simulate}}}
    devices:
{devices}""")
        axlecast = machine.BIN / "axlecast"
        bench.start(axlecast, "simulate", config)
        bench.start(machine.BIN / "axlecast-tsubaki-sc", "--bus", "motors", "--config", config)
        self.watch = bench.start(axlecast, "watch", config, "--json", stdout=subprocess.PIPE, text=True)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.watch.stdout:
            message = json.loads(line)
            if message["channel"].startswith("MOTOR/"):
                self.readings.setdefault(message["channel"], []).append(message["mono_ns"])

    def counted(self):
        """Instants of the readings of every unit that is there, without those of the start."""
        skip = int(START / (self.units * LIVE_CYCLE))
        return [self.readings.get(f"MOTOR/gm{i}", [])[skip:] for i in range(1, self.units + 1) if i != self.without]

    def done(self, cycles):
        return all(len(instants) > cycles for instants in self.counted())

    def mean_cycle(self):
        return statistics.mean((instants[-1] - instants[0]) / (len(instants) - 1) * 1e-9 for instants in self.counted())


def measure(bench, cycles):
    """Each case with its theoretical and its mean live cycle in seconds."""
    cases = [PolledUnits("one-unit", 1, 0.99), PolledUnits("four-units", 4, 0.99), PolledUnits("16-units", 16, 0.99),
             PolledUnits("one-of-16-dead", 16, 0.95, 'gm7: {fault: "off"}', without=7),
             PolledUnits("16-damaged", 16, 0.95,
                         ", ".join(f'gm{i}: {{fault: "bit_flip:{ONE_PERCENT:.7f}"}}' for i in range(1, 17)))]
    for i, case in enumerate(cases):
        case.start(bench, 7700 + 2 * i)
    deadline = time.monotonic() + 2 * START + 2 * cycles * 16 * LIVE_CYCLE
    while not all(case.done(cycles) for case in cases):
        if time.monotonic() > deadline:
            missing = [case.name for case in cases if not case.done(cycles)]
            raise RuntimeError(f"poll: too few readings of {', '.join(missing)}:\n{bench.said()}")
        time.sleep(0.5)
    return [(case, case.units * LIVE_CYCLE, case.mean_cycle()) for case in cases]
