#!/usr/bin/env python3
"""axlecast ship and two shards (docs/fleet.md, "Shards"): four machines find their server in the table of the coordinator; one server is
killed, and the machines of the other one notice nothing."""
import json
import os
import signal
import sys
import time
import unittest
from pathlib import Path

from cluster import Cluster, SqlError
from fleet_schema import install_schema
from machine import wait_for
from shipping import Load, Positions, Shipping
from web_client import request

COORDINATOR = Path(__file__).resolve().parents[2] / "packaging" / "fleet" / "coordinator.sql"
SHARDS = {"left": ("press1", "press2"), "right": ("press3", "press4")}
PORTS = {name: 7670 + i for i, name in enumerate(name for names in SHARDS.values() for name in names)}  # of LCM; + 1000: metrics
LIMIT_S = 120
OUTAGE_S = 12       # longer than the shipper waits before it raises its alarm
LAG_LIMIT_S = 10    # of the machines whose server lives: some seconds on a busy host


class ShipShards(Shipping):
    def start_database(self):
        self.coordinator, *servers = [self.enterContext(Cluster()) for _ in range(3)]
        self.shards = dict(zip(SHARDS, servers))
        for cluster in (self.coordinator, *servers):
            install_schema(cluster, reader="grafana")
        self.cluster = self.coordinator
        self.coordinator.sql(COORDINATOR.read_text(encoding="utf-8"))
        for name, machines in SHARDS.items():
            for machine in machines:
                code, _, errors = self.axlecast("fleet", "shard", machine, self.shards[name].connection(), "--database",
                                                self.coordinator.connection())
                self.assertEqual(code, 0, errors)
        self.coordinator.sql("SELECT axlecast.attach_shards('grafana')")

    def setUp(self):
        super().setUp()
        self.configs, self.recorders, self.shippers, self.senders, self.loads = {}, {}, {}, {}, {}
        for name, port in PORTS.items():
            self.configs[name] = self.write(
                f"machine: {name}\nlcm: {{url: 'udpm://239.255.76.67:{port}?ttl=0', command_url: 'udpm://239.255.76.67:{port + 100}?ttl=0'}}\n"
                f"bridge: {{unsigned_commands: allow}}\nrecorder: {{directory: {self.logs / name}, logs: {{all: {{}}}}}}\n"
                f"ship: {{database: \"{self.connection()}\", metrics: '{port + 1000}'}}\n"
                "buses:\n" + "".join(f"  b-{axis}: {{family: tformat, simulate: true, devices: {{{axis}: {{model: ts5669n127, unit: deg}}}}}}\n"
                                     for axis in self.axes), f"{name}.yaml")
            (self.logs / name).mkdir(parents=True)

    def start_machines(self):
        for name, port in PORTS.items():
            self.recorders[name] = self.recorder(self.configs[name], f"record-{name}")
            self.shippers[name] = self.shipper(name=f"ship-{name}", config=self.configs[name], state=f"state-{name}")
            self.senders[name] = Positions(self.axes, port=port)
            self.addCleanup(self.senders[name].close)
            self.loads[name] = Load(self.senders[name])
            self.loads[name].start()
            self.addCleanup(self.loads[name].stop)
        for name in PORTS:
            self.wait_for_samples(name, 1)

    def shard_of(self, machine):
        return next(self.shards[name] for name, machines in SHARDS.items() if machine in machines)

    def stored(self, machine):
        return int(self.shard_of(machine).value("SELECT coalesce(sum(p.n), 0) FROM axlecast.position_second p JOIN axlecast.axis a "
                                                f"USING (stream) WHERE a.machine = '{machine}'"))

    def wait_for_samples(self, machine, number):
        wanted = self.stored(machine) + number
        wait_for(lambda: self.stored(machine) >= wanted, lambda: f"samples of {machine}: " + self.log(f"ship-{machine}"), limit=LIMIT_S)

    def metric(self, machine, name):
        body = request(PORTS[machine] + 1000, "/metrics")[2].decode()
        return float(next(line.split()[1] for line in body.splitlines() if line.startswith(f"axlecast_ship_{name} ")))

    def finish(self):
        """Ends everything, and compares what was sent with the shards, and with what the coordinator reads."""
        for name, load in self.loads.items():
            load.stop()
            sent = sum(map(len, self.senders[name].sent.values()))
            wait_for(lambda name=name, sent=sent: sum(path.read_bytes().count(b"POSITION/") for path in (self.logs / name).glob("*.lcm")) >= sent,
                     f"the log of {name} to have {sent} messages", limit=LIMIT_S)
        for process in (*self.recorders.values(), *self.shippers.values()):
            self.assertIsNone(process.poll())
            process.send_signal(signal.SIGTERM)
        for process in (*self.recorders.values(), *self.shippers.values()):
            self.assertIn(process.wait(60), (0, 3))
        for name in PORTS:
            for log in (self.logs / name).glob("*.lcm"):
                self.make_older(log)
            code, status, errors = self.ship_once(config=self.configs[name], state=f"state-{name}")
            self.assertEqual((code, status["holes"]), (0, 0), errors)
            self.cluster = self.shard_of(name)
            self.assert_exactly_once(self.senders[name], name)
            self.cluster = self.coordinator
            self.assertEqual(self.coordinator.value(f"""SELECT count(*) FROM fleet.samples('{name}', 'a1', now() - interval '1 d',
                now() + interval '1 d')""", user="grafana"), str(len(self.senders[name].sent["a1"])))
        for name, machines in SHARDS.items():
            self.assertEqual([row[0] for row in self.shards[name].sql("SELECT name FROM axlecast.machine ORDER BY 1")], list(machines))

    @staticmethod
    def make_older(log):
        hour = time.time() - 3600
        os.utime(log, (hour, hour))

    def test_a_dead_shard_costs_its_machines_only_and_they_catch_up(self):
        self.start_machines()
        self.shards["right"].kill()
        killed = time.monotonic()
        for name in SHARDS["right"]:
            wait_for(lambda name=name: f"the shard of the machine {name}: no connection" in self.log(f"ship-{name}"),
                     lambda name=name: "the cause: " + self.log(f"ship-{name}"))
        lags = {name: 0.0 for name in PORTS}
        before = {name: self.stored(name) for name in SHARDS["left"]}
        while time.monotonic() - killed < OUTAGE_S:
            for name in lags:
                lags[name] = max(lags[name], self.metric(name, "lag_seconds"))
            time.sleep(0.2)
        for name in SHARDS["left"]:
            self.assertLess(lags[name], LAG_LIMIT_S)
            self.assertEqual(self.metric(name, "database_up"), 1)
            self.assertGreater(self.stored(name), before[name])
        for name in SHARDS["right"]:
            self.assertGreater(lags[name], OUTAGE_S - 5)
            self.assertEqual(self.metric(name, "database_up"), 0)
            self.assertGreater(self.metric(name, "lag_bytes"), 0)
            self.assertIsNone(self.shippers[name].poll())
        self.check_reading_without("right")

        self.shards["right"].start()
        back = time.monotonic()
        for name in SHARDS["right"]:
            wait_for(lambda name=name: self.metric(name, "database_up") == 1 and self.metric(name, "lag_seconds") < 5,
                     lambda name=name: f"{name} to catch up: " + self.log(f"ship-{name}"), limit=LIMIT_S)
        print(f"{self.id()}: {OUTAGE_S} s without a shard: lag of the others at most {max(lags[n] for n in SHARDS['left']):.1f} s; "
              f"its own caught up after {time.monotonic() - back:.1f} s", file=sys.stderr)
        self.finish()

    def check_reading_without(self, dead):
        alive = [name for shard, names in SHARDS.items() if shard != dead for name in names]
        machines = [row[0] for row in self.coordinator.sql("SELECT machine FROM fleet.fleet_status ORDER BY 1", user="grafana")]
        self.assertEqual(machines, alive)
        problems = {row[0]: row[1] for row in self.coordinator.sql("SELECT machines::text, problem FROM axlecast.shards()", user="grafana")}
        self.assertIsNone(problems["{" + ",".join(alive) + "}"])
        self.assertRegex(problems["{" + ",".join(SHARDS[dead]) + "}"], "could not connect to server")
        with self.assertRaisesRegex(SqlError, "could not connect to server"):
            self.coordinator.sql("SELECT count(*) FROM fleet.position_1s", user="grafana")
        code, out, errors = self.axlecast("fleet", "status", "--database", self.coordinator.connection(user="grafana"), "--json")
        self.assertEqual(code, 3, errors)
        servers = json.loads(out)["servers"]
        self.assertEqual(sorted(machine["machine"] for server in servers for machine in server.get("machines", [])), alive)
        self.assertEqual([str(self.shards[dead].folder) in server["error"] for server in servers if "error" in server], [True], out)

    def test_the_coordinator_is_needed_at_the_start_only(self):
        self.start_machines()
        self.coordinator.kill()
        for shard in self.shards.values():
            shard.kill()
        for name in PORTS:
            wait_for(lambda name=name: self.metric(name, "database_up") == 0, f"{name} to miss its server")
        for shard in self.shards.values():
            shard.start()
        for name in PORTS:
            self.wait_for_samples(name, 200)
        self.coordinator.start()
        self.finish()


if __name__ == "__main__":
    unittest.main()
