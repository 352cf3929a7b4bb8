"""`axlecast up` with 1 to 300 axes, each on a simulated bus of its own: what each role of the machine costs, and what is lost.

The figures are CPU time (user and system, from the scheduler), which other work on the machine changes little, unlike latencies. They are
per axis where a role should cost each axis the same: a role whose figure grows with the number of axes does work that grows faster."""

import json
import os
import pathlib
import re
import subprocess
import time

import machine  # tests/e2e
from process_cost import cpu_seconds, resident_mb

AXES = (1, 10, 40, 100, 300)
ROLES = ("driver", "simulator", "bridge", "recorder", "web", "up")
START = 180  # s, until every axis is online on a busy machine
CONFIG = """machine: axes
defaults:
  tformat:
    poll_hz: {hz}
    devices: {{model: ts5669n127, unit: deg, publish_hz: {hz}, limits: {{speed_rpm: 3000}}}}
buses:
  "line{{001..{axes:03}}}": {{family: tformat, simulate: {{"axis{{}}": {{speed_rpm: 60}}}}, devices: {{"axis{{}}": {{}}}}}}
bridge: {{unsigned_commands: allow}}
recorder: {{directory: {folder}, logs: {{all: {{quota: 4GB}}}}}}
"""


def role_of(words):
    """The role of a process by its command line; None: none of ours."""
    name = pathlib.Path(words[0]).name
    if name == "axlecast":
        return {"simulate": "simulator", "record": "recorder", "web": "web", "up": "up"}.get(words[1])
    return {"axlecast-bridge": "bridge"}.get(name, "driver" if name.startswith("axlecast-") else None)


def processes():
    """Ids by role, of the processes in this namespace."""
    found = {role: [] for role in ROLES}
    for folder in pathlib.Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            words = (folder / "cmdline").read_text().split("\0")
            role = role_of(words) if len(words) > 2 else None
        except OSError:
            continue
        if role:
            found[role].append(int(folder.name))
    return found


def socket_drops(pids):
    """Datagrams that the kernel dropped because the buffer of a socket of these processes was full."""
    drops = {}
    for line in pathlib.Path("/proc/net/udp").read_text().splitlines()[1:]:
        fields = line.split()
        drops[fields[9]] = int(fields[12])
    total = 0
    for pid in pids:
        for descriptor in pathlib.Path(f"/proc/{pid}/fd").iterdir():
            inode = re.fullmatch(r"socket:\[(\d+)\]", os.readlink(descriptor))
            total += drops.get(inode[1], 0) if inode else 0
    return total


def good_readings(config):
    """Good readings of each axis so far, and the instant in s that they are of."""
    done = subprocess.run([machine.BIN / "axlecast", "status", config, "--json"], capture_output=True, text=True, check=False)
    return {device["device"]: (device["good"], device["mono_ns"] * 1e-9) for device in json.loads(done.stdout)["devices"] if device["heard"]}


def rate(before, after):
    """Readings per second and axis: of all axes together, because the span of a single axis may be short."""
    pairs = [(at, after[name]) for name, at in before.items() if name in after and after[name][1] > at[1]]
    seconds = sum(late[1] - early[1] for early, late in pairs)
    return sum(late[0] - early[0] for early, late in pairs) / seconds if pairs else 0


def device_counts(config):
    """How many devices are online, degraded, offline and silent, as `status` reports them; nothing without a report."""
    done = subprocess.run([machine.BIN / "axlecast", "status", config, "--json"], capture_output=True, text=True, check=False)
    return json.loads(done.stdout)["counts"]["devices"] if done.stdout else {}


def seconds_until_online(bench, up, config, axes):
    """None: an axis was not online within START, which is a result too: the machine carries no more."""
    begin = time.monotonic()
    while time.monotonic() < begin + START:
        if up.poll() is not None:
            raise RuntimeError(f"up ended with {up.returncode}:\n{bench.said()}")
        if device_counts(config).get("online") == axes:
            return time.monotonic() - begin
    return None


def run_once(bench, axes, seconds):
    folder = bench.folder / f"axes{axes}"
    folder.mkdir()
    config = folder / "machine.yaml"
    config.write_text(CONFIG.format(hz=bench.options.axes_hz, axes=axes, folder=folder / "log"))
    summary = folder / "summary.json"
    with open(summary, "wb") as out:
        up = bench.start(machine.BIN / "axlecast", "up", config, "--json", "--seconds", 3600, "--web", stdout=out)
        online_s = seconds_until_online(bench, up, config, axes)
        good = good_readings(config)  # takes seconds: what starts has ended then
        pids = processes()
        before = {role: [cpu_seconds(pid) for pid in pids[role]] for role in ROLES}
        start = time.monotonic()
        time.sleep(seconds)  # what is measured is a span of time
        after = {role: [cpu_seconds(pid) for pid in pids[role]] for role in ROLES}
        passed = time.monotonic() - start
        result = {"axes": axes, "seconds": passed, "online_s": online_s, "roles": {}}
        for role in ROLES:
            result["roles"][role] = {
                "processes": len(pids[role]), "dropped": socket_drops(pids[role]), "mb": sum(map(resident_mb, pids[role])),
                "cpu_ms": 1e3 * sum(b - a for a, b in zip(before[role], after[role])) / passed}
        result["hz"] = rate(good, good_readings(config))
        result["devices"] = device_counts(config)
        up.send_signal(2)
        up.wait(120)
    ended = json.loads(summary.read_text())
    result["lost"] = sum(device["lost"] for device in ended["devices"])
    result["received"] = sum(device["received"] for device in ended["devices"])
    result["dropped_by_up"] = ended["reception"]["dropped"]
    return result


def measure(bench):
    seconds = 5 if bench.options.quick else 20
    print(f"{bench.options.axes_hz:g} Hz; CPU time in ms per second and axis, over {seconds} s; dropped: datagrams at full socket buffers; "
          f"online: s until all axes were, -: not within {START} s")
    print(f"{'axes':>5} {'online':>6} {'Hz':>6} " + " ".join(f"{role:>10}" for role in ROLES) + f" {'all, ms/s':>10} {'dropped':>8} {'lost':>8}")
    for axes in bench.options.axes or AXES:
        result = run_once(bench, axes, seconds)
        roles = result["roles"]
        total = sum(role["cpu_ms"] for role in roles.values())
        dropped = sum(role["dropped"] for role in roles.values())
        online = "-" if result["online_s"] is None else f"{result['online_s']:.1f}"
        print(f"{axes:5} {online:>6} {result['hz']:6.1f} " + " ".join(f"{roles[role]['cpu_ms'] / axes:10.3f}" for role in ROLES) +
              f" {total:10.0f} {dropped:8} {result['lost']:8}", flush=True)
        if result["devices"].get("online") != axes:
            print("      at the end: " + ", ".join(f"{count} {state}" for state, count in result["devices"].items() if count), flush=True)
        bench.report.rows.append({"what": "axes", **result})
