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

-- Seconds and minutes by the names of machine and device. value_... in `unit`; NULL without a valid sample. A second in which the driver
-- started or the datum jumped has a row for each stream. Ask for a machine and a time: WHERE machine = … AND t BETWEEN … AND …
CREATE VIEW axlecast.position_1s AS
SELECT a.machine, a.device, p.t, least(p.lo * a.unit_per_count, p.hi * a.unit_per_count) AS value_min,
       greatest(p.lo * a.unit_per_count, p.hi * a.unit_per_count) AS value_max, p.mean * a.unit_per_count AS value_mean, a.unit,
       p.lo, p.hi, p.mean, p.n, p.valid, p.missed, p.flags_or, p.flags_and, a.stream
FROM axlecast.axis a JOIN axlecast.position_second p ON p.stream = a.stream;

CREATE VIEW axlecast.position_1min AS
SELECT a.machine, a.device, p.t, least(p.lo * a.unit_per_count, p.hi * a.unit_per_count) AS value_min,
       greatest(p.lo * a.unit_per_count, p.hi * a.unit_per_count) AS value_max, p.mean * a.unit_per_count AS value_mean, a.unit,
       p.lo, p.hi, p.mean, p.n, p.valid, p.missed, p.flags_or, p.flags_and, a.stream
FROM axlecast.axis a JOIN axlecast.position_minute p ON p.stream = a.stream;

-- position_1s of all axes of one machine from from_time up to, not including, to_time. Several times as fast as the view: the axes of a
-- machine are in the same pages, which this reads once. With `+ 0` the planner cannot read the table once for each axis instead.
CREATE FUNCTION axlecast.seconds(machine text, from_time timestamptz, to_time timestamptz)
RETURNS TABLE (device text, t timestamptz, value_min float8, value_max float8, value_mean float8, unit text, lo int8, hi int8, mean float8, n int4,
               valid int4, missed int4, flags_or int4, flags_and int4, stream int4)
LANGUAGE sql STABLE PARALLEL SAFE ROWS 36000 AS $$
    WITH a AS MATERIALIZED (SELECT x.stream, x.device, x.unit, x.unit_per_count FROM axlecast.axis x WHERE x.machine = seconds.machine)
    SELECT a.device, p.t, least(p.lo * a.unit_per_count, p.hi * a.unit_per_count), greatest(p.lo * a.unit_per_count, p.hi * a.unit_per_count),
           p.mean * a.unit_per_count, a.unit, p.lo, p.hi, p.mean, p.n, p.valid, p.missed, p.flags_or, p.flags_and, p.stream
    FROM axlecast.position_second p JOIN a ON a.stream = p.stream + 0
    WHERE p.stream = ANY (ARRAY(SELECT a.stream FROM a)) AND p.t >= from_time AND p.t < to_time
$$;

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

-- The next views compute each row in a subquery of its own, by an index: a condition on machine, device and time is checked before that.

-- Per device and day of UTC: the share of readings that were valid, and the minutes with any reading. Ask for a machine and `day`.
CREATE VIEW axlecast.availability AS
SELECT m.name AS machine, d.name AS device, g.day, r.n, r.valid, r.missed, r.valid::float8 / nullif(r.n + r.missed, 0) AS valid_share, r.minutes,
       r.minutes / 1440.0::float8 AS time_share
FROM axlecast.machine m
JOIN axlecast.device d ON d.machine = m.id
CROSS JOIN LATERAL (
    SELECT min(x.first_t) AS first_t, max(x.last_t) AS last_t
    FROM axlecast.stream s
    CROSS JOIN LATERAL (SELECT (SELECT p.t FROM axlecast.position_minute p WHERE p.stream = s.id ORDER BY p.t LIMIT 1) AS first_t,
                               (SELECT p.t FROM axlecast.position_minute p WHERE p.stream = s.id ORDER BY p.t DESC LIMIT 1) AS last_t) x
    WHERE s.device = d.id) b
CROSS JOIN LATERAL generate_series(date_trunc('day', b.first_t, 'UTC'), b.last_t, interval '24 h') AS g (day)
CROSS JOIN LATERAL (
    SELECT sum(p.n) AS n, sum(p.valid) AS valid, sum(p.missed) AS missed, count(DISTINCT p.t) AS minutes
    FROM axlecast.stream s JOIN axlecast.position_minute p ON p.stream = s.id
    WHERE s.device = d.id AND p.t >= g.day AND p.t < g.day + interval '24 h') r
WHERE r.minutes > 0;

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

-- The alarms that are present now: the last transition of each, unless it is 'cleared'. Finds one alarm after the other in the index
-- alarm_last, and reads no older transition.
CREATE VIEW axlecast.present_alarms AS
SELECT m.name AS machine, a.device, a.t, a.source, a.code, a.name, a.severity, a.state, a.alarm_state, a.text, axlecast.time_of(a.first_utime) AS since,
       a.count, a.boot_id
FROM axlecast.machine m
CROSS JOIN LATERAL (
    WITH RECURSIVE last AS (
        (SELECT a.device, a.t, a.source, a.code, a.name, a.severity, a.state, a.alarm_state, a.text, a.first_utime, a.count, a.boot_id
         FROM axlecast.alarm a WHERE a.machine = m.id ORDER BY a.device, a.source, a.code, a.t DESC LIMIT 1)
        UNION ALL
        SELECT n.* FROM last l
        CROSS JOIN LATERAL (SELECT a.device, a.t, a.source, a.code, a.name, a.severity, a.state, a.alarm_state, a.text, a.first_utime, a.count, a.boot_id
                            FROM axlecast.alarm a WHERE a.machine = m.id AND (a.device, a.source, a.code) > (l.device, l.source, l.code)
                            ORDER BY a.device, a.source, a.code, a.t DESC LIMIT 1) n)
    SELECT * FROM last WHERE state <> 'cleared') a;

-- Errors per exchange of each bus, which is a cable, per hour. The counters run since the start of a driver: differences within one start
-- and one hour. errors by device_info_t ERROR_*. Ask for a machine and `hour`.
CREATE VIEW axlecast.error_rates_by_cable AS
SELECT m.name AS machine, n.bus, r.port, r.family, g.hour, r.exchanges, r.failed, r.failed::float8 / nullif(r.exchanges, 0) AS failed_share, r.timeouts,
       r.framing, r.checksum, r.late, r.rx_dropped, r.utilisation_max, r.driver_starts
FROM axlecast.machine m
CROSS JOIN LATERAL (
    WITH RECURSIVE name AS (
        (SELECT h.bus FROM axlecast.bus_health h WHERE h.machine = m.id ORDER BY h.bus LIMIT 1)
        UNION ALL
        SELECT (SELECT h.bus FROM axlecast.bus_health h WHERE h.machine = m.id AND h.bus > name.bus ORDER BY h.bus LIMIT 1) FROM name
        WHERE name.bus IS NOT NULL)
    SELECT name.bus FROM name WHERE name.bus IS NOT NULL) n
CROSS JOIN LATERAL (
    SELECT (SELECT h.t FROM axlecast.bus_health h WHERE h.machine = m.id AND h.bus = n.bus ORDER BY h.t LIMIT 1) AS first_t,
           (SELECT h.t FROM axlecast.bus_health h WHERE h.machine = m.id AND h.bus = n.bus ORDER BY h.t DESC LIMIT 1) AS last_t) b
CROSS JOIN LATERAL generate_series(date_trunc('hour', b.first_t, 'UTC'), b.last_t, interval '1 h') AS g (hour)
CROSS JOIN LATERAL (
    SELECT p.port, p.family, sum(p.exchanges) AS exchanges, sum(p.exchanges - p.good) AS failed, sum(p.timeouts) AS timeouts, sum(p.framing) AS framing,
           sum(p.checksum) AS checksum, sum(p.late) AS late, sum(p.rx_dropped) AS rx_dropped, max(p.utilisation_max) AS utilisation_max,
           count(*) AS driver_starts
    FROM (SELECT h.port, h.family, max(h.exchanges) - min(h.exchanges) AS exchanges, max(h.good) - min(h.good) AS good,
                 max(h.late) - min(h.late) AS late, max(h.rx_dropped) - min(h.rx_dropped) AS rx_dropped,
                 max(h.errors[1]) - min(h.errors[1]) AS timeouts, max(h.errors[3]) - min(h.errors[3]) AS framing,
                 max(h.errors[4]) - min(h.errors[4]) AS checksum, max(h.utilisation) AS utilisation_max
          FROM axlecast.bus_health h
          WHERE h.machine = m.id AND h.bus = n.bus AND h.t >= g.hour AND h.t < g.hour + interval '1 h'
          GROUP BY h.port, h.family, h.boot_id) p
    GROUP BY p.port, p.family) r;

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
           max(k.finished) AS finished, count(*) FILTER (WHERE (k.t, k.state, k.finding) < (c.t, c.state, c.finding)) AS earlier
    FROM axlecast.command k WHERE k.machine = c.machine AND k.command_id = c.command_id) a
WHERE a.earlier = 0;

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
