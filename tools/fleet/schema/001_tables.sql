-- Tables of the fleet database. docs/fleet.md describes them for users. `fleet init` runs the files of this folder in the order of
-- their numbers, each once, all in one transaction. A file that was released never changes: a change is a new file.
--
-- Times are timestamptz; a column named ..._utime is UNIX time in us (int8), as in the messages. Columns of 8 bytes come first in
-- the tables with many rows: no padding.

CREATE SCHEMA axlecast;

CREATE TABLE axlecast.schema_version (
    version   int4 PRIMARY KEY,  -- number of the file
    applied   timestamptz NOT NULL DEFAULT now(),
    axlecast  text NOT NULL      -- version of the program that applied it
);

-- On the coordinator only: where the data of a machine is. The connection string has no password.
CREATE TABLE axlecast.shard (
    machine    text PRIMARY KEY,
    connection text NOT NULL CHECK (connection !~* '\mpassword\s*=')
);

-- One row per machine file's name.
CREATE TABLE axlecast.machine (
    id            int4 GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    name          text NOT NULL UNIQUE,
    installation  uuid NOT NULL,               -- of the state folder that ships it: two machines with one name differ
    generation    int8 NOT NULL DEFAULT 0,     -- a shipper with another generation than this one is fenced
    shipper       text,                        -- host and process that ship it
    shipper_since timestamptz,
    first_seen    timestamptz NOT NULL DEFAULT now(),
    last_batch    timestamptz,                 -- server's time of the last batch
    last_utime    int8,                        -- us, newest message in the database
    lag_bytes     int8,                        -- of logs that are not in the database yet
    lag_logs      int4
);

-- One row per name of a device: also those without positions.
CREATE TABLE axlecast.device (
    id      int4 GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    machine int4 NOT NULL REFERENCES axlecast.machine,
    name    text NOT NULL,
    UNIQUE (machine, name)
);

-- Positions of one device that can be compared with each other: between two starts of the driver or jumps of the datum.
CREATE TABLE axlecast.stream (
    id              int4 GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    device          int4 NOT NULL REFERENCES axlecast.device,
    boot_id         int8 NOT NULL,
    datum_epoch     int4 NOT NULL,
    counts_per_turn int8 NOT NULL,
    unit            int2 NOT NULL,   -- position_t UNIT_*
    unit_per_count  float8,          -- value = counts x unit_per_count; NULL: unknown
    -- Time of the first sample that was shipped. Streams of a device follow each other, so that any time within them gives their
    -- order: the last value of a device is in the stream with the greatest `seen`.
    seen            timestamptz NOT NULL,
    UNIQUE NULLS NOT DISTINCT (device, boot_id, datum_epoch, counts_per_turn, unit, unit_per_count)
);
CREATE INDEX stream_of_device ON axlecast.stream (device, seen);

-- The ledger: one row per log.
CREATE TABLE axlecast.log (
    id          int4 GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    machine     int4 NOT NULL REFERENCES axlecast.machine,
    name        text NOT NULL,   -- of the recorder; with the next three the identity of a log
    host        text NOT NULL,
    start_utime int8 NOT NULL,
    file_number int4 NOT NULL,
    file        text,            -- name of the file when it was last seen
    upto        int8 NOT NULL DEFAULT 0,  -- events with a number below are in the database
    bytes       int8 NOT NULL DEFAULT 0,  -- of the log up to there
    chain       int8 NOT NULL DEFAULT 0,  -- CRC-32C over the seals up to there
    closed      bool NOT NULL DEFAULT false,
    first_utime int8,
    last_utime  int8,
    machine_file bytea,          -- SHA-256 of the file in its head: a row of machine_file; NULL: not shipped yet, or none
    samples     int8 NOT NULL DEFAULT 0,  -- positions that this log has contributed
    events      int8 NOT NULL DEFAULT 0,  -- rows of the other tables that it has contributed
    UNIQUE (machine, name, host, start_utime, file_number)
);

CREATE TABLE axlecast.machine_file (
    machine    int4 NOT NULL REFERENCES axlecast.machine,
    sha256     bytea NOT NULL,
    text       text NOT NULL,
    first_seen timestamptz NOT NULL DEFAULT now(),
    PRIMARY KEY (machine, sha256)
);

-- Up to 256 consecutive samples of one stream. lo, hi and mean regard valid samples only; NULL without one.
-- body: docs/fleet.md; axlecast.column_values decodes it.
CREATE TABLE axlecast.position_chunk (
    t0        timestamptz NOT NULL,  -- of the first sample
    t1        timestamptz NOT NULL,  -- of the last one, at most one day later
    seq0      int8 NOT NULL,         -- of the first sample
    first     int8 NOT NULL,         -- counts of the first sample, valid or not
    last      int8 NOT NULL,
    lo        int8,
    hi        int8,
    mean      float8,
    stream    int4 NOT NULL,         -- no foreign key: it would cost a look-up for each row
    log       int4 NOT NULL,
    n         int4 NOT NULL,         -- samples
    valid     int4 NOT NULL,         -- of which valid
    missed    int4 NOT NULL,         -- readings that failed before these samples
    flags_or  int4 NOT NULL,         -- position_t FLAG_*
    flags_and int4 NOT NULL,
    body      bytea NOT NULL
) PARTITION BY RANGE (t0);
ALTER TABLE axlecast.position_chunk ALTER COLUMN body SET STORAGE EXTERNAL;  -- it does not compress further
CREATE INDEX position_chunk_stream ON axlecast.position_chunk (stream, t0);

-- One row per stream and second, and one per stream and minute. A batch adds to the rows that exist: this is only right because the
-- ledger makes each batch count once.
CREATE TABLE axlecast.position_second (
    t         timestamptz NOT NULL,  -- whole second
    lo        int8,                  -- counts; of valid samples; NULL without one
    hi        int8,
    mean      float8,
    stream    int4 NOT NULL,
    n         int4 NOT NULL,
    valid     int4 NOT NULL,         -- weight of mean
    missed    int4 NOT NULL,
    flags_or  int4 NOT NULL,
    flags_and int4 NOT NULL,
    PRIMARY KEY (stream, t)
) PARTITION BY RANGE (t);

CREATE TABLE axlecast.position_minute (
    t         timestamptz NOT NULL,  -- whole minute
    lo        int8,
    hi        int8,
    mean      float8,
    n         int8 NOT NULL,
    valid     int8 NOT NULL,
    missed    int8 NOT NULL,
    stream    int4 NOT NULL,
    flags_or  int4 NOT NULL,
    flags_and int4 NOT NULL,
    PRIMARY KEY (stream, t)
) PARTITION BY RANGE (t);  -- by month

-- Ordinary rows. `message` is the whole message as JSON, `seq` its number by its sender, `log` where it was recorded.

CREATE TABLE axlecast.alarm (
    t           timestamptz NOT NULL,
    machine     int4 NOT NULL,
    device      text NOT NULL,
    boot_id     int8 NOT NULL,
    code        int4 NOT NULL,
    source      text NOT NULL,   -- device, driver, bus, bridge, recorder, mqtt, ship
    name        text NOT NULL,
    severity    text NOT NULL,   -- info, warning, error, critical
    state       text NOT NULL CHECK (state IN ('appeared', 'changed', 'cleared')),
    alarm_state text NOT NULL,   -- alarm_entry_t STATE_*: live, device_latched, driver_latched, unacknowledged, shelved, unknown
    text        text NOT NULL,   -- what the operator should do
    first_utime int8 NOT NULL,   -- us, since when it has been present
    last_utime  int8 NOT NULL,   -- us, when it was last seen
    count       int4 NOT NULL,   -- times that it appeared since the driver started
    cause       text NOT NULL,   -- of 'cleared': '', or 'restarted': the program has restarted since, and nothing cleared the alarm
    message     jsonb NOT NULL,  -- alarm_entry_t
    log         int4 NOT NULL,
    UNIQUE (machine, device, boot_id, source, code, first_utime, state, t)
);
CREATE INDEX alarm_time ON axlecast.alarm (t);
CREATE INDEX alarm_machine ON axlecast.alarm (machine, t);
CREATE INDEX alarm_device ON axlecast.alarm (machine, device, t);
CREATE INDEX alarm_last ON axlecast.alarm (machine, device, source, code, t DESC);  -- what is present now

-- One row for a command as its client sent it, one for its final outcome, and one for each finding after that. The bridge repeats a
-- status: only the first is kept.
CREATE TABLE axlecast.command (
    t           timestamptz NOT NULL,
    machine     int4 NOT NULL,
    device      text NOT NULL,
    command_id  uuid NOT NULL,
    operation   text NOT NULL,
    state       text NOT NULL,   -- command_status_t STATE_*; issued, prepare_issued, commit_issued, cancel_issued: the client's message
    finding     text NOT NULL,   -- command_status_t FINDING_*; '': the row is not about a finding
    is_final    bool NOT NULL,
    verified    bool NOT NULL,
    outcome     text,            -- of a final state: the state; NULL before
    reason_code int4 NOT NULL,
    reason      text,            -- name of the reason code
    text        text NOT NULL,
    issued_by   text,            -- name or id of the key; NULL: unknown
    started     timestamptz,
    finished    timestamptz,
    boot_id     int8 NOT NULL,   -- of the bridge, or of the client
    seq         int8 NOT NULL,
    message     jsonb NOT NULL,
    log         int4 NOT NULL,
    UNIQUE (machine, command_id, state, finding)
);
CREATE INDEX command_time ON axlecast.command (t);
CREATE INDEX command_machine ON axlecast.command (machine, t);
CREATE INDEX command_device ON axlecast.command (machine, device, t);

-- A driver repeats its newest trip, and reads all again after a start: `key` is made of the content, so that each is one row.
CREATE TABLE axlecast.trip (
    t           timestamptz NOT NULL,  -- when the log was read
    machine     int4 NOT NULL,
    device      text NOT NULL,
    trip_count  int4 NOT NULL,
    factor_bits int4 NOT NULL,         -- motor_health_t STATUS_*
    not_before  timestamptz,
    not_after   timestamptz,
    interval_us int4 NOT NULL,
    key         int8 NOT NULL,
    boot_id     int8 NOT NULL,
    message     jsonb NOT NULL,
    log         int4 NOT NULL,
    UNIQUE (machine, device, key)
);
CREATE INDEX trip_time ON axlecast.trip (t);

CREATE TABLE axlecast.device_health (
    t           timestamptz NOT NULL,
    boot_id     int8 NOT NULL,
    good        int8 NOT NULL,
    errors      int8[] NOT NULL,       -- by device_info_t ERROR_*
    machine     int4 NOT NULL,
    nv_writes   int4 NOT NULL,
    datum_epoch int4 NOT NULL,
    device      text NOT NULL,
    bus         text NOT NULL,
    family      text NOT NULL,
    model       text NOT NULL,
    serial      text NOT NULL,
    firmware    text NOT NULL,
    state       text NOT NULL,         -- starting, online, degraded, offline
    reason      text NOT NULL,
    message     jsonb NOT NULL,
    log         int4 NOT NULL,
    seq         int8 NOT NULL
) PARTITION BY RANGE (t);
CREATE INDEX device_health_device ON axlecast.device_health (machine, device, t);

CREATE TABLE axlecast.bus_health (
    t           timestamptz NOT NULL,
    boot_id     int8 NOT NULL,
    exchanges   int8 NOT NULL,         -- since the driver started, as the next four
    good        int8 NOT NULL,
    late        int8 NOT NULL,
    rx_dropped  int8 NOT NULL,
    errors      int8[] NOT NULL,       -- by device_info_t ERROR_*
    machine     int4 NOT NULL,
    utilisation float4,
    bus         text NOT NULL,
    family      text NOT NULL,
    port        text NOT NULL,
    state       text NOT NULL,         -- starting, up, degraded, down
    message     jsonb NOT NULL,
    log         int4 NOT NULL,
    seq         int8 NOT NULL
) PARTITION BY RANGE (t);
CREATE INDEX bus_health_bus ON axlecast.bus_health (machine, bus, t);

CREATE TABLE axlecast.recorder_health (
    t              timestamptz NOT NULL,
    boot_id        int8 NOT NULL,
    messages       int8 NOT NULL,      -- since the recorder started, as the next two
    lost           int8 NOT NULL,
    kernel_dropped int8 NOT NULL,
    free_bytes     int8 NOT NULL,      -- of the machine's disk
    machine        int4 NOT NULL,
    name           text NOT NULL,
    state          text NOT NULL,      -- recording, pre_trigger, disk_full, error, stopping
    message        jsonb NOT NULL,
    log            int4 NOT NULL,
    seq            int8 NOT NULL
) PARTITION BY RANGE (t);
CREATE INDEX recorder_health_machine ON axlecast.recorder_health (machine, t);

CREATE TABLE axlecast.motor_health (
    t           timestamptz NOT NULL,
    boot_id     int8 NOT NULL,
    machine     int4 NOT NULL,
    voltage_v     float4,              -- NULL: unknown, as the next four
    current_a     float4,
    power_w       float4,
    temperature_c float4,
    accel_x_mps2  float4,
    accel_y_mps2  float4,
    accel_z_mps2  float4,
    trip_count  int4 NOT NULL,
    status_bits int4 NOT NULL,
    flags       int4 NOT NULL,
    device      text NOT NULL,
    message     jsonb NOT NULL,
    log         int4 NOT NULL,
    seq         int8 NOT NULL
) PARTITION BY RANGE (t);
CREATE INDEX motor_health_device ON axlecast.motor_health (machine, device, t);

-- TIME/<host>: what a host knows about the time of the machine.
CREATE TABLE axlecast.clock (
    t                 timestamptz NOT NULL,
    boot_id           int8 NOT NULL,
    base_id           int8 NOT NULL,
    half_width_ns     int8,            -- NULL: no claim
    utc_half_width_ns int8,            -- NULL: no claim
    machine           int4 NOT NULL,
    epoch             int4 NOT NULL,
    host              text NOT NULL,
    root              text NOT NULL,
    state             text NOT NULL,   -- starting, synchronised, holdover, lost
    grade             text NOT NULL,   -- none, assumed, claimed, proven
    message           jsonb NOT NULL,
    log               int4 NOT NULL,
    seq               int8 NOT NULL
) PARTITION BY RANGE (t);
CREATE INDEX clock_host ON axlecast.clock (machine, host, t);

-- Writes to the non-volatile memory of a device by one driver process. Kept without end: a trigger of device_health fills it.
CREATE TABLE axlecast.nv_writes (
    machine  int4 NOT NULL,
    device   text NOT NULL,
    boot_id  int8 NOT NULL,
    writes   int4 NOT NULL,
    first_t  timestamptz NOT NULL,
    last_t   timestamptz NOT NULL,
    PRIMARY KEY (machine, device, boot_id)
);

-- Records of a log, unchanged: zstd of LCM records. For channels with `raw: true`.
CREATE TABLE axlecast.raw (
    t0          timestamptz NOT NULL,
    t1          timestamptz NOT NULL,
    first_event int8 NOT NULL,
    crc32c      int8 NOT NULL,         -- of the records before compression
    log         int4 NOT NULL,
    n           int4 NOT NULL,
    records     bytea NOT NULL
) PARTITION BY RANGE (t0);
ALTER TABLE axlecast.raw ALTER COLUMN records SET STORAGE EXTERNAL;
CREATE INDEX raw_log ON axlecast.raw (log, first_event);

-- Messages that will never be in the database.
CREATE TABLE axlecast.hole (
    machine     int4 NOT NULL,
    log         int4,                  -- NULL: not in a log
    channel     text,                  -- NULL: all channels
    cause       text NOT NULL,
    t0          timestamptz,
    t1          timestamptz,
    first_event int8,
    messages    int8,                  -- NULL: unknown
    bytes       int8,
    noticed     timestamptz NOT NULL DEFAULT now(),
    UNIQUE NULLS NOT DISTINCT (machine, log, channel, cause, first_event)
);

-- Messages whose time is outside the range of the partitions: unchanged.
CREATE TABLE axlecast.odd (
    machine  int4 NOT NULL,
    log      int4 NOT NULL,
    event    int8 NOT NULL,
    channel  text NOT NULL,
    utime    int8 NOT NULL,            -- of the message
    received int8 NOT NULL,            -- of its record in the log
    cause    text NOT NULL,
    message  bytea NOT NULL,
    noticed  timestamptz NOT NULL DEFAULT now(),
    PRIMARY KEY (log, event)
);

-- How long rows of a table are kept; NULL: without end. axlecast.expire() deletes what is older.
CREATE TABLE axlecast.retention (
    kind text PRIMARY KEY,
    keep interval CHECK (keep >= interval '1 day')
);
INSERT INTO axlecast.retention (kind, keep) VALUES
    ('position_chunk', '14 days'), ('position_second', '90 days'), ('position_minute', '5 years'), ('raw', '14 days'),
    ('device_health', '90 days'), ('bus_health', '90 days'), ('recorder_health', '90 days'), ('motor_health', '90 days'),
    ('clock', '14 days'), ('alarm', NULL), ('command', NULL), ('trip', NULL), ('hole', NULL), ('odd', '1 year'), ('received', '1 year');
-- When axlecast.expire() was last called: one row.
CREATE TABLE axlecast.expiry (
    only_row bool PRIMARY KEY DEFAULT true CHECK (only_row),
    finished timestamptz NOT NULL
);
CREATE INDEX hole_machine ON axlecast.hole (machine, noticed);
CREATE INDEX odd_machine ON axlecast.odd (machine);
