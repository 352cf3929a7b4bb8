-- Views for readers: Grafana, psql, axlecast fleet. Each states names of machines and devices, so that a query needs no other table.

CREATE FUNCTION axlecast.unit_name(unit int) RETURNS text LANGUAGE sql IMMUTABLE PARALLEL SAFE
RETURN (ARRAY['count', 'turn', 'rad', 'deg', 'mm', 'm', 'um', 'inch'])[unit + 1];

CREATE FUNCTION axlecast.time_of(unix_us int8) RETURNS timestamptz LANGUAGE sql IMMUTABLE PARALLEL SAFE
RETURN timestamptz '1970-01-01 00:00:00+00' + unix_us * interval '1 us';

-- Names of the bits of motor_health_t STATUS_*, "+" between them; empty without one.
CREATE FUNCTION axlecast.motor_status_text(bits int) RETURNS text LANGUAGE sql IMMUTABLE PARALLEL SAFE
RETURN concat_ws('+', CASE WHEN bits & 1 <> 0 THEN 'power_upper_a' END, CASE WHEN bits & 2 <> 0 THEN 'power_upper_b' END,
    CASE WHEN bits & 4 <> 0 THEN 'power_lower_a' END, CASE WHEN bits & 8 <> 0 THEN 'power_lower_b' END,
    CASE WHEN bits & 32 <> 0 THEN 'overheat' END, CASE WHEN bits & 64 <> 0 THEN 'excessive_shock' END);

CREATE VIEW axlecast.axis AS  -- devices with positions: one row per stream
SELECT m.name AS machine, d.name AS device, s.id AS stream, s.boot_id, s.datum_epoch, s.counts_per_turn, axlecast.unit_name(s.unit) AS unit,
       s.unit_per_count, s.seen
FROM axlecast.machine m JOIN axlecast.device d ON d.machine = m.id JOIN axlecast.stream s ON s.device = d.id;

-- One row per device and second (two in a second in which the driver started or the datum jumped). value_... in `unit`; NULL without a
-- valid sample. Ask for a machine and a time: WHERE machine = … AND t BETWEEN … AND …
CREATE VIEW axlecast.position_1s AS
SELECT a.machine, a.device, r.t, least(r.lo * a.unit_per_count, r.hi * a.unit_per_count) AS value_min,
       greatest(r.lo * a.unit_per_count, r.hi * a.unit_per_count) AS value_max, r.mean * a.unit_per_count AS value_mean, a.unit,
       r.lo, r.hi, r.mean, r.n, r.valid, r.missed, r.flags_or, r.flags_and, a.stream
FROM axlecast.axis a
CROSS JOIN LATERAL (
    SELECT p.t, min(p.lo) AS lo, max(p.hi) AS hi, sum(p.mean * p.valid) / nullif(sum(p.valid), 0) AS mean, sum(p.n) AS n, sum(p.valid) AS valid,
           sum(p.missed) AS missed, bit_or(p.flags_or) AS flags_or, bit_and(p.flags_and) AS flags_and
    FROM axlecast.position_second p WHERE p.stream = a.stream GROUP BY p.t) r;

-- position_1s of all axes of one machine from from_time up to, not including, to_time. Two to three times as fast as the view: the axes
-- of a machine are in the same pages, which this reads once.
CREATE FUNCTION axlecast.seconds(machine text, from_time timestamptz, to_time timestamptz)
RETURNS TABLE (device text, t timestamptz, value_min float8, value_max float8, value_mean float8, unit text, lo int8, hi int8, mean float8, n int8,
               valid int8, missed int8, flags_or int4, flags_and int4, stream int4)
LANGUAGE sql STABLE PARALLEL SAFE ROWS 36000 AS $$
    WITH a AS MATERIALIZED (SELECT x.stream, x.device, x.unit, x.unit_per_count FROM axlecast.axis x WHERE x.machine = seconds.machine)
    SELECT a.device, r.t, least(r.lo * a.unit_per_count, r.hi * a.unit_per_count), greatest(r.lo * a.unit_per_count, r.hi * a.unit_per_count),
           r.mean * a.unit_per_count, a.unit, r.lo, r.hi, r.mean, r.n, r.valid, r.missed, r.flags_or, r.flags_and, r.stream
    FROM (SELECT p.stream, p.t, min(p.lo) AS lo, max(p.hi) AS hi, sum(p.mean * p.valid) / nullif(sum(p.valid), 0) AS mean, sum(p.n) AS n,
                 sum(p.valid) AS valid, sum(p.missed) AS missed, bit_or(p.flags_or) AS flags_or, bit_and(p.flags_and) AS flags_and
          FROM axlecast.position_second p
          WHERE p.stream = ANY (ARRAY(SELECT a.stream FROM a)) AND p.t >= from_time AND p.t < to_time
          GROUP BY p.stream, p.t) r
    JOIN a ON a.stream = r.stream
$$;

CREATE VIEW axlecast.position_1min AS
SELECT a.machine, a.device, p.t, least(p.lo * a.unit_per_count, p.hi * a.unit_per_count) AS value_min,
       greatest(p.lo * a.unit_per_count, p.hi * a.unit_per_count) AS value_max, p.mean * a.unit_per_count AS value_mean, a.unit,
       p.lo, p.hi, p.mean, p.n, p.valid, p.missed, p.flags_or, p.flags_and, a.stream
FROM axlecast.axis a JOIN axlecast.position_minute p ON p.stream = a.stream;

-- The last sample of each device; the last second of devices whose samples are not stored. age: by the server's clock.
CREATE VIEW axlecast.last_position AS
SELECT m.name AS machine, d.name AS device, l.t, now() - l.t AS age, l.counts, CASE WHEN l.flags & 1 = 1 THEN l.counts * s.unit_per_count END AS value,
       axlecast.unit_name(s.unit) AS unit, l.flags, l.flags & 1 = 1 AS valid, s.id AS stream
FROM axlecast.machine m
JOIN axlecast.device d ON d.machine = m.id
CROSS JOIN LATERAL (SELECT * FROM axlecast.stream s WHERE s.device = d.id ORDER BY s.seen DESC LIMIT 1) s
LEFT JOIN LATERAL (SELECT * FROM axlecast.position_chunk c WHERE c.stream = s.id ORDER BY c.t0 DESC LIMIT 1) c ON true
LEFT JOIN LATERAL (SELECT * FROM axlecast.position_second p WHERE p.stream = s.id AND c.t0 IS NULL ORDER BY p.t DESC LIMIT 1) p ON true
CROSS JOIN LATERAL (SELECT coalesce(c.t1, p.t) AS t, coalesce(c.last::float8, p.mean) AS counts,
                           CASE WHEN c.flags_or <> c.flags_and THEN (axlecast.column_values(c.body, 3, c.n))[c.n]::int4
                                ELSE coalesce(c.flags_or, p.flags_and) END AS flags) l
WHERE l.t IS NOT NULL;

CREATE VIEW axlecast.last_state AS
SELECT m.name AS machine, d.name AS device, h.t, now() - h.t AS age, h.state, h.reason, h.bus, h.family, h.model, h.serial, h.firmware, h.boot_id,
       h.datum_epoch, h.good, h.errors, h.nv_writes
FROM axlecast.machine m
JOIN axlecast.device d ON d.machine = m.id
CROSS JOIN LATERAL (SELECT * FROM axlecast.device_health h WHERE h.machine = m.id AND h.device = d.name ORDER BY h.t DESC LIMIT 1) h;

-- Per device and day of UTC: the share of readings that were valid, and the minutes with any reading.
CREATE VIEW axlecast.availability AS
SELECT a.machine, a.device, r.day, r.n, r.valid, r.missed, r.valid::float8 / nullif(r.n + r.missed, 0) AS valid_share, r.minutes,
       r.minutes / 1440.0::float8 AS time_share
FROM (SELECT DISTINCT m.name AS machine, d.name AS device, d.id FROM axlecast.machine m JOIN axlecast.device d ON d.machine = m.id) a
CROSS JOIN LATERAL (
    SELECT date_trunc('day', p.t, 'UTC') AS day, sum(p.n) AS n, sum(p.valid) AS valid, sum(p.missed) AS missed, count(DISTINCT p.t) AS minutes
    FROM axlecast.stream s JOIN axlecast.position_minute p ON p.stream = s.id
    WHERE s.device = a.id GROUP BY 1) r;

CREATE VIEW axlecast.alarms AS
SELECT m.name AS machine, a.device, a.t, a.source, a.code, a.name, a.severity, a.state, a.alarm_state, a.text, axlecast.time_of(a.first_utime) AS since,
       a.count, a.cause, a.boot_id
FROM axlecast.alarm a JOIN axlecast.machine m ON m.id = a.machine;

-- How often each alarm appeared, per day of UTC.
CREATE VIEW axlecast.alarms_by_cause AS
SELECT m.name AS machine, a.device, a.source, a.code, a.name, a.severity, date_trunc('day', a.t, 'UTC') AS day, count(*) AS appeared,
       min(a.t) AS first_t, max(a.t) AS last_t
FROM axlecast.alarm a JOIN axlecast.machine m ON m.id = a.machine
WHERE a.state = 'appeared'
GROUP BY m.name, a.device, a.source, a.code, a.name, a.severity, date_trunc('day', a.t, 'UTC');

-- Errors per exchange of each bus, which is a cable, per hour. The counters run since the start of a driver: differences within one start
-- and one hour. errors by device_info_t ERROR_*.
CREATE VIEW axlecast.error_rates_by_cable AS
WITH per_start AS (
    SELECT h.machine, h.bus, h.port, h.family, date_trunc('hour', h.t, 'UTC') AS hour, h.boot_id, max(h.exchanges) - min(h.exchanges) AS exchanges,
           max(h.good) - min(h.good) AS good, max(h.late) - min(h.late) AS late, max(h.rx_dropped) - min(h.rx_dropped) AS rx_dropped,
           max(h.errors[1]) - min(h.errors[1]) AS timeouts, max(h.errors[3]) - min(h.errors[3]) AS framing,
           max(h.errors[4]) - min(h.errors[4]) AS checksum, max(h.utilisation) AS utilisation_max
    FROM axlecast.bus_health h GROUP BY 1, 2, 3, 4, 5, 6)
SELECT m.name AS machine, p.bus, p.port, p.family, p.hour, sum(p.exchanges) AS exchanges, sum(p.exchanges - p.good) AS failed,
       sum(p.exchanges - p.good)::float8 / nullif(sum(p.exchanges), 0) AS failed_share, sum(p.timeouts) AS timeouts, sum(p.framing) AS framing,
       sum(p.checksum) AS checksum, sum(p.late) AS late, sum(p.rx_dropped) AS rx_dropped, max(p.utilisation_max) AS utilisation_max,
       count(*) AS driver_starts
FROM per_start p JOIN axlecast.machine m ON m.id = p.machine
GROUP BY m.name, p.bus, p.port, p.family, p.hour;

CREATE VIEW axlecast.trips AS
SELECT m.name AS machine, t.device, t.t, t.trip_count, axlecast.motor_status_text(t.factor_bits) AS cause, t.not_before, t.not_after, t.interval_us,
       t.factor_bits, t.message
FROM axlecast.trip t JOIN axlecast.machine m ON m.id = t.machine;

-- Writes to non-volatile memory since the first message of a device.
CREATE VIEW axlecast.wear AS
SELECT m.name AS machine, w.device, sum(w.writes) AS writes, count(*) AS driver_starts, min(w.first_t) AS first_t, max(w.last_t) AS last_t,
       sum(w.writes) / greatest(extract(epoch FROM max(w.last_t) - min(w.first_t)) / 86400, 1)::float8 AS writes_per_day
FROM axlecast.nv_writes w JOIN axlecast.machine m ON m.id = w.machine
GROUP BY m.name, w.device;

-- One row per command. t: of its first message; outcome: NULL if none is in the database; finding: after an indeterminate outcome.
CREATE VIEW axlecast.commands AS
SELECT m.name AS machine, c.device, c.command_id, c.operation, c.t, a.changed, a.outcome, a.finding, a.verified, a.reason_code, a.reason, a.text,
       a.issued_by, a.started, a.finished
FROM axlecast.command c
JOIN axlecast.machine m ON m.id = c.machine
CROSS JOIN LATERAL (
    SELECT max(k.t) AS changed, max(k.outcome) AS outcome, max(nullif(k.finding, '')) AS finding, bool_or(k.verified) AS verified,
           max(k.reason_code) AS reason_code, (array_agg(k.reason ORDER BY k.t DESC) FILTER (WHERE k.is_final))[1] AS reason,
           (array_agg(k.text ORDER BY k.t DESC) FILTER (WHERE k.is_final))[1] AS text, max(k.issued_by) AS issued_by, max(k.started) AS started,
           max(k.finished) AS finished
    FROM axlecast.command k WHERE k.machine = c.machine AND k.command_id = c.command_id) a
WHERE NOT EXISTS (SELECT FROM axlecast.command e WHERE e.machine = c.machine AND e.command_id = c.command_id
                  AND (e.t, e.state, e.finding) < (c.t, c.state, c.finding));

CREATE VIEW axlecast.motors AS
SELECT m.name AS machine, h.device, h.t, h.voltage_v, h.current_a, h.power_w, h.temperature_c, h.accel_x_mps2, h.accel_y_mps2, h.accel_z_mps2,
       h.trip_count, axlecast.motor_status_text(h.status_bits) AS status, h.flags, h.boot_id
FROM axlecast.motor_health h JOIN axlecast.machine m ON m.id = h.machine;

CREATE VIEW axlecast.buses AS
SELECT m.name AS machine, h.bus, h.t, h.state, h.utilisation, h.exchanges, h.good, h.errors, h.late, h.rx_dropped, h.port, h.family, h.boot_id, h.message
FROM axlecast.bus_health h JOIN axlecast.machine m ON m.id = h.machine;

CREATE VIEW axlecast.recorders AS
SELECT m.name AS machine, h.name, h.t, h.state, h.messages, h.lost, h.kernel_dropped, h.free_bytes, h.boot_id
FROM axlecast.recorder_health h JOIN axlecast.machine m ON m.id = h.machine;

CREATE VIEW axlecast.clocks AS
SELECT m.name AS machine, c.host, c.t, c.state, c.grade, c.half_width_ns, c.utc_half_width_ns, c.root, c.base_id, c.epoch, c.boot_id
FROM axlecast.clock c JOIN axlecast.machine m ON m.id = c.machine;

CREATE VIEW axlecast.holes AS
SELECT m.name AS machine, h.cause, h.channel, h.t0, h.t1, h.messages, h.bytes, h.noticed, l.file, h.log, h.first_event
FROM axlecast.hole h JOIN axlecast.machine m ON m.id = h.machine LEFT JOIN axlecast.log l ON l.id = h.log;

-- One row per machine. lag: by the server's clock, how old the newest message in the database is.
CREATE VIEW axlecast.fleet_status AS
SELECT m.name AS machine, axlecast.time_of(m.last_utime) AS last_message, now() - axlecast.time_of(m.last_utime) AS lag, m.last_batch, m.lag_bytes,
       m.lag_logs, m.shipper, m.shipper_since, m.generation, m.installation, h.holes, h.lost_messages, h.last_hole, o.odd_messages, d.devices,
       r.free_bytes, r.t AS free_bytes_at
FROM axlecast.machine m
CROSS JOIN LATERAL (SELECT count(*) AS holes, coalesce(sum(h.messages), 0) AS lost_messages, max(h.noticed) AS last_hole
                    FROM axlecast.hole h WHERE h.machine = m.id) h
CROSS JOIN LATERAL (SELECT count(*) AS odd_messages FROM axlecast.odd o WHERE o.machine = m.id) o
CROSS JOIN LATERAL (SELECT count(*) AS devices FROM axlecast.device d WHERE d.machine = m.id) d
LEFT JOIN LATERAL (SELECT r.free_bytes, r.t FROM axlecast.recorder_health r WHERE r.machine = m.id ORDER BY r.t DESC LIMIT 1) r ON true;

-- Disk space of each table on the server, with its indexes.
CREATE VIEW axlecast.storage AS
SELECT c.relname::text AS kind, count(i.inhrelid) AS partitions, coalesce(sum(pg_total_relation_size(i.inhrelid)), 0)
           + CASE c.relkind WHEN 'r' THEN pg_total_relation_size(c.oid) ELSE 0 END AS bytes,
       min(substring(p.relname FROM '_p(\d+)$')) AS first_partition, r.keep
FROM pg_class c
LEFT JOIN pg_inherits i ON i.inhparent = c.oid
LEFT JOIN pg_class p ON p.oid = i.inhrelid
LEFT JOIN axlecast.retention r ON r.kind = c.relname
WHERE c.relnamespace = 'axlecast'::regnamespace AND c.relkind IN ('r', 'p') AND NOT c.relispartition
GROUP BY c.oid, c.relname, c.relkind, r.keep;
