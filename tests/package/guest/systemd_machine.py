"""A machine of the package on a Debian that runs, commissioned as docs/install.md describes. Nothing but systemd starts a process
of ours here, within the sandboxes of the units."""

import json
import pathlib
import subprocess

from machine import wait_for

PACKAGE = next(pathlib.Path("/packages").glob("axlecast_*.deb"))
LIMIT = 400  # s: systemd takes half a minute to start one unit on an emulated machine of a busy host
CONFIG = pathlib.Path("/etc/axlecast/machine.yaml")
DRIVERS = ["axlecast-driver@line.service", "axlecast-driver@motors.service"]
SERVICES = ["axlecast-bridge.service", *DRIVERS, "axlecast-record.service", "axlecast-simulate.service"]
MACHINE = """\
machine: press3
lcm:
  url: "udpm://239.255.76.67:7667?ttl=0"
  command_url: "udpm://239.255.76.67:7668?ttl=0"
{bridge}
  journal: /var/lib/axlecast/press3/journal.db
recorder:
  directory: /var/log/axlecast
  logs: {{all: {{quota: 100MB}}}}
buses:
  line:
    family: tformat
    simulate: true
    poll_hz: 20
    realtime: {{priority: 50, lock_memory: true}}
    devices:
      axis: {{model: ts5669n127, timeout_us: 500000, permit: not_required, eeprom_writable: [5]}}
  motors:
    family: tsubaki_sc
    simulate: true
    poll_hz: 1
    devices:
      motor: {{address: 1, timeout_us: 2000000}}
"""
# Emulated, a loop may well stand still for as long as the units allow.
PATIENCE = "[Service]\nWatchdogSec=20\nTimeoutStartSec=200\nTimeoutStopSec=60\n"


def run(*command, code=0):
    result = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT)
    if code is not None and result.returncode != code:
        raise AssertionError(f"{command}: exit code {result.returncode}\n{result.stdout}\n{result.stderr}")
    return result.stdout


def show(unit, name):
    return run("systemctl", "show", "--property", name, "--value", unit).strip()


def active(unit):
    return show(unit, "ActiveState")


def pid(unit):
    return int(show(unit, "MainPID"))


def journal(*units):
    return run("journalctl", "--no-pager", "--lines", "60", *(f"--unit={unit}" for unit in units))


def online():
    return subprocess.run(["axlecast", "status"], capture_output=True).returncode == 0


def wait_until_online():
    wait_for(online, lambda: run("axlecast", "status", code=None) + journal("axlecast*"), LIMIT)


def wait_for_another(unit, before):
    """The unit's process, once it is not `before` and the machine is whole."""
    wait_for(lambda: active(unit) == "active" and pid(unit) not in (0, before), lambda: journal(unit), LIMIT)
    wait_until_online()
    return pid(unit)


def give_patience():
    for unit in ("axlecast-bridge", "axlecast-driver@", "axlecast-web"):
        folder = pathlib.Path(f"/run/systemd/system/{unit}.service.d")
        folder.mkdir(parents=True)
        (folder / "patience.conf").write_text(PATIENCE)


def commission():
    """Installs the package, creates the machine and starts it: the states of the target and the units before the start."""
    give_patience()
    run("dpkg", "--install", str(PACKAGE))
    began_with = active("axlecast.target"), [active(unit) for unit in SERVICES]
    keys = json.loads(run("axlecast", "keygen", "--machine", "press3", "--json"))
    CONFIG.write_text(MACHINE.format(bridge=keys["yaml"].rstrip()))
    run("axlecast", "check-config")
    run("systemctl", "daemon-reload")
    run("systemctl", "enable", "--now", "axlecast-multicast", "axlecast-web")
    run("systemctl", "restart", "axlecast.target")
    wait_until_online()
    return began_with
