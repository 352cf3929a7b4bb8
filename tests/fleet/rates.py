#!/usr/bin/env python3
"""rates.py [--seconds S] [--backlog B] [--pairs N]: one machine of 10 axes at 250 Hz is recorded for S seconds while it is shipped, then at 1 kHz
for B seconds without a shipper. Its logs are shipped again into an empty database, beside a bare COPY of the same samples as rows, and once more
while ten drivers run, beside drivers without it.
Prints CPU time of the shipper, how far behind it was, bytes a sample, the speed of backfill, its ratio to the bare COPY, and the rates of the
drivers. Exits 1 only if samples are missing.

Run in a network of its own with AXLECAST_BIN, AXLECAST_CAMPAIGN and PYTHONPATH as tools/campaign fleet does."""

import argparse
import json
import pathlib
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time

from chaos import BIN, CAMPAIGN, FIRST_PORT, Machine, simulated_buses
from cluster import Cluster
from machine import wait_for
from process_cost import cpu_seconds  # bench

AXES, RATE = 10, 250


class Rates:
    def __init__(self, server, folder, options):
        self.server = server
        self.options = options
        self.machine = Machine(folder, 1, AXES, server.connection())

    def init(self, name):
        self.server.sql(f"DROP DATABASE IF EXISTS {name}", database="postgres")
        self.server.create_database(name)
        subprocess.run([BIN / "axlecast", "fleet", "init", self.server.connection(name)], check=True, stdout=subprocess.DEVNULL)

    def live(self):
        """Records and ships at once. Returns the number of samples that were sent."""
        self.init("axlecast")
        self.start_recorder()
        self.machine.start("ship")
        sent = self.send(RATE, self.options.seconds)
        cpu = cpu_seconds(self.machine.processes["ship"].pid)
        behind = float(self.server.value("SELECT extract(epoch FROM lag) FROM axlecast.fleet_status"))
        print(f"shipper, live at {AXES * RATE} samples/s: {100 * cpu / self.options.seconds:.2f} % of a core (target 3), "
              f"{behind:.1f} s behind at the end (target 2)")
        self.machine.stop("record")
        wait_for(lambda: self.stored("axlecast") == sent, lambda: f"{sent} samples, not {self.stored('axlecast')}")
        self.machine.stop("ship")
        return sent

    def stored(self, database):
        return int(self.server.value("SELECT coalesce(sum(n), 0) FROM axlecast.position_chunk", database=database))

    def start_recorder(self):
        log = self.machine.folder / "record.log"
        before = log.read_text().count('"start"') if log.exists() else 0
        self.machine.start("record")
        while log.read_text().count('"start"') == before:
            time.sleep(0.1)

    @staticmethod
    def send(rate, seconds):
        """Sends positions of each axis at that rate. Returns their number."""
        done = subprocess.run([CAMPAIGN / "fleet_machines", "1", str(AXES), str(rate), str(seconds), str(FIRST_PORT), "m"],
                              stdout=subprocess.PIPE, text=True, check=True)
        return sum(axis["positions"] for axis in json.loads(done.stdout)["machines"][0]["axes"].values())

    def backlog(self):
        """Records without a shipper, at four times the rate. Returns the number of samples that were sent."""
        self.start_recorder()
        sent = self.send(4 * RATE, self.options.backlog)
        self.machine.stop("record")
        return sent

    def ship(self, name):
        """Ships the logs into an empty database. Returns the seconds."""
        self.init(name)
        begin = time.monotonic()
        done = subprocess.run([BIN / "axlecast", "ship", self.machine.config, "--database", self.server.connection(name), "--state",
                               self.machine.folder / f"state-{name}", "--once", "--json"], capture_output=True, text=True, check=False)
        seconds = time.monotonic() - begin
        if done.returncode not in (0, 3):
            raise RuntimeError(done.stderr)
        return seconds

    def copy(self, file, table, columns):
        """Returns the seconds of a bare COPY of a file into an empty table."""
        self.server.sql(f"DROP TABLE IF EXISTS {table}; CREATE TABLE {table} ({columns})", database="bare")
        begin = time.monotonic()
        self.server.sql(f"COPY {table} FROM '{file}' (FORMAT binary)", database="bare")
        return time.monotonic() - begin

    def driver_rates(self):
        """Returns the rates of drivers on simulated buses, in Hz by device."""
        url = "udpm://239.255.77.2:{}?ttl=0&interface=lo"
        file = self.machine.folder / "drivers.yaml"
        file.write_text(f"machine: drivers\nlcm: {{url: '{url.format(29_900)}', command_url: '{url.format(29_901)}'}}\n"
                        f"bridge: {{unsigned_commands: allow}}\nbuses: {simulated_buses(AXES, f'poll_hz: {RATE}, ')}\n")
        done = subprocess.run([BIN / "axlecast", "up", file, "--seconds", "20", "--json"], capture_output=True, text=True, check=False)
        return [device["rate_hz"] for device in json.loads(done.stdout)["devices"]]

    def drivers(self):
        """Prints what drivers reach beside a backfill without a limit of its bandwidth, and without one."""
        alone = self.driver_rates()
        ended = threading.Event()
        shipments = []

        def ship_again():
            while not ended.is_set():
                shipments.append(self.ship("beside"))

        shipping = threading.Thread(target=ship_again)
        shipping.start()
        beside = self.driver_rates()
        ended.set()
        shipping.join()
        print(f"drivers, {AXES} at {RATE} Hz: {statistics.mean(beside):.1f} Hz (slowest {min(beside):.1f}) beside {len(shipments)} backfills, "
              f"{statistics.mean(alone):.1f} Hz ({min(alone):.1f}) without: {100 * statistics.mean(beside) / statistics.mean(alone):.1f} % of it (target 99)")

    def measure(self):
        sent = self.live()
        backlog = self.backlog()
        self.ship("backfill")
        stored = self.stored("backfill")
        size = int(self.server.value("SELECT sum(pg_total_relation_size(inhrelid)) FROM pg_inherits WHERE inhparent IN "
                                     "('axlecast.position_chunk'::regclass, 'axlecast.position_second'::regclass)"))
        bodies = int(self.server.value("SELECT sum(length(body)) FROM axlecast.position_chunk"))
        live = self.stored("axlecast")
        print(f"bytes a sample, shipped live: {size / live:.2f} with heads, roll-up of 1 s and indexes (target 5), of which bodies {bodies / live:.2f}")
        # The same samples as rows, without any index.
        rows = pathlib.Path(self.server.folder) / "rows"
        self.server.sql("COPY (SELECT s.t, s.counts, s.flags, s.stream FROM axlecast.device d JOIN axlecast.machine m ON m.id = d.machine, "
                        "axlecast.samples(m.name, d.name, now() - interval '1 day', now()) s) "
                        f"TO '{rows}' (FORMAT binary)", database="backfill")
        self.server.create_database("bare")
        ratios, times, bare = [], [], []
        for pair in range(self.options.pairs):
            steps = [lambda: times.append(self.ship("backfill")),
                     lambda: bare.append(self.copy(rows, "pos", "t timestamptz, counts int8, flags int4, stream int4"))]
            for step in steps if pair % 2 == 0 else reversed(steps):
                step()
            ratios.append(bare[-1] / times[-1])
        print(f"backfill: {stored / statistics.median(times):,.0f} samples/s, {stored / AXES / RATE / statistics.median(times):.0f} x live (target 10)")
        print(f"backfill beside a bare COPY of the same samples as rows: {statistics.median(ratios):.2f} ({min(ratios):.2f}..{max(ratios):.2f}) "
              "(target 0.8)")
        self.drivers()
        print(f"{sent} samples sent while they were shipped, {live} in the database; {sent + backlog} in all, {stored} in the database of the backfill")
        return 0 if sent == live and sent + backlog == stored else 1


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=int, default=300)
    parser.add_argument("--backlog", type=int, default=120, help="more seconds, at four times the rate, for the backfill")
    parser.add_argument("--pairs", type=int, default=11)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="axlecast-rates-") as folder, Cluster(fsync="on", shared_buffers="256MB") as server:
        rates = Rates(server, pathlib.Path(folder), options)
        try:
            return rates.measure()
        finally:
            for process in rates.machine.processes.values():
                if process.poll() is None:
                    process.send_signal(signal.SIGKILL)
                    process.wait()


if __name__ == "__main__":
    sys.exit(main())
