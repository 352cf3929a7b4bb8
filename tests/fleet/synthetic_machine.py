"""Data of machines in every table of the fleet database, filled by SQL: two hours until `end`, and all samples of the last 20 s.

Axis k of a machine turns forth and back by 10 turns of 131,072 counts in 60 s; its unit is mm, 5 mm a turn."""
import datetime
import math

from chunk_body import chunk

SAMPLES_PER_S = 250
CHUNK = 250
SECONDS_OF_SAMPLES = 20
COUNTS_PER_TURN = 131072
AXES = ("axis1", "axis2")
VALID = 0x1 | 0x2 | 0x8  # position_t: FLAG_VALID, FLAG_TURNS_VALID, FLAG_REFERENCED
AFTER_GAP = 0x800


def counts_at(axis, time_s):
    return round(10 * COUNTS_PER_TURN * math.sin(2 * math.pi * time_s / 60 + axis))


def fill(cluster, machine, end, hours=2):
    """Fills the tables for one machine. `end` is a whole second."""
    start = end - datetime.timedelta(hours=hours)
    machine = machine.replace("'", "''")
    cluster.sql(f"SELECT axlecast.ensure_partitions('{start.date()}', '{end.date()}')")
    cluster.sql(f"""
INSERT INTO axlecast.machine (name, installation, shipper, shipper_since, last_batch, last_utime, lag_bytes, lag_logs)
  VALUES ('{machine}', gen_random_uuid(), 'host:1', now(), '{end}', extract(epoch FROM timestamptz '{end}') * 1e6, 123456, 1);
INSERT INTO axlecast.device (machine, name)
  SELECT id, unnest(ARRAY['axis1', 'axis2', 'gm1']) FROM axlecast.machine WHERE name = '{machine}';
INSERT INTO axlecast.stream (device, boot_id, datum_epoch, counts_per_turn, unit, unit_per_count, seen)
  SELECT d.id, 7, 0, {COUNTS_PER_TURN}, 4, 5.0 / {COUNTS_PER_TURN}, '{start}'
    FROM axlecast.device d JOIN axlecast.machine m ON m.id = d.machine WHERE m.name = '{machine}' AND d.name LIKE 'axis%';
INSERT INTO axlecast.log (machine, name, host, start_utime, file_number, file, upto, bytes, first_utime, last_utime)
  SELECT id, '{machine}', 'host', 1, 0, '{machine}.lcm', 1000, 1000000, 1, 2 FROM axlecast.machine WHERE name = '{machine}';
""")
    ids = dict(cluster.sql(f"""SELECT d.name, s.id FROM axlecast.stream s JOIN axlecast.device d ON d.id = s.device
                               JOIN axlecast.machine m ON m.id = d.machine WHERE m.name = '{machine}'"""))
    number = cluster.value(f"SELECT id FROM axlecast.machine WHERE name = '{machine}'")
    log = cluster.value(f"SELECT max(id) FROM axlecast.log WHERE machine = {number}")
    fill_positions(cluster, ids, log, start, end)
    fill_events(cluster, number, log, start, end)


def fill_positions(cluster, streams, log, start, end):
    seconds, chunks = [], []
    for axis, name in enumerate(AXES, 1):
        for i in range(int((end - start).total_seconds())):
            t = start + datetime.timedelta(seconds=i)
            values = [counts_at(axis, i + part / 4) for part in range(4)]
            missed = 1 if i % 600 == 0 else 0
            flags = VALID | (AFTER_GAP if missed else 0)
            seconds.append(f"('{t}', {min(values)}, {max(values)}, {sum(values) / 4}, {streams[name]}, 250, 250, {missed}, {flags}, {VALID})")
        chunks += [chunk_row(axis, streams[name], log, end - datetime.timedelta(seconds=i)) for i in range(SECONDS_OF_SAMPLES, 0, -1)]
    cluster.sql(f"""
INSERT INTO axlecast.position_second (t, lo, hi, mean, stream, n, valid, missed, flags_or, flags_and) VALUES {', '.join(seconds)};
INSERT INTO axlecast.position_minute (t, lo, hi, mean, n, valid, missed, stream, flags_or, flags_and)
  SELECT date_trunc('minute', t), min(lo), max(hi), avg(mean), sum(n), sum(valid), sum(missed), stream, bit_or(flags_or), bit_and(flags_and)
    FROM axlecast.position_second WHERE stream IN ({', '.join(streams.values())}) GROUP BY 1, stream;
INSERT INTO axlecast.position_chunk (t0, t1, seq0, first, last, lo, hi, mean, stream, log, n, valid, missed, flags_or, flags_and, body)
  VALUES {', '.join(chunks)};
""")


def chunk_row(axis, stream, log, start):
    times = [round(i * 1e6 / SAMPLES_PER_S) for i in range(CHUNK)]
    counts = [counts_at(axis, start.timestamp() % 60 + us / 1e6) for us in times]
    end = start + datetime.timedelta(microseconds=times[-1])
    return (f"('{start}', '{end}', 0, {counts[0]}, {counts[-1]}, {min(counts)}, {max(counts)}, {sum(counts) / CHUNK}, {stream}, {log}, "
            f"{CHUNK}, {CHUNK}, 0, {VALID}, {VALID}, '\\x{chunk(times, counts, [VALID] * CHUNK).hex()}')")


def fill_events(cluster, machine, log, start, end):
    """Every table of events, with a row each 30 s for states and some for what is rare."""
    each = f"generate_series(timestamptz '{start}', '{end}', '30 s') WITH ORDINALITY AS s (t, i)"
    cluster.sql(f"""
INSERT INTO axlecast.alarm (t, machine, device, boot_id, code, source, name, severity, state, alarm_state, text, first_utime, last_utime, count, cause,
                            message, log)
  SELECT t, {machine}, 'axis' || 1 + i % 2, 7, i, 'device', (ARRAY['battery_alarm', 'over_speed', 'overheat'])[1 + i % 3],
         (ARRAY['warning', 'error'])[1 + i / 10 % 2], (ARRAY['appeared', 'cleared'])[1 + i % 2], 'live', 'Replace the battery.', 1, 2, 1, '', '{{}}',
         {log}
    FROM {each} WHERE i % 10 < 2;
INSERT INTO axlecast.command (t, machine, device, command_id, operation, state, finding, is_final, verified, outcome, reason_code, reason, text,
                              issued_by, started, finished, boot_id, seq, message, log)
  SELECT t, {machine}, 'axis1', md5('{machine} ' || i)::uuid, 'set_zero', state, '', state <> 'issued', state <> 'issued',
         CASE WHEN state <> 'issued' THEN state END, 0, 'none', '', 'desk', t, t, 7, i, '{{}}', {log}
    FROM {each}, unnest(ARRAY['issued', 'succeeded']) AS state WHERE i % 40 = 0;
INSERT INTO axlecast.trip (t, machine, device, trip_count, factor_bits, not_before, not_after, interval_us, key, boot_id, message, log)
  SELECT t, {machine}, 'gm1', i, 4, t, t, 10000, i, 7, '{{}}', {log} FROM {each} WHERE i % 60 = 0;
INSERT INTO axlecast.device_health (t, boot_id, good, errors, machine, nv_writes, datum_epoch, device, bus, family, model, serial, firmware, state,
                                    reason, message, log, seq)
  SELECT t, 7, i * 7500, ARRAY[i / 20, 0, 0, i / 30, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], {machine}, i / 100, 0, device, 'rs485-0', 'tformat',
         'TS5669', '1', '1', CASE WHEN device = 'gm1' AND i % 24 = 1 THEN 'offline' ELSE 'online' END, '', '{{}}', {log}, i
    FROM {each}, unnest(ARRAY['axis1', 'axis2', 'gm1']) AS device;
INSERT INTO axlecast.bus_health (t, boot_id, exchanges, good, late, rx_dropped, errors, machine, utilisation, bus, family, port, state, message, log, seq)
  SELECT t, 7, i * 15000, i * 15000 - i / 10, i / 50, 0, ARRAY[i / 20, 0, 0, i / 30, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], {machine}, 0.7, 'rs485-0',
         'tformat', '/dev/ttyUSB0', 'up', '{{}}', {log}, i FROM {each};
INSERT INTO axlecast.recorder_health (t, boot_id, messages, lost, kernel_dropped, free_bytes, machine, name, state, message, log, seq)
  SELECT t, 7, i * 15000, i / 40, i / 80, 500000000000 - i * 1000000, {machine}, 'positions', 'recording', '{{}}', {log}, i FROM {each};
INSERT INTO axlecast.motor_health (t, boot_id, machine, voltage_v, current_a, power_w, temperature_c, trip_count, status_bits, flags, device, message,
                                   log, seq)
  SELECT t, 7, {machine}, 230, 4.2, 900, 40 + i % 10, i / 60, 0, 1, 'gm1', '{{}}', {log}, i FROM {each};
INSERT INTO axlecast.clock (t, boot_id, base_id, half_width_ns, utc_half_width_ns, machine, epoch, host, root, state, grade, message, log, seq)
  SELECT t, 7, 1, 40000 + i, 2000000, {machine}, 0, 'host', 'host', 'synchronised', 'claimed', '{{}}', {log}, i FROM {each};
INSERT INTO axlecast.hole (machine, log, channel, cause, t0, t1, first_event, messages, bytes, noticed)
  VALUES ({machine}, {log}, NULL, 'disk nearly full', timestamptz '{end}' - interval '1 h', timestamptz '{end}' - interval '50 min', 17, 5000, 865000,
          '{end}');
INSERT INTO axlecast.odd (machine, log, event, channel, utime, received, cause, message)
  VALUES ({machine}, {log}, 99, 'POSITION/axis1', 0, 1, 'before the first partition', '\\x00');
""")
