"""The processes of a soak, what a consumer receives of them, and what they use of the host."""

import dataclasses
import os
import pathlib
import statistics
import struct
import subprocess
import threading
import time

from lcm_ear import LcmEar

VALID = 0x1
SETTLED = 30.0  # s after the start of a process: its tables are filled
SPAN = 60.0  # s: a shorter life is not judged
EDGE = 5  # samples at each end of a life
MORE_MEMORY = 3_000  # kB that a life may use at its end more than when it had settled
MORE_FILES = 2  # files or threads


class Consumer(LcmEar):
    """Counts what every device publishes: valid readings, motor health, and readings that are missing in the numbers."""

    def __init__(self):
        self.lock = threading.Lock()
        self.valid = 0
        self.lost = 0
        self.gaps = []  # (monotonic s, device, missing readings)
        self.newest = {}  # device: when it was last good
        self.numbers = {}
        super().__init__()

    def _take(self, channel, data):
        kind, _, device = channel.decode().partition("/")
        with self.lock:
            if kind == "MOTOR":
                self.newest[device] = time.monotonic()
            if kind != "POSITION":
                return
            boot, number = struct.unpack_from(">qq", data, 24)
            if struct.unpack_from(">i", data, 133)[0] & VALID:
                self.valid += 1
                self.newest[device] = time.monotonic()
            newest = self.numbers.get((device, boot))
            if newest is not None and number > newest + 1:
                self.lost += number - newest - 1
                self.gaps.append((time.monotonic(), device, number - newest - 1))
            self.numbers[device, boot] = max(number, newest if newest is not None else number)

    def counts(self):
        with self.lock:
            return self.valid, self.lost

    def silent(self, devices, within):
        """The devices without a good message in the last `within` seconds."""
        now = time.monotonic()
        with self.lock:
            return [device for device in devices if now - self.newest.get(device, 0) > within]


@dataclasses.dataclass
class Use:
    """What a process uses of the host."""
    at: float
    memory: int  # kB
    files: int
    threads: int


@dataclasses.dataclass
class Life:
    """One life of a process, from its start to its end."""
    part: str
    began: float
    settled: float
    uses: list

    def growth(self):
        """What grew, or an empty text; None if it was too short to be judged."""
        later = [use for use in self.uses if use.at - self.began >= self.settled]
        if len(later) < 2 * EDGE or later[-1].at - later[0].at < SPAN:
            return None

        def more(of):
            return statistics.median(map(of, later[-EDGE:])) - statistics.median(map(of, later[:EDGE]))
        grown = []
        if more(lambda use: use.memory) > MORE_MEMORY:
            grown.append(f"{more(lambda use: use.memory):.0f} kB")
        if more(lambda use: use.files) > MORE_FILES:
            grown.append(f"{more(lambda use: use.files):.0f} files")
        if more(lambda use: use.threads) > MORE_FILES:
            grown.append(f"{more(lambda use: use.threads):.0f} threads")
        return f"{self.part} grew by {', '.join(grown)} in {later[-1].at - later[0].at:.0f} s" if grown else ""


class Part:
    """A process that is started again after it was killed."""

    def __init__(self, name, command, log, env=None, settled=SETTLED):
        self.settled = settled
        self.name, self.command, self.env = name, [str(word) for word in command], {**os.environ, **(env or {})}
        self.log = log
        self.lives = []
        self.process = None
        self.frozen = False

    def start(self):
        self.process = subprocess.Popen(self.command, stdout=self.log, stderr=self.log, stdin=subprocess.DEVNULL, env=self.env)
        self.lives.append(Life(self.name, time.monotonic(), self.settled, []))

    def runs(self):
        return self.process is not None and self.process.poll() is None

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.process = None

    def use(self):
        """What it uses now; nothing while it does not run."""
        try:
            folder = pathlib.Path("/proc") / str(self.process.pid)
            status = dict(line.split(":", 1) for line in (folder / "status").read_text().splitlines())
            return Use(time.monotonic(), int(status["VmRSS"].split()[0]), len(list((folder / "fd").iterdir())), int(status["Threads"]))
        except (AttributeError, OSError, KeyError):
            return None
