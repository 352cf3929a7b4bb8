"""Queries of a fleet database that holds 10^9 samples, beside nothing: their targets are times. Rows are generated in the server, from the
bodies of chunks that tests/fleet/chunk_body.py encodes."""

import math
import random
import statistics
import subprocess
import time

import chunk_body  # tests/fleet
import cluster
import machine  # tests/e2e

BODIES = 64  # different ones
SAMPLES = 256  # of a chunk
RATE_HZ = 250
MACHINES = 100
AXES = 10
HOUR_S = 3600
RUNS = 15

SIZES = """SELECT sum(pg_total_relation_size(i.inhrelid)) FROM pg_inherits i WHERE i.inhparent IN
           ('axlecast.position_chunk'::regclass, 'axlecast.position_second'::regclass)"""


def body(generator):
    """Returns the body of one chunk: 250 Hz with the jitter of a host, a sine of some turns, constant flags."""
    start, speed = generator.uniform(0, 6.28), generator.uniform(0.2, 2)
    times = [round(i * 1e6 / RATE_HZ + generator.gauss(0, 15)) for i in range(SAMPLES)]
    times = [time - times[0] for time in times]
    counts = [round(2**20 * 3 * math.sin(start + speed * i / RATE_HZ)) for i in range(SAMPLES)]
    return chunk_body.chunk(times, counts, [3] * SAMPLES, [0] * SAMPLES)


def fill(server, samples):
    """Fills the tables as a fleet of MACHINES x AXES at 250 Hz does, with at least an hour of seconds. Returns the time of the newest sample, as text."""
    generator = random.Random(1)
    streams = MACHINES * AXES
    chunks = math.ceil(samples / streams / SAMPLES)
    covered = math.ceil(chunks * SAMPLES / RATE_HZ)  # s
    seconds = max(covered, HOUR_S)  # a query reads an hour of them
    end = server.value("SELECT date_trunc('minute', now())")
    begin = f"timestamptz '{end}' - {seconds} * interval '1 s'"
    first = f"timestamptz '{end}' - {covered} * interval '1 s'"
    server.sql(f"""SELECT axlecast.ensure_partitions(({begin})::date, current_date + 1);
        INSERT INTO axlecast.machine (name, installation) SELECT 'm' || g, gen_random_uuid() FROM generate_series(1, {MACHINES}) g;
        INSERT INTO axlecast.device (machine, name) SELECT m.id, 'axis' || g FROM axlecast.machine m, generate_series(1, {AXES}) g
            ORDER BY 1, g;
        INSERT INTO axlecast.stream (device, boot_id, datum_epoch, counts_per_turn, unit, unit_per_count, seen)
            SELECT id, id, 0, 1048576, 1, 1 / 1048576.0, {begin} FROM axlecast.device ORDER BY id;
        CREATE TABLE bodies (id int, body bytea)""")
    for number in range(BODIES):
        server.sql(f"INSERT INTO bodies VALUES ({number}, '\\x{body(generator).hex()}')")
    # As the batches of shippers come: all axes of a machine, then the next machine, then the next time.
    server.sql(f"""INSERT INTO axlecast.position_chunk (t0, t1, seq0, first, last, lo, hi, mean, stream, log, n, valid, missed, flags_or, flags_and,
                                                        body)
        SELECT t0, t0 + interval '1.02 s', c * {SAMPLES}, c, c + 255, c - 300, c + 300, c + 0.5, s.id, 1, {SAMPLES}, {SAMPLES}, 0, 3, 3, b.body
        FROM generate_series(0, {chunks} - 1) c, LATERAL (SELECT {first} + c * interval '{SAMPLES / RATE_HZ} s' AS t0) t,
             axlecast.stream s JOIN bodies b ON b.id = s.id % {BODIES};
        INSERT INTO axlecast.position_second (t, lo, hi, mean, stream, n, valid, missed, flags_or, flags_and)
        SELECT {begin} + g * interval '1 s', g - 300, g + 300, g + 0.5, s.id, {RATE_HZ}, {RATE_HZ}, 0, 3, 3
        FROM generate_series(0, {seconds} - 1) g, axlecast.stream s""")
    server.sql("VACUUM ANALYZE")
    return end


def timed(server, query):
    """Returns the server's median time of a query in ms (without the client), in one session whose caches are warm, and its number of rows."""
    rows = len(server.sql(query))
    lines = server.sql(f"EXPLAIN (ANALYZE, TIMING OFF, SUMMARY ON) {query};" * (RUNS + 1))
    planning, execution = ([float(row[0].split()[-2]) for row in lines if row[0].startswith(kind)] for kind in ("Planning Time", "Execution Time"))
    return statistics.median(map(sum, list(zip(planning, execution))[1:])), rows


def measure(report, samples):
    with cluster.Cluster(shared_buffers="2GB", work_mem="32MB", max_wal_size="8GB") as server:
        server.create_database()
        subprocess.run([machine.BIN / "axlecast", "fleet", "init", server.connection()], check=True, stdout=subprocess.DEVNULL)
        began = time.monotonic()
        end = fill(server, samples)
        stored = int(server.value("SELECT sum(n) FROM axlecast.position_chunk"))
        size = int(server.value(SIZES))
        report.add("fleet: samples", "", stored, samples, at_most=False, note=f"filled in {time.monotonic() - began:.0f} s, {size / stored:.2f} B each")
        for what, query, target in (
                ("1 s min, mean, max, 10 axes, 1 h", f"SELECT device, t, lo, mean, hi FROM axlecast.seconds('m7', timestamptz '{end}' - interval '1 h', timestamptz '{end}')", 50),
                ("10 s raw of one axis", f"""SELECT * FROM axlecast.samples('m7', 'axis3', timestamptz '{end}' - interval '1 min',
                                         timestamptz '{end}' - interval '50 s')""", 20),
                ("last value of 1,000 devices", "SELECT * FROM axlecast.last_position", 50)):
            milliseconds, rows = timed(server, query)
            report.add(f"fleet: {what}", "ms", milliseconds, target, note=f"{rows} rows")
