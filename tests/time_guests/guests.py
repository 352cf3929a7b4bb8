"""Two guests in QEMU on one cable, each with clocks of its own, whose relation is known from outside by a shared page."""

import json
import pathlib
import shlex
import socket
import struct
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "vm"))
import emulator  # noqa: E402  of tests/vm
import kernel  # noqa: E402

PAGE_BYTES = 16 << 20  # ClockPage::kBytes of clock_page.h
ANSWER_LIMIT = 180  # s, generous: two guests that boot, or execute a line, on a busy host
ADDRESS = {"a": "10.0.0.1", "b": "10.0.0.2"}
ROOT, OTHER = "a", "b"
URL = "udpm://239.255.76.67:7667?ttl=1"
AXES = {ROOT: ("x", "y"), OTHER: ("v", "w")}  # each on a bus of its own: bus-x
SET = "gantry"
# One count of 17 bits takes 153 ns at this speed, far less than an interval is wide.
MACHINE = f"""machine: guests
lcm: {{url: "{URL}", command_url: "{URL.replace("7667", "7668")}"}}
time: {{root: {ROOT}, address: {ADDRESS[ROOT]}}}
hosts:
  {ROOT}: {{bridge: true, buses: [{", ".join(f"bus-{axis}" for axis in AXES[ROOT])}]}}
  {OTHER}: {{buses: [{", ".join(f"bus-{axis}" for axis in AXES[OTHER])}]}}
sets: {{{SET}: {{axes: [{", ".join(axis for axes in AXES.values() for axis in axes)}], limit_us: 5000}}}}
buses:
""" + "".join(f"  bus-{axis}: {{family: tformat, poll_hz: 20, simulate: {{{axis}: {{speed_rpm: 3000}}}},\n"
              f"    devices: {{{axis}: {{model: ts5669n127, timeout_us: 500000}}}}}}\n" for axes in AXES.values() for axis in axes)


class Trouble(Exception):
    """The test cannot continue; the text names the cause."""


def wait_for(condition, what, limit):
    """Returns the first truthy result of `condition`."""
    deadline = time.monotonic() + limit
    while time.monotonic() < deadline:
        result = condition()
        if result:
            return result
        time.sleep(0.05)
    raise Trouble(f"not within {limit} s: {what}")


# The first program in the guest. It ends in a loop that executes the lines that come from the host by the second serial port. What a line
# prints is in `output`, a file that the host sees at once.
START = """#!/bin/sh
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 TMPDIR=/run/tmp
export AXLECAST_RUN_DIR=/run/axlecast
ip link set lo up
ip link set eth0 up multicast on && ip address add {address}/24 dev eth0 && ip route add 224.0.0.0/4 dev eth0 || exit
for device in /sys/bus/pci/devices/*; do
  [ "$(cat $device/device)" = 0x1110 ] && page=$device
done
echo 1 >$page/enable
{programs}/clock_agent $page/resource2 &
{programs}/time_listener '{url}' /run/vm/messages.log &
exec 3<>/dev/ttyS1
stty -F /dev/ttyS1 raw -echo
echo ready >&3
while read -r line <&3; do
  sh -c "$line" >/run/vm/output 2>&1 </dev/null 3>&-
  echo "done $?" >&3
done
"""


def ticks_per_ms(page):
    """The rate of this host's time stamp counter, from its own page (clock_page.h)."""
    def reading(number):
        before, mono, *_ = struct.unpack_from("<5q", content, 4096 + 40 * number)
        return before, mono

    def enough():
        nonlocal content
        content = page.read_bytes()
        count, = struct.unpack_from("<q", content, 32)
        return count if count >= 50 else 0

    content = b""
    last = wait_for(enough, "readings of this host's clock", 30) - 1
    (tick, mono), (last_tick, last_mono) = reading(0), reading(last)
    return (last_tick - tick) / (last_mono - mono) * 1e6


class Guest:
    """One boot of a guest. Its folder has what the guest wrote, and what `time_guests_check` reads."""

    def __init__(self, name, boot, run):
        self.name, self.run = name, run
        self.folder = run.folder / f"{name}-{boot}"
        self.folder.mkdir()
        self.page = self.folder / "page"
        with open(self.page, "wb") as file:
            file.truncate(PAGE_BYTES)
        (self.folder / "machine.yaml").write_text(MACHINE)
        (self.folder / "start").write_text(START.format(address=ADDRESS[name], url=URL, programs=run.build / "time_guests/bin"))
        # QEMU connects to it: what the guest writes before anybody reads is not lost.
        self.control_path = run.link.folder / f"control-{name}-{boot}"
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(str(self.control_path))
        self.listener.listen()
        self.console = open(self.folder / "console.log", "wb")
        self.process = subprocess.Popen(self.command(), stdin=subprocess.DEVNULL, stdout=self.console, stderr=self.console)
        self.control = None
        self.received = b""

    def command(self):
        mac = f"52:54:00:00:00:0{1 + (self.name == OTHER)}"
        return [str(word) for word in [
            *emulator.qemu(self.run.vmlinux, self.run.initramfs, cpus=1, megabytes=512, kernel_options=self.run.kernel_options(self.name)),
            "-chardev", "stdio,id=console,signal=off", "-serial", "chardev:console",
            "-chardev", f"socket,id=control,path={self.control_path},server=off", "-serial", "chardev:control",
            *emulator.shared_folder("/", "host", readonly=True), *emulator.shared_folder(self.folder, "results"),
            "-object", f"memory-backend-file,id=page,share=on,mem-path={self.page},size={PAGE_BYTES}",
            "-device", "ivshmem-plain,memdev=page",
            "-netdev", f"stream,id=link,server=off,addr.type=unix,addr.path={self.run.link.addresses[self.name]}",
            "-device", f"virtio-net-pci,netdev=link,mac={mac}"]]

    def trouble(self, what):
        tail = (self.folder / "console.log").read_text(errors="replace").splitlines()[-20:]
        return Trouble("\n".join([f"guest {self.name}: {what}", "the last lines of its console:", *tail]))

    def lines(self, limit):
        """The next line from the control port."""
        deadline = time.monotonic() + limit
        while b"\n" not in self.received:
            if self.process.poll() is not None:
                raise self.trouble(f"QEMU ended with exit code {self.process.returncode}")
            if time.monotonic() > deadline:
                raise self.trouble(f"silent for {limit} s")
            try:
                self.received += self.control.recv(4096)
            except TimeoutError:
                pass
        line, _, self.received = self.received.partition(b"\n")
        return line.decode(errors="replace").strip()

    def wait_ready(self):
        self.listener.settimeout(60)
        self.control, _ = self.listener.accept()
        self.control.settimeout(0.2)
        while self.lines(ANSWER_LIMIT) != "ready":
            pass

    def __call__(self, line, check=True):
        """Executes a line of shell in the guest; returns what it printed."""
        self.control.sendall(line.encode() + b"\n")
        while not (answer := self.lines(ANSWER_LIMIT)).startswith("done "):
            pass
        output = (self.folder / "output").read_text(errors="replace")
        if check and answer != "done 0":
            raise self.trouble(f"{line}: {answer}: {output}")
        return output

    def start_program(self, program, *words, output="/dev/null"):
        """Starts a program of the build in the background; returns its process number in the guest."""
        command = " ".join(shlex.quote(str(word)) for word in [self.run.build / "bin" / program, *words])
        return int(self(f"{command} >>{output} 2>>/run/vm/service.log & echo $!"))

    def start_time(self):
        words = ["time", "/run/vm/machine.yaml", "--host", self.name, "--json"]
        self.service = self.start_program("axlecast", *words, output="/run/vm/states.json")

    def kill_time(self):
        self(f"kill -9 {self.service}")

    def states(self):
        """The changes of state that `axlecast time --json` printed so far."""
        path = self.folder / "states.json"
        text = path.read_text() if path.exists() else ""
        return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]

    def arrived(self, channel):
        """How many messages of this channel it has received."""
        path = self.folder / "messages.log"
        return path.read_bytes().count(channel.encode()) if path.exists() else 0

    def messages(self):
        """How many TIME messages of its own it has received."""
        return self.arrived(f"TIME/{self.name}")

    # -- simulated axes

    def start_axes(self):
        """Its simulated encoders and their drivers; returns their process numbers."""
        if (self.folder / "shafts").exists():
            raise Trouble("the case tick runs once in a boot of a guest: its shafts begin again otherwise")
        started = [self.start_program("axlecast", "simulate", "/run/vm/machine.yaml", "--host", self.name)]
        for axis in AXES[self.name]:
            started.append(self.start_program("axlecast-tformat", "--config", "/run/vm/machine.yaml", "--bus", f"bus-{axis}"))
        return started

    def look_at_shafts(self):
        """Appends where the simulated shafts are, for time_guests/bin/ticks_check."""
        words = [self.run.build / "bin/axlecast", "simulate", "/run/vm/machine.yaml", "--host", self.name, "--show", "--json"]
        answers = self(" ".join(shlex.quote(str(word)) for word in words)).splitlines()
        with open(self.folder / "shafts", "a") as file:
            for answer in map(json.loads, answers):
                for device, state in answer["devices"].items():
                    file.write(f"{device} {answer['mono_ns']} {state['angle_deg']} {state['speed_rpm']}\n")

    def pin(self):
        """Bounds what its counter is ahead of the host's."""
        done = subprocess.run([self.run.build / "time_guests/bin/clock_oracle", self.page, "20"], capture_output=True, text=True)
        if done.returncode != 0:
            raise self.trouble(done.stderr.strip())
        with open(self.folder / "pins", "a") as file:
            file.write(done.stdout)
        print(f"  counter of {self.name}: {done.stderr.strip()}", flush=True)

    def end(self):
        self.process.kill()
        self.process.wait()
        for file in (self.console, self.listener, self.control):
            if file:
                file.close()
