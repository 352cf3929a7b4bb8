"""A machine under test: real processes on real ptys and real LCM, in this process's network namespace.

Tests look at it as a user would: through the CLI's JSON. They wait for conditions, never for time to pass."""

import json
import os
import pathlib
import signal
import socket
import subprocess
import tempfile
import threading
import time
import unittest

BIN = pathlib.Path(os.environ["AXLECAST_BIN"])
LIMIT = float(os.environ.get("AXLECAST_LIMIT", 60))  # s, generous: a slow, shared machine must pass


def wait_for(condition, what, limit=LIMIT):
    """The first truthy result of `condition`; fails the test with `what` when the limit has passed."""
    deadline = time.monotonic() + limit
    while time.monotonic() < deadline:
        result = condition()
        if result:
            return result
        time.sleep(0.02)
    raise AssertionError(f"not within {limit} s: {what() if callable(what) else what}")


def wrong_unix_time(seconds):
    """Environment of a process whose UNIX time is this far off, and whose CLOCK_MONOTONIC is right."""
    library = next(pathlib.Path("/usr/lib").glob("*/faketime/libfaketime.so.1"))
    return {"LD_PRELOAD": str(library), "FAKETIME": f"{seconds:+d}s", "FAKETIME_DONT_FAKE_MONOTONIC": "1"}


def boot_id():
    return pathlib.Path("/proc/sys/kernel/random/boot_id").read_text().strip().replace("-", "")


def clock_id():
    """Of this process's CLOCK_MONOTONIC: the hash of docs/machines.md, of the host's boot and the time namespace."""
    value = 0xCBF29CE484222325
    for byte in (boot_id() + os.readlink("/proc/self/ns/time")).encode():
        value = (value ^ byte) * 0x100000001B3 % 2**64
    return value


def unsigned(number):
    """64 bits, whether JSON has them as a number or in hexadecimal."""
    return int(number, 16) if isinstance(number, str) else number % 2**64


class Watch:
    """`axlecast watch --json` in the background; every message of it in `messages`, in order."""

    def __init__(self, config, *options):
        self.messages = []
        self.lock = threading.Lock()
        self.process = subprocess.Popen([BIN / "axlecast", "watch", config, "--json", *options],
                                        stdout=subprocess.PIPE, text=True)
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            if not line.endswith("\n"):
                return  # it was killed
            with self.lock:
                self.messages.append(json.loads(line))

    def of(self, channel, since=0):
        with self.lock:
            return [m for m in self.messages[since:] if m["channel"] == channel]

    def last(self, channel):
        with self.lock:
            return next((m for m in reversed(self.messages) if m["channel"] == channel), None)

    def mark(self):
        """A position in the stream: of(channel, since=mark) gives what came later."""
        with self.lock:
            return len(self.messages)

    def since(self, mark):
        with self.lock:
            return self.messages[mark:]

    def close(self):
        self.process.kill()
        self.process.wait()
        self.reader.join()
        self.process.stdout.close()


class Machine(unittest.TestCase):
    """Base of the end-to-end tests: a folder of its own, processes that end with the test."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="axlecast-e2e-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.run_dir = self.folder / "run"
        os.environ["AXLECAST_RUN_DIR"] = str(self.run_dir)
        os.environ["XDG_STATE_HOME"] = str(self.folder / "state")
        self.processes = []

    def tearDown(self):
        for process in reversed(self.processes):
            if process.poll() is None:
                process.terminate()
        for process in reversed(self.processes):
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            if process.stdout:
                process.stdout.close()
        if os.environ.get("AXLECAST_LOGS"):
            for log in sorted(self.folder.glob("*.log")):
                print(f"---- {log.name}\n{log.read_text(errors='replace')[-3000:]}")

    # -- the machine's file

    def write(self, text, name="machine.yaml"):
        path = self.folder / name
        path.write_text(text)
        return path

    # -- processes

    def start(self, name, *command, env=None, **options):
        """A background process; its output goes to <name>.log."""
        log = open(self.folder / f"{name}.log", "ab")
        self.addCleanup(log.close)
        process = subprocess.Popen([str(word) for word in command], stdout=log, stderr=log,
                                   env={**os.environ, **(env or {})}, **options)
        self.processes.append(process)
        return process

    def log(self, name):
        path = self.folder / f"{name}.log"
        return path.read_text(errors="replace") if path.exists() else ""

    def simulator(self, config, bus):
        process = self.start(f"simulator-{bus}", BIN / "axlecast", "simulate", config, "--bus", bus)
        ports = lambda: [port for kind in ("pty", "can", "spi") for port in self.run_dir.glob(f"**/{bus}.{kind}")]
        wait_for(ports, f"the simulated port of {bus}")
        return process

    def driver(self, config, bus, family="tformat", name=None, env=None):
        return self.start(name or f"driver-{bus}", BIN / f"axlecast-{family}", "--config", config, "--bus", bus, env=env)

    def bridge(self, config, name="bridge", env=None):
        return self.start(name, BIN / "axlecast-bridge", "--config", config, env=env)

    def watch(self, config, *options):
        watch = Watch(config, *options)
        self.addCleanup(watch.close)
        return watch

    def kill(self, process):
        process.send_signal(signal.SIGKILL)
        process.wait()

    def stand_still(self, process):
        """Stops it; returns when it does."""
        process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED)

    # -- the CLI

    def axlecast(self, *arguments, limit=LIMIT):
        """Runs the CLI to its end: (exit code, standard output, standard error)."""
        done = subprocess.run([BIN / "axlecast", *map(str, arguments)], capture_output=True, text=True, timeout=limit,
                              stdin=subprocess.DEVNULL)
        return done.returncode, done.stdout, done.stderr

    def outcome(self, *words):
        """Exit code and outcome of a command's words. Given again while a busy machine has too few readings of the
        device: it then counts as offline, or is not seen to rest, and nothing was done."""
        def once():
            code, out, err = self.axlecast(*words, "--config", self.config, "--json")
            self.assertTrue(out, err)
            outcome = json.loads(out)
            starved = outcome.get("reason") == "device_offline" or "too few fresh" in outcome.get("text", "")
            return None if starved else (code, outcome)
        return wait_for(once, f"{words}: readings enough of the device")

    def set_simulated(self, config, bus, device="axis1", **quantities):
        """Changes quantities of a device while it runs: speed_rpm=300."""
        for key, value in quantities.items():
            code, out, err = self.axlecast("simulate", config, "--bus", bus, "--set", f"{device}.{key}={value}")
            self.assertEqual(code, 0, out + err)

    def ask_simulator(self, bus, question):
        """A simulator's answer without the CLI's start-up: for what must happen within some 100 ms."""
        path = next(self.run_dir.glob(f"**/{bus}.ctl"))
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
            link.connect(str(path))
            link.send(json.dumps(question).encode())
            return json.loads(link.recv(65536))

    def simulated(self, config, bus):
        code, out, err = self.axlecast("simulate", config, "--bus", bus, "--show", "--json")
        self.assertEqual(code, 0, err)
        return json.loads(out)

    # -- waiting

    def wait_online(self, watch, device="axis1"):
        wait_for(lambda: (watch.last(f"DEVICE/{device}") or {}).get("state") == 1, f"{device} online")

    def wait_state(self, watch, state, device="axis1"):
        return wait_for(lambda: (lambda m: m if m and m["state"] == state else None)(watch.last(f"DEVICE/{device}")),
                        lambda: f"{device} in state {state}, last {watch.last(f'DEVICE/{device}')}")

    def alarms(self, watch, device="axis1"):
        """Names of the alarms that are there now."""
        message = watch.last(f"ALARM/{device}")
        return {entry["name"]: entry for entry in message["entries"]} if message else {}


def one_axis(simulate="{speed_rpm: 0}", device="", bus="", bridge="bridge: {unsigned_commands: allow}", poll_hz=1000):
    """A machine of one simulated T-format axis."""
    return f"""machine: test
{bridge}
buses:
  rs485-0:
    family: tformat
    poll_hz: {poll_hz}
    {bus}
    simulate:
      axis1: {simulate}
    devices:
      axis1: {{model: ts5669n127, unit: deg, publish_hz: 200, permit: not_required, timeout_us: 500000{', ' + device if device else ''}}}
"""
