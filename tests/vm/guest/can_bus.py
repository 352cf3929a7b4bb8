"""CAN interfaces and can-utils as an operator has them: `ip link`, candump, cansend, cangen."""

import json
import os
import re
import socket
import subprocess
import tempfile
import typing

from machine import wait_for


class Line(typing.NamedTuple):
    """One line of `candump -L`: the kernel's time in seconds, the identifier and the data as candump writes them."""
    time: float
    id: str
    data: str


def is_error(line):
    """An error frame: candump shows the controller's report with the flag CAN_ERR_FLAG."""
    return len(line.id) == 8 and int(line.id, 16) & socket.CAN_ERR_FLAG != 0


def details(interface):
    """What `ip -details link show` prints of its controller: state, bittiming and so on."""
    done = subprocess.run(["ip", "-details", "-json", "link", "show", interface], check=True, capture_output=True,
                          text=True)
    return json.loads(done.stdout)[0]["linkinfo"]["info_data"]


def ip_link(*lines):
    """`ip link set` with each of these, in one process; its complaint when one fails."""
    batch = "".join(f"link set {line}\n" for line in lines)
    done = subprocess.run(["ip", "-batch", "-"], input=batch, capture_output=True, text=True, check=False)
    return done.stderr.strip()


def up(interface, bitrate=250000, options=""):
    """Sets it up again, as a new controller."""
    error = ip_link(f"{interface} down", f"{interface} up type can bitrate {bitrate} {options}")
    if error:
        raise AssertionError(f"{interface}: {error}")


def down(interface):
    error = ip_link(f"{interface} down")
    if error:
        raise AssertionError(f"{interface}: {error}")


def cansend(interface, *frames):
    for frame in frames:
        subprocess.run(["cansend", interface, frame], check=True)


def cangen(interface, *words):
    return subprocess.Popen(["cangen", interface, *map(str, words)])


class Candump:
    """candump in the background; with="error" frames too when `errors` is set."""

    def __init__(self, interface, errors=False, test=None):
        log, name = tempfile.mkstemp()
        self.log = open(name, encoding="ascii")
        self.begun, self.read = "", []
        filters = ",0:0,#FFFFFFFF" if errors else ""
        # -r: 8 MiB, room for 20,000 frames (some 800 bytes each in the kernel): at full load it may sleep for long.
        # -D: continues after the interface was down.
        self.process = subprocess.Popen(["candump", "-L", "-D", "-r", "8388608", f"{interface}{filters}"], stdout=log)
        os.close(log)
        os.unlink(name)
        wait_for(self._listens, f"candump on {interface}")
        if test:
            test.addCleanup(self.close)

    def _listens(self):
        with open(f"/proc/{self.process.pid}/wchan", encoding="ascii") as wchan:
            return re.search("recv|select|poll", wchan.read())

    def errors(self):
        """The error frames so far."""
        return [line for line in self._all() if is_error(line)]

    def lines(self, identifier=""):
        """The frames so far, of this identifier or of all."""
        return [line for line in self._all() if not is_error(line) and identifier in ("", line.id)]

    def _all(self):
        while (line := self.log.readline()).endswith("\n"):
            if match := re.match(r"\((\d+\.\d+)\) \S+ ([0-9A-F]+)#(\S*)\n", self.begun + line):
                self.read.append(Line(float(match[1]), match[2], match[3]))
            self.begun = ""
        self.begun += line  # of a line that is still being written
        return self.read

    def wait(self, count, identifier=""):
        return wait_for(lambda: (lambda found: found if len(found) >= count else None)(self.lines(identifier)),
                        lambda: f"{count} frames {identifier}, so far {self.lines(identifier)[-5:]}")

    def close(self):
        if self.process.poll() is None:
            self.process.terminate()
            self.process.wait()
        self.log.close()
