#!/usr/bin/env python3
"""chaos.py [--machines N] [--axes N] [--rate HZ] [--seconds S] [--kills N] [--cut S] [--seed N]: simulated machines, each with a recorder and
a shipper, and one PostgreSQL with a synchronous standby. Recorders, shippers and both servers are killed at random, the network to the
database is cut for a while, and the disk of one machine is full for a while. Afterwards the numbers of the senders are compared with the
database: every position, alarm, command and trip is there once, or in a gap with its cause. Exits 1 otherwise.

Run in a network of its own with AXLECAST_BIN, AXLECAST_CAMPAIGN and PYTHONPATH as the tests of this folder (tools/campaign fleet)."""

import argparse
import collections
import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

from cluster import Pair

BIN = pathlib.Path(os.environ["AXLECAST_BIN"])
CAMPAIGN = pathlib.Path(os.environ["AXLECAST_CAMPAIGN"])
FIRST_PORT = 29_000
DATABASE_PORT = 5432
# Of the machine whose disk is full for a while: while the network is cut, it must delete logs that are not shipped.
DISK = "64m"
LOG_ON_DISK = "split_size: 6MB, quota: 24MB"


def simulated_buses(axes, keys=""):
    """The value of `buses` of a machine's file: one encoder on each bus, which has also these keys."""
    return "{" + ", ".join(f"b{axis}: {{family: tformat, simulate: true, {keys}devices: {{axis{axis}: {{model: ts5669n127, unit: turn}}}}}}"
                           for axis in range(1, axes + 1)) + "}"


class Machine:
    """One machine: its file, its recorder and its shipper."""

    def __init__(self, folder, number, axes, connection, log="split_time: 5m"):
        self.name = f"m{number:02}"
        self.folder = folder / self.name
        self.logs = self.folder / "logs"
        self.logs.mkdir(parents=True)
        self.processes = {}
        url = "udpm://239.255.77.1:{}?ttl=0&interface=lo"
        self.config = self.folder / "machine.yaml"
        self.config.write_text(
            f"machine: {self.name}\n"
            f"lcm: {{url: '{url.format(FIRST_PORT + 2 * number)}', command_url: '{url.format(FIRST_PORT + 2 * number + 1)}'}}\n"
            "bridge: {unsigned_commands: allow}\n"
            f"recorder: {{directory: {self.logs}, logs: {{all: {{{log}}}}}}}\n"
            f"ship: {{database: \"{connection}\"}}\n"
            f"buses: {simulated_buses(axes)}\n")

    def start(self, what):
        words = {"record": ("record", "--config", self.config, "--json"),
                 "ship": ("ship", self.config, "--state", self.folder / "state", "--json")}[what]
        with open(self.folder / f"{what}.log", "ab") as log:
            self.processes[what] = subprocess.Popen([BIN / "axlecast", *words], stdout=log, stderr=log)  # pylint: disable=consider-using-with

    def kill(self, what):
        self.processes[what].kill()
        self.processes[what].wait()

    def revive(self):
        """Starts what has ended by itself, as systemd would. Returns the number of processes."""
        ended = [what for what, process in self.processes.items() if process.poll() is not None]
        for what in ended:
            self.start(what)
        return len(ended)

    def stop(self, what):
        self.processes[what].send_signal(signal.SIGTERM)
        self.processes[what].wait(120)


class Chaos:
    def __init__(self, options, folder, pair):
        self.options = options
        self.pair = pair
        self.chance = random.Random(options.seed)
        self.counts = collections.Counter()
        connection = f"host=127.0.0.1 port={DATABASE_PORT} dbname=axlecast user=postgres"
        self.machines = [Machine(folder, 1, options.axes, connection, LOG_ON_DISK)]
        self.machines += [Machine(folder, number, options.axes, connection) for number in range(2, options.machines + 1)]
        self.kinds = ["record", "ship", "ship", "primary", "standby"]

    def nft(self, text):
        subprocess.run(["nft", "-f", "-"], input=text, text=True, check=True)

    def cut(self, is_cut):
        """Cuts the network between all shippers and the database, or joins it again."""
        if is_cut:
            self.nft("add table inet axlecast\n"
                     "add chain inet axlecast input { type filter hook input priority 0; }\n"
                     f"add rule inet axlecast input tcp dport {DATABASE_PORT} drop\nadd rule inet axlecast input tcp sport {DATABASE_PORT} drop\n")
        else:
            self.nft("delete table inet axlecast\n")

    def fill(self, machine, is_full):
        """Fills the disk of a machine, or makes room again."""
        ballast = machine.logs / "ballast"
        if not is_full:
            ballast.unlink()
            return
        with open(ballast, "wb", buffering=0) as file:
            try:
                while True:
                    file.write(bytes(1 << 16))
            except OSError:
                pass

    def hurt(self):
        """Kills one process; a server and a recorder start again a little later."""
        kind = self.chance.choice(self.kinds)
        self.counts[f"kill of {kind}"] += 1
        if kind in ("primary", "standby"):
            server = getattr(self.pair, kind)
            server.kill()
            time.sleep(self.chance.random() * 3)
            server.start(wait=False)
            return
        machine = self.chance.choice(self.machines)
        machine.kill(kind)
        time.sleep(self.chance.random())
        machine.start(kind)

    def run(self):
        """Returns what was sent."""
        options = self.options
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK}", "tmpfs", self.machines[0].logs], check=True)
        for machine in self.machines:
            machine.start("record")
        deadline = time.monotonic() + 60
        while any("start" not in (machine.folder / "record.log").read_text() for machine in self.machines):
            if time.monotonic() > deadline:
                raise RuntimeError("a recorder does not start:\n" + (self.machines[0].folder / "record.log").read_text())
            time.sleep(0.1)
        sender = subprocess.Popen([CAMPAIGN / "fleet_machines", str(options.machines), str(options.axes), str(options.rate),  # pylint: disable=consider-using-with
                                   str(options.seconds), str(FIRST_PORT), "m"], stdout=subprocess.PIPE, text=True)
        for machine in self.machines:
            machine.start("ship")
        begin = time.monotonic()
        actions = sorted(
            [(self.chance.uniform(0.02, 0.9) * options.seconds, self.hurt) for _ in range(options.kills)]
            + [(0.3 * options.seconds, lambda: self.cut(True)), (0.3 * options.seconds + options.cut, lambda: self.cut(False)),
               (0.7 * options.seconds, lambda: self.fill(self.machines[0], True)),
               (0.7 * options.seconds + min(60, 0.1 * options.seconds), lambda: self.fill(self.machines[0], False))], key=lambda action: action[0])
        shown = begin
        for at, action in actions:
            while (pause := begin + at - time.monotonic()) > 0:
                time.sleep(min(pause, 1))
                if time.monotonic() - shown >= 60:
                    shown += 60
                    print(f"{shown - begin:.0f} s of {options.seconds}: {dict(self.counts)}", flush=True)
                for machine in self.machines:
                    self.counts["ended by itself and started again"] += machine.revive()
            action()
        out, _ = sender.communicate()
        truth = json.loads(out)
        print(f"sent for {truth['seconds']:.0f} s, at most {truth['latest_ms']} ms late; {dict(self.counts)}", flush=True)
        for machine in self.machines:
            machine.revive()
            machine.stop("record")
        return truth

    def drain(self):
        """Ends the shippers, and ships what is left. Returns the seconds that this takes."""
        for server in (self.pair.primary, self.pair.standby):
            server.wait_until_ready()
        begin = time.monotonic()
        for machine in self.machines:
            machine.stop("ship")
            logs = list(machine.logs.glob("*.lcm"))
            subprocess.run(["touch", "-d", "1 hour ago", *logs], check=True)  # quiet for 10 s: closed
        for machine in self.machines:
            done = subprocess.run([BIN / "axlecast", "ship", machine.config, "--state", machine.folder / "state", "--once", "--json"],
                                  capture_output=True, text=True, check=False, timeout=900)
            if done.returncode not in (0, 3):
                raise RuntimeError(f"{machine.name}: exit code {done.returncode}\n{done.stderr}")
        return time.monotonic() - begin

    def compare(self, truth):
        """Returns the faults, one text each, and prints the sums."""
        faults = []
        sums = collections.Counter()
        sql = self.pair.primary.sql

        def table(query):
            return {tuple(row[:-1]): int(row[-1]) for row in sql(query)}
        # Numbers that are in a log, each counted once, and those that are in a gap.
        last = table("SELECT m.name, r.channel, max(r.last_seq) FROM axlecast.received r JOIN axlecast.machine m ON m.id = r.machine GROUP BY 1, 2")
        gaps = table("SELECT machine, channel, sum(messages) FROM axlecast.gaps GROUP BY 1, 2")
        unexplained = sql("SELECT count(*) FROM axlecast.gaps WHERE cause IS NULL")[0][0]
        samples = table("SELECT a.machine, a.device, sum(c.n) FROM axlecast.position_chunk c JOIN axlecast.axis a USING (stream) GROUP BY 1, 2")
        seconds = table("SELECT a.machine, a.device, sum(c.n) FROM axlecast.position_second c JOIN axlecast.axis a USING (stream) GROUP BY 1, 2")
        minutes = table("SELECT a.machine, a.device, sum(c.n) FROM axlecast.position_minute c JOIN axlecast.axis a USING (stream) GROUP BY 1, 2")
        alarms = table("SELECT m.name, a.device, a.state, count(*) FROM axlecast.alarm a JOIN axlecast.machine m ON m.id = a.machine "
                       "WHERE a.name = 'battery_alarm' GROUP BY 1, 2, 3")
        commands = table("SELECT m.name, count(DISTINCT c.command_id) FROM axlecast.command c JOIN axlecast.machine m ON m.id = c.machine GROUP BY 1")
        trips = table("SELECT m.name, t.device, count(*) FROM axlecast.trip t JOIN axlecast.machine m ON m.id = t.machine GROUP BY 1, 2")

        def check(what, machine, channel, sent, stored):
            """Every number is stored or in a gap. All recorders ran at the end, so that the last one was recorded."""
            gap = gaps.get((machine, channel), 0)
            sums[f"{what} sent"] += sent
            sums[f"{what} stored"] += stored
            sums[f"{what} in gaps"] += gap
            if stored + gap != sent:
                newest = last.get((machine, channel), -1)
                faults.append(f"{machine} {channel}: {sent} sent, {stored} stored, {gap} in gaps, the last one recorded is {newest}")
        for machine in truth["machines"]:
            name = machine["machine"]
            check("commands", name, "COMMAND_STATUS", machine["commands"], commands.get((name,), 0))
            for axis, sent in machine["axes"].items():
                stored = samples.get((name, axis), 0)
                check("positions", name, f"POSITION/{axis}", sent["positions"], stored)
                check("trips", name, f"TRIP/{axis}", sent["trips"], trips.get((name, axis), 0))
                for rows in (seconds, minutes):
                    if rows.get((name, axis), 0) != stored:
                        faults.append(f"{name} {axis}: {stored} samples, {rows.get((name, axis), 0)} in roll-ups")
                # An alarm is repeated each second: only a gap can hide one.
                for state in ("appeared", "cleared"):
                    found = alarms.get((name, axis, state), 0)
                    sums[f"alarms {state} sent"] += sent[state]
                    sums[f"alarms {state} stored"] += found
                    if found > sent[state] or found < sent[state] and gaps.get((name, f"ALARM/{axis}"), 0) == 0:
                        faults.append(f"{name} {axis}: {sent[state]} alarms {state}, {found} stored")
        if unexplained != "0":
            faults.append(f"{unexplained} gaps without a cause")
        for what, value in sums.items():
            print(f"  {what:24} {value}")
        for cause, number, messages in sql("SELECT cause, count(*), sum(messages) FROM axlecast.gaps GROUP BY 1 ORDER BY 1"):
            print(f"  gaps: {cause}: {number} with {messages} messages")
        for cause, number in sql("SELECT cause, count(*) FROM axlecast.hole GROUP BY 1 ORDER BY 1"):
            print(f"  holes: {cause}: {number}")
        size = sql("SELECT sum(pg_total_relation_size(inhrelid)) FROM pg_inherits WHERE inhparent IN ('axlecast.position_chunk'::regclass, "
                   "'axlecast.position_second'::regclass)")[0][0]
        print(f"  {int(size) / max(1, sums['positions stored']):.2f} bytes a sample, with head, roll-up of 1 s and indexes")
        return faults


def main():
    parser = argparse.ArgumentParser()
    for name, default in (("machines", 20), ("axes", 10), ("rate", 250), ("seconds", 3600), ("kills", 120), ("cut", 600), ("seed", 1)):
        parser.add_argument(f"--{name}", type=int, default=default)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="axlecast-fleet-") as folder, \
            Pair(fsync="on", listen_addresses="127.0.0.1", max_connections="100", shared_buffers="256MB") as pair:
        pair.primary.create_database()
        subprocess.run([BIN / "axlecast", "fleet", "init", pair.primary.connection()], check=True, stdout=subprocess.DEVNULL)
        chaos = Chaos(options, pathlib.Path(folder), pair)
        try:
            truth = chaos.run()
            print(f"the rest was shipped in {chaos.drain():.0f} s", flush=True)
            faults = chaos.compare(truth)
        finally:
            for machine in chaos.machines:
                for process in machine.processes.values():
                    if process.poll() is None:
                        process.kill()
                        process.wait()
            subprocess.run(["umount", chaos.machines[0].logs], check=False)
    for fault in faults:
        print("FAULT", fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
