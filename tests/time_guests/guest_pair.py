"""A pair of guests, the link between them, and the record of what is done to them."""

import pathlib
import subprocess
import tempfile
import time

from guests import AXES, OTHER, PAGE_BYTES, ROOT, SET, Guest, Trouble, emulator, kernel, ticks_per_ms, wait_for
from link import Link

LIMIT = 120  # s, for what takes 10 s on an idle host
LOST, SYNCHRONISED = 3, 1  # STATE_* of time_quality_t


class GuestPair:
    """A run of the test. Its folder has `events` and what the guests record."""

    def __init__(self, folder, build):
        self.folder, self.build = folder, build
        if not (build / "time_guests/bin/clock_agent").exists():
            raise Trouble(f"no time_guests/bin in {build}: build it first, on an x86-64 processor")
        folder.mkdir(parents=True)
        self.vmlinux, modules = kernel.prepare(build / "vm")
        self.initramfs = folder / "initramfs"
        emulator.initramfs(modules, self.initramfs)
        self.ppm = {ROOT: 0, OTHER: 50}  # by which CLOCK_MONOTONIC_RAW of a guest is faster, from its next boot on
        self.boots = {ROOT: 0, OTHER: 0}
        # Socket names must be short.
        self.sockets = tempfile.TemporaryDirectory(prefix="axlecast-link-")
        self.link = Link(pathlib.Path(self.sockets.name), (ROOT, OTHER))
        self.events = open(folder / "events", "w", buffering=1)
        with open(folder / "host.page", "wb") as file:
            file.truncate(PAGE_BYTES)
        # However this process ends, the agent does too.
        self.host = subprocess.Popen(["setpriv", "--pdeathsig", "KILL", build / "time_guests/bin/clock_agent", folder / "host.page"])
        self.ticks_per_ms = ticks_per_ms(folder / "host.page")

    def event(self, kind, text=""):
        self.events.write(f"{time.monotonic_ns()} {kind} {text}".rstrip() + "\n")

    def phase(self, text):
        print(f"  {text}", flush=True)
        self.event("phase", text)

    # -- guests

    def kernel_options(self, name):
        """Sets the rate of CLOCK_MONOTONIC_RAW: the kernel keeps this rate because its own measurement differs by more than 1 %."""
        return f" tsc_early_khz={round(0.97 * self.ticks_per_ms / (1 + self.ppm[name] * 1e-6))}"

    def make(self, name):
        self.boots[name] += 1
        return Guest(name, self.boots[name], self)

    def start(self):
        begin = time.monotonic()
        self.a, self.b = self.make(ROOT), self.make(OTHER)
        for guest in (self.a, self.b):
            guest.wait_ready()
        print(f"  two guests are up after {time.monotonic() - begin:.1f} s", flush=True)
        for guest in (self.a, self.b):
            guest.pin()
        self.phase("start")
        for guest in (self.a, self.b):
            guest.start_time()
        self.synchronised(0)

    def end(self):
        for guest in (self.a, self.b):
            guest.pin()
        for guest in (self.a, self.b):
            guest.end()
        self.host.kill()
        self.host.wait()
        self.events.close()

    # -- causes, and waiting for their effects

    def states(self, mark=0):
        return self.b.states()[mark:]

    def mark(self):
        return len(self.b.states())

    def wait_state(self, state, mark):
        """The first change to this state after the mark."""
        return wait_for(lambda: next((each for each in self.states(mark) if each["state"] == state), None),
                        f"state {state} of {OTHER}; states since: {[(e['state'], e['reason']) for e in self.states(mark)]}", LIMIT)

    def synchronised(self, mark):
        return self.wait_state(SYNCHRONISED, mark)

    def lost(self, mark):
        return self.wait_state(LOST, mark)

    def measure(self, count):
        """Waits for this many messages of the guest that is not the root; ten arrive in a second."""
        goal = self.b.messages() + count
        wait_for(lambda: self.b.messages() >= goal, f"{count} messages of {OTHER}: {self.b.messages()} of {goal}", LIMIT + count)

    def measure_sets(self, count):
        """Waits until this many sets of axes of both guests were published after each axis had sent its first position."""
        axes = [axis for axes in AXES.values() for axis in axes]
        wait_for(lambda: all(self.a.arrived(f"POSITION/{axis}") for axis in axes), f"positions of {axes}", LIMIT)
        self.look_at_shafts()
        sets = lambda: self.a.arrived(f"POSITION_SET/{SET}")
        goal = sets() + count
        wait_for(lambda: sets() >= goal, f"{count} sets after {goal - count}", LIMIT + count)
        self.look_at_shafts()

    def look_at_shafts(self):
        for guest in (self.a, self.b):
            guest.look_at_shafts()

    def withdrawn(self, cause, end_of_cause, least=10):
        """The claim ends by the cause, stays away while it lasts, and comes back: the states (lost, back)."""
        mark = self.mark()
        cause()
        self.event("withdraw")
        lost = self.lost(mark)
        self.measure(least)
        since = self.states(mark)
        if any(each["state"] == SYNCHRONISED for each in since[since.index(lost):]):
            raise Trouble(f"a claim came back although its cause had not ended: {since}")
        self.event("resume")
        mark = self.mark()
        end_of_cause()
        return lost, self.synchronised(mark)
