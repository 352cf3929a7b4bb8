"""What happens to the machine of a soak: each fault begins, lasts, and ends."""

import math
import os
import signal
import subprocess
import time


class FullDisk:
    """A file system of its own, which can be filled."""

    def __init__(self, folder, size):
        folder.mkdir(parents=True)
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], check=True)
        self.folder = folder
        self.ballast = folder / "ballast"

    def fill(self):
        free = os.statvfs(self.folder)
        with open(self.ballast, "wb") as file:
            try:
                os.posix_fallocate(file.fileno(), 0, max(1, free.f_bavail * free.f_frsize))
            except OSError:
                while True:
                    try:
                        os.write(file.fileno(), bytes(4096))
                    except OSError:
                        return

    def free(self):
        self.ballast.unlink(missing_ok=True)

    def unmount(self):
        subprocess.run(["umount", "--lazy", self.folder], check=False)


class Network:
    """The loopback interface of this namespace, with the route of multicast."""

    def __init__(self):
        self.worked_until = math.inf  # monotonic s; since then, it is down, or was down a moment ago

    def down(self):
        self.worked_until = time.monotonic()
        subprocess.run(["ip", "link", "set", "lo", "down"], check=True)

    def up(self):
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
        subprocess.run(["ip", "route", "replace", "224.0.0.0/4", "dev", "lo"], check=True)


class Faults:
    """Draws faults by a seed. A fault is its name, what begins it, what ends it, and how long it lasts in s."""

    def __init__(self, soak, chance):
        self.soak, self.chance = soak, chance
        self.counts = {}

    def draw(self):
        kind, least, most = self.chance.choice([
            (self.kill, 0.1, 3), (self.kill, 0.1, 3), (self.freeze, 0.1, 4), (self.unplug, 0.2, 5), (self.silence, 0.2, 5),
            (self.noise, 1, 5), (self.full_disk, 1, 6), (self.clock_step, 0, 0), (self.interface, 0.1, 2)])
        name, begin, end = kind()
        lasts = self.chance.uniform(least, most)
        self.counts[kind.__name__] = self.counts.get(kind.__name__, 0) + 1
        return name, begin, end, lasts

    def kill(self):
        part = self.chance.choice(list(self.soak.parts.values()))
        def begin():
            if part.runs() and not part.frozen:
                part.kill()
        def end():
            if not part.runs():
                part.start()
        return f"kill {part.name}", begin, end

    def freeze(self):
        part = self.chance.choice(list(self.soak.parts.values()))
        def begin():
            if part.runs():
                part.frozen = True
                part.process.send_signal(signal.SIGSTOP)
        def end():
            part.frozen = False
            if part.runs():
                part.process.send_signal(signal.SIGCONT)
        return f"freeze {part.name}", begin, end

    def unplug(self):
        bus = self.chance.choice(self.soak.buses_with_adapter)
        def turn(option):
            self.soak.simulate("--bus", bus, option)
        return f"pull the cable of {bus}", lambda: turn("--unplug"), lambda: turn("--plug")

    def silence(self):
        return self._set("power", "off", "on")

    def noise(self):
        return self._set("fault", "bit_flip:0.05", "none")

    def _set(self, key, during, after):
        device = self.chance.choice(self.soak.encoders)
        def put(value):
            self.soak.simulate("--set", f"{device}.{key}={value}")
        return f"{key} of {device}: {during}", lambda: put(during), lambda: put(after)

    def full_disk(self):
        name, disk = self.chance.choice(list(self.soak.disks.items()))
        return f"full disk of the {name}", disk.fill, disk.free

    def clock_step(self):
        seconds = self.chance.choice([-3600, -1, 1, 3600])
        return f"step UNIX time by {seconds} s", lambda: self.soak.step_clock(seconds), lambda: None

    def interface(self):
        return "interface down", self.soak.network.down, self.soak.network.up
