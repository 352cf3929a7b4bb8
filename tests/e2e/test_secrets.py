"""A unit's password is to be found in its own file and nowhere else: in no message, WIRE included, no log or file of a
process, no command line or environment, no core file and not in the driver's memory when it is not needed. Secret keys
likewise, but that a process keeps its own in memory."""

import base64
import json
import os
import pathlib
import resource
import select
import signal
import socket
import subprocess
import threading
import unittest

import lcm_log
from machine import BIN, Machine, wait_for
from signed_machine import SignedMachine

DONE, REJECTED, FAILED = 0, 3, 4
GROUP, PORTS = "239.255.76.67", (7667, 7668)
FLAG_REDACTED = 1  # lcmtypes/wire_record_t.lcm
PASSWORD, OTHER, WRONG = "Zq7#kV2!xW9m", "Jt4%bN8&rL1~pD6^", "Hg5(cY3)vM"
WINDOW = 6  # characters: a part of a password counts as well


def appearances(secret):
    """Every way in which a part of it could appear somewhere."""
    found = set()
    for begin in range(len(secret) - WINDOW + 1):
        part = secret[begin:begin + WINDOW].encode()
        swapped = b"".join(part[i + 1:i + 2] + part[i:i + 1] for i in range(0, WINDOW, 2))
        for raw in (part, swapped):
            found |= {raw, raw.decode().encode("utf-16-le"), raw.decode().encode("utf-16-be")}
            for separator in ("", " ", ":", ", ", "-"):
                digits = raw.hex(separator) if len(separator) == 1 else separator.join(f"{b:02x}" for b in raw)
                found |= {digits.encode(), digits.upper().encode()}
            found.add(", ".join(str(byte) for byte in raw).encode())
        found.add(json.dumps(part.decode())[1:-1].encode())
    return found


FORBIDDEN = sorted(set().union(*(appearances(secret) for secret in (PASSWORD, OTHER, WRONG))))


def forbidden_in(data, texts=FORBIDDEN):
    """What of it appears in `data`. Not one regular expression: Python's take a second for each megabyte."""
    return [text for text in texts if text in data]


def parts_of_key(seed):
    """Every way in which a part of a secret key could appear somewhere."""
    found = set()
    for begin in range(len(seed) - WINDOW + 1):
        part = seed[begin:begin + WINDOW]
        found |= {part, part[::-1], ", ".join(str(byte) for byte in part).encode()}
        for separator in ("", " ", ":", ", ", "-"):
            digits = separator.join(f"{byte:02x}" for byte in part)
            found |= {digits.encode(), digits.upper().encode()}
    # Each third byte begins a group of four characters.
    for begin in range(3):
        text = base64.b64encode(seed[begin:])
        found |= {text[i:i + 8] for i in range(0, len(text) - 8, 4)}
    return found


def permit_core_files():
    """As far as the system lets us."""
    most = resource.getrlimit(resource.RLIMIT_CORE)[1]
    resource.setrlimit(resource.RLIMIT_CORE, (most, most))


class Datagrams:
    """Every datagram of both LCM ports, as it is: nothing decoded, nothing left out."""

    def __init__(self):
        self.data = []
        self._stop, self._stopper = os.pipe()
        self._sockets = []
        for port in PORTS:
            listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind((GROUP, port))
            listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                                socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1"))
            self._sockets.append(listener)
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self):
        while True:
            ready, _, _ = select.select([*self._sockets, self._stop], [], [])
            if self._stop in ready:
                return
            self.data += [listener.recv(65536) for listener in ready]

    def close(self):
        os.write(self._stopper, b"x")
        self._thread.join()
        for listener in self._sockets:
            listener.close()


class Processes:
    """Command lines and environments of all processes, again and again."""

    def __init__(self, texts=FORBIDDEN):
        self.texts = texts
        self.found = []
        self.looks = 0
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)
        self._thread.start()

    def _look(self):
        while not self._stopped.wait(0.02):
            for place in [*pathlib.Path("/proc").glob("[0-9]*/cmdline"), *pathlib.Path("/proc").glob("[0-9]*/environ")]:
                try:
                    if forbidden_in(place.read_bytes(), self.texts):
                        self.found.append(str(place))
                except OSError:
                    continue  # it ended
            self.looks += 1

    def close(self):
        self._stopped.set()
        self._thread.join()


class Secrets(Machine):
    FILE = """machine: test
bridge: {unsigned_commands: allow}
buses:
  rs485-0:
    family: tsubaki_sc
    pacing: per_unit
    capture: true
    simulate:
      timing: {reading: W, pace: unpaced}%s
    devices:
      gm1: {address: 1, passwords: {%s}, password: usual, motor_control: start_stop, permit: not_required}
"""

    def run_machine(self):
        places = []
        for name, secret in (("usual", PASSWORD), ("next", OTHER), ("bad", WRONG)):
            path = self.folder / "etc" / name
            path.parent.mkdir(exist_ok=True)
            path.touch(mode=0o600)
            path.write_text(secret + "\n")
            places.append(f"{name}: {{file: {path}}}")
        places = ", ".join(places)
        # Only the simulator, which is the unit, receives the password.
        simulated = self.write(self.FILE % (f'\n      gm1: {{password: "{PASSWORD}"}}', places), "etc/unit.yaml")
        self.config = self.write(self.FILE % ("", places))
        self.assertTrue(forbidden_in(simulated.read_bytes()), "the search finds what is there")
        self.datagrams = Datagrams()
        self.addCleanup(self.datagrams.close)
        for name, port in zip(("data", "command"), PORTS):
            self.start(f"lcm-logger-{name}", "lcm-logger", "-q", f"--lcm-url=udpm://{GROUP}:{port}?ttl=0",
                       self.folder / f"{name}.lcmlog")
        self.processes_seen = Processes()
        self.addCleanup(self.processes_seen.close)
        self.data = self.watch(self.config)
        self.simulator(simulated, "rs485-0")
        self.running_driver = self.start("driver", BIN / "axlecast-tsubaki-sc", "--config", self.config, "--bus",
                                         "rs485-0", "--verbose", cwd=self.folder,
                                         preexec_fn=permit_core_files)
        self.bridge(self.config)
        self.wait_online(self.data, "gm1")

    def do(self, *words):
        code, outcome = self.outcome("do", "gm1", *words, "--yes")
        self.assertEqual(forbidden_in(json.dumps(outcome).encode()), [], "the CLI's own words")
        return code, outcome

    def unit(self):
        code, out, err = self.axlecast("simulate", self.config, "--bus", "rs485-0", "--show", "--json")
        self.assertEqual(code, 0, err)
        self.assertEqual(forbidden_in(out.encode()), [])
        return json.loads(out)["devices"]["gm1"]

    def use_passwords(self):
        """Login, wrong password, change of password, login with the new one."""
        wait_for(lambda: self.unit()["logins"] == 1, "a login")
        code, outcome = self.do("write_parameter", "name=log_interval", "value=0.7")
        self.assertEqual(code, DONE, outcome)
        code, outcome = self.do("check_password", "name=bad")
        self.assertEqual(code, DONE, outcome)
        code, outcome = self.do("set_password", "name=next")
        self.assertEqual((code, outcome["verified"]), (DONE, 1), outcome)
        self.assertEqual(self.do("check_password", "name=next")[0], DONE)
        # A password as an argument is refused, and not repeated.
        self.assertNotEqual(self.do("set_password", "name=" + "never")[0], DONE)
        # The unit loses its login; its file now holds a wrong password.
        (self.folder / "etc/next").write_text(WRONG + "\n")
        self.set_simulated(self.config, "rs485-0", "gm1", power="off")
        self.wait_state(self.data, 3, "gm1")
        self.set_simulated(self.config, "rs485-0", "gm1", power="on")
        wait_for(lambda: "wrong_password" in self.alarms(self.data, "gm1"), "the alarm")
        (self.folder / "etc/next").write_text(OTHER + "\n")
        code, outcome = self.do("log_in")
        self.assertEqual(code, DONE, outcome)
        unit = self.unit()
        self.assertEqual((unit["logins"], unit["wrong_passwords"], unit["password_changes"]), (2, 1, 1))

    def redacted_records(self):
        types = lcm_log.generated_types()
        count = 0
        for channel, data in lcm_log.events(self.folder / "data.lcmlog"):
            if channel == "WIRE/rs485-0":
                count += sum(1 for r in types.wire_t.decode(data).records if r.flags & FLAG_REDACTED)
        return count

    def files_with_a_password(self):
        return [str(path) for path in self.folder.rglob("*")
                if path.is_file() and path.parent.name != "etc" and forbidden_in(path.read_bytes())]

    def test_the_password_is_in_no_message_file_or_command_line(self):
        self.run_machine()
        self.use_passwords()
        self.assertEqual([d for d in self.datagrams.data if forbidden_in(d)], [])
        self.assertGreater(len(self.datagrams.data), 100)
        wait_for(lambda: self.processes_seen.looks > 100, "a hundred looks at all processes")
        self.assertEqual(self.processes_seen.found, [])
        for process in reversed(self.processes):
            process.terminate()
            process.wait(20)
        # Two logins, a refused one, a change; readings of the password: all of them are in the recording, masked.
        self.assertGreaterEqual(self.redacted_records(), 8)
        self.assertEqual(self.files_with_a_password(), [])

    def test_the_driver_leaves_no_core_and_keeps_no_password(self):
        self.run_machine()
        self.use_passwords()
        pid = self.running_driver.pid
        limits = pathlib.Path(f"/proc/{pid}/limits").read_text()
        self.assertRegex(limits, r"Max core file size\s+0\s+0\s")
        self.assertEqual(self.memory_with_a_password(pid), [])
        self.running_driver.send_signal(signal.SIGABRT)
        _, status = os.waitpid(pid, 0)
        self.running_driver.returncode = -signal.SIGABRT
        self.assertEqual(os.WTERMSIG(status), signal.SIGABRT)
        self.assertFalse(os.WCOREDUMP(status))
        self.assertEqual([path for path in self.folder.rglob("core*") if path.is_file()], [])
        self.assertEqual(self.files_with_a_password(), [])
        self.control_of_the_test()

    def control_of_the_test(self):
        """A process that forbids nothing does leave a core here, unless the system permits none to anybody."""
        child = subprocess.Popen(["sleep", "60"], cwd=self.folder, preexec_fn=permit_core_files)
        child.send_signal(signal.SIGABRT)
        _, status = os.waitpid(child.pid, 0)
        child.returncode = -signal.SIGABRT
        if not os.WCOREDUMP(status):
            print("this system writes no core files: only the limits were checked")

    @staticmethod
    def memory_with_a_password(pid):
        """Regions of its memory that hold one: it is read from its file when needed and wiped after use."""
        found = []
        with open(f"/proc/{pid}/mem", "rb", buffering=0) as memory:
            for line in pathlib.Path(f"/proc/{pid}/maps").read_text().splitlines():
                span, rights, *_ = line.split()
                if "w" not in rights:
                    continue
                begin, end = (int(word, 16) for word in span.split("-"))
                memory.seek(begin)
                try:
                    data = memory.read(end - begin)
                except OSError:
                    continue
                found += [f"{line.split()[-1]}: {text!r} at {begin + data.find(text):x}" for text in forbidden_in(data)]
        return found


class Keys(SignedMachine):
    def test_a_secret_key_is_in_no_message_file_or_command_line(self):
        (self.folder / "etc").mkdir()
        datagrams = Datagrams()
        self.addCleanup(datagrams.close)
        self.run_signed_axis()
        files = sorted(self.keys.glob("*.key"))
        self.assertEqual([path.stem for path in files], ["bridge", "drivers", "local", "plc"])
        texts = sorted(set().union(*(parts_of_key(self.seed(path)) for path in files)))
        self.assertTrue(all(forbidden_in(path.read_bytes(), texts) for path in files), "the search finds what is there")
        processes = Processes(texts)
        self.addCleanup(processes.close)
        said = self.use_keys()
        self.assertEqual(forbidden_in(said.encode(), texts), [], "the CLI's own words")
        self.assertEqual([d for d in datagrams.data if forbidden_in(d, texts)], [])
        self.assertGreater(len(datagrams.data), 100)
        self.assertEqual(processes.found, [])
        self.assertGreater(processes.looks, 10)
        for process in reversed(self.processes):
            process.terminate()
            process.wait(20)
        self.assertTrue(list(self.folder.rglob("journal.db")), "the journal is among the files")
        found = [str(path) for path in self.folder.rglob("*")
                 if path.is_file() and path.parent != self.keys and forbidden_in(path.read_bytes(), texts)]
        self.assertEqual(found, [])

    @staticmethod
    def seed(path):
        word, digits = path.read_text().split()
        assert word == "axlecast-key-1"
        return bytes.fromhex(digits)

    def use_keys(self):
        """Commands, permits, a refused key, what can be asked of the keys; all output of the CLI."""
        said = ""
        permits = self.start_permits("zero_single_turn")
        for words in (("zero", "axis1", "--yes"), ("eeprom", "write", "axis1", "10", "A1", "--yes")):
            code, outcome = self.permitted(*words)
            self.assertEqual(code, DONE, outcome)
            said += json.dumps(outcome)
        permits.terminate()
        permits.wait(20)
        code, out, err = self.axlecast("zero", "axis1", "--yes", "--key", self.keys / "plc.key", "--config", self.config,
                                       "--json")
        self.assertEqual(json.loads(out)["reason"], "denied", err)
        said += out + err
        for words in (("check-config", self.config), ("keygen", "--show", "--machine", "test", "--directory", self.keys),
                      ("history", "--limit", "0", "--config", self.config), ("status", self.config)):
            for options in ((), ("--json",)):
                code, out, err = self.axlecast(*words, *options)
                self.assertEqual(code, 0, out + err)
                said += out + err
        self.keys.joinpath("local.key").chmod(0o644)  # one that others can read is refused
        code, out, err = self.axlecast("zero", "axis1", "--yes", "--key", self.keys / "local.key", "--config", self.config)
        self.assertNotEqual(code, DONE)
        return said + out + err


if __name__ == "__main__":
    unittest.main(verbosity=2)
