"""What the tests of `axlecast ship` share: a database, a machine's file, logs that a recorder has written of messages that the test has
sent, and what the database has of them."""

import itertools
import json
import signal
import socket
import subprocess
import threading
import time

import lcm_log
from cluster import Cluster
from machine import BIN, Machine, wait_for

TYPES = lcm_log.generated_types()
GROUP, PORT = "239.255.76.67", 7667
UTIME_EACH = 4_000  # us: 250 Hz


class Positions:
    """Sends POSITION messages of several axes, as one driver does: one boot_id, one seq an axis. `sent` has what was sent."""

    def __init__(self, axes, boot_id=77, begin=None, port=PORT):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.number = itertools.count()
        self.axes, self.boot_id, self.port = axes, boot_id, port
        self.utime = int(time.time() * 1e6) if begin is None else begin
        self.sent = {axis: [] for axis in axes}

    def send(self, count):
        """Sends `count` messages of each axis. A pause after each few: the recorder must lose nothing."""
        for i in range(count):
            self.utime += UTIME_EACH
            for index, axis in enumerate(self.axes):
                message = TYPES.position_t()
                message.utime, message.mono_ns, message.boot_id = self.utime, self.utime * 1000, self.boot_id
                message.seq = len(self.sent[axis])
                message.counts_per_turn, message.counts, message.flags = 131072, 1000 * index + message.seq * 7 % 997, 0x2003
                message.value, message.unit = message.counts * 360 / 131072, TYPES.position_t.UNIT_DEG
                self.publish(f"POSITION/{axis}", message.encode())
                self.sent[axis].append((message.utime, message.counts))
            if i % 20 == 0:
                time.sleep(0.005)

    def publish(self, channel, data):
        self.socket.sendto(lcm_log.datagram(next(self.number), channel, data), (GROUP, self.port))

    def close(self):
        self.socket.close()


def rolled_up(sent, length):
    """Returns the time, number, minimum, maximum and sum of the counts of each interval of `length` us."""
    groups = itertools.groupby(sent, lambda sample: sample[0] // length * length)
    parts = [(begin, [counts for _, counts in samples]) for begin, samples in groups]
    return [[begin, len(counts), min(counts), max(counts), sum(counts)] for begin, counts in parts]


class Load(threading.Thread):
    """Sends positions of each axis at about 250 Hz until it is stopped."""

    def __init__(self, sender):
        super().__init__(daemon=True)
        self.sender = sender
        self.stopped = threading.Event()

    def run(self):
        while not self.stopped.is_set():
            self.sender.send(20)
            time.sleep(0.07)

    def stop(self):
        self.stopped.set()
        self.join()


class Shipping(Machine):
    """Base: a server with the schema, and a machine's file for it."""
    axes = ("a1", "a2")

    def setUp(self):
        super().setUp()
        self.start_database()
        self.init()
        self.logs = self.folder / "logs"
        self.config = self.machine_file()

    def start_database(self):
        self.cluster = self.enterContext(Cluster())
        self.cluster.create_database()

    def connection(self):
        """The connection string of the machine's file."""
        return self.cluster.connection()

    def init(self):
        code, _, errors = self.axlecast("fleet", "init", self.cluster.connection())
        self.assertEqual(code, 0, errors)

    def machine_file(self, name="press3", ship="", logs="positions: {channels: ^POSITION/}\n    rest: {channels: ^POSITION/, invert: true}"):
        buses = "".join(f"  b-{axis}: {{family: tformat, simulate: true, devices: {{{axis}: {{model: ts5669n127, unit: deg}}}}}}\n" for axis in self.axes)
        text = (f"machine: {name}\nbridge: {{unsigned_commands: allow}}\nrecorder:\n  directory: {self.logs}\n  logs:\n    {logs}\n"
                f"ship:\n  database: \"{self.connection()}\"\n  {ship}\n"
                f"buses:\n{buses}")
        return self.write(text, f"{name}.yaml")

    # -- logs

    def recorder(self, config=None, name="record", env=None):
        process = self.start(name, BIN / "axlecast", "record", "--config", config or self.config, "--json", env=env)
        wait_for(lambda: '"start"' in self.log(name) or process.poll() is not None, "the recorder to listen")
        self.assertIsNone(process.poll(), self.log(name))
        return process

    def record(self, count, begin=None, boot_id=77, config=None, stop=signal.SIGINT, env=None):
        """Logs of `count` messages of each axis. Returns the sender."""
        before = self.recorded()
        recorder = self.recorder(config, f"record{boot_id}", env)
        sender = Positions(self.axes, boot_id, begin)
        self.addCleanup(sender.close)
        sender.send(count)
        wait_for(lambda: self.recorded() >= before + count * len(self.axes), "the logs to have all messages")
        recorder.send_signal(stop)
        recorder.wait(60)
        return sender

    def recorded(self):
        """The number of POSITION messages in all logs."""
        found = 0
        for path in self.logs.glob("*.lcm"):
            data = path.read_bytes()
            found += sum(b"POSITION/" in record[28:44] for record in lcm_log.whole_records(data))
        return found

    def make_quiet(self):
        """Makes the logs look as if nobody had written to them for an hour."""
        subprocess.run(["touch", "-d", "1 hour ago", *self.logs.glob("*.lcm")], check=True)

    def log_of(self, name="positions"):
        return sorted(self.logs.glob(f"*-{name}_*.lcm"))[0]

    # -- the shipper

    def shipper(self, *options, name="ship", config=None, state="ship-state"):
        return self.start(name, BIN / "axlecast", "ship", config or self.config, "--state", self.folder / state, "--json", *options)

    def ship_once(self, *options, config=None, state="ship-state"):
        """Returns exit code, last status, errors."""
        done = subprocess.run([BIN / "axlecast", "ship", config or self.config, "--state", self.folder / state, "--json", "--once", *options],
                              capture_output=True, text=True, timeout=300, check=False)
        lines = done.stdout.splitlines()
        return done.returncode, json.loads(lines[-1]) if lines else None, done.stderr

    def must_ship(self, *options, **more):
        """Ships all that is recorded, as of closed logs."""
        if list(self.logs.glob("*.lcm")):
            self.make_quiet()
        code, status, errors = self.ship_once(*options, **more)
        self.assertEqual(code, 0, f"{status}\n{errors}")
        return status

    # -- the database

    def samples(self, axis, machine="press3"):
        """(us, counts) of every sample, in the order of seq."""
        rows = self.cluster.sql(f"SELECT (extract(epoch FROM t) * 1000000)::int8, counts FROM axlecast.samples('{machine}', '{axis}', "
                                "now() - interval '3000 days', now() + interval '7 days') ORDER BY seq, t")
        return [(int(t), int(counts)) for t, counts in rows]

    def assert_exactly_once(self, sender, machine="press3"):
        for axis, sent in sender.sent.items():
            stored = self.samples(axis, machine)
            self.assertEqual(len(stored), len(sent), axis)
            self.assertEqual(stored, sent, axis)
            for table, length in (("position_second", 1_000_000), ("position_minute", 60_000_000)):
                rows = self.cluster.sql("SELECT (extract(epoch FROM p.t) * 1000000)::int8, p.n, p.lo, p.hi, round(p.mean * p.n) "
                                        f"FROM axlecast.{table} p JOIN axlecast.axis a USING (stream) "
                                        f"WHERE a.machine = '{machine}' AND a.device = '{axis}' ORDER BY p.t")
                self.assertEqual([[int(value) for value in row] for row in rows], rolled_up(sent, length), table)

    def holes(self):
        return self.cluster.sql("SELECT cause, first_event, messages FROM axlecast.hole ORDER BY log, first_event")
