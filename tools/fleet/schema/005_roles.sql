-- Groups without a login: `fleet init --writer NAME --reader NAME` makes logins that are members. They belong to the server, not to the
-- database, so that they may exist already.

DO $$
DECLARE
    role text;
BEGIN
    FOREACH role IN ARRAY ARRAY['axlecast_writer', 'axlecast_reader'] LOOP
        IF NOT EXISTS (SELECT FROM pg_catalog.pg_roles WHERE rolname = role) THEN
            EXECUTE format('CREATE ROLE %I NOLOGIN', role);
        END IF;
    END LOOP;
END $$;

GRANT USAGE ON SCHEMA axlecast TO axlecast_writer, axlecast_reader;
GRANT SELECT ON ALL TABLES IN SCHEMA axlecast TO axlecast_writer, axlecast_reader;

-- A shipper adds rows, and changes those that count. It deletes nothing.
GRANT INSERT ON axlecast.machine, axlecast.device, axlecast.stream, axlecast.log, axlecast.machine_file, axlecast.position_chunk, axlecast.position_second,
    axlecast.position_minute, axlecast.alarm, axlecast.command, axlecast.trip, axlecast.device_health, axlecast.bus_health, axlecast.recorder_health,
    axlecast.motor_health, axlecast.clock, axlecast.nv_writes, axlecast.raw, axlecast.hole, axlecast.odd TO axlecast_writer;
GRANT UPDATE ON axlecast.machine, axlecast.log, axlecast.position_second, axlecast.position_minute, axlecast.nv_writes TO axlecast_writer;

-- Functions may be called by all by default; these change the database.
REVOKE EXECUTE ON FUNCTION axlecast.ensure_partitions(date, date), axlecast.expire(interval) FROM PUBLIC;
GRANT EXECUTE ON FUNCTION axlecast.ensure_partitions(date, date), axlecast.expire(interval) TO axlecast_writer;

-- Compiling a query takes longer than the queries of a chart: 800 ms where the query takes 60 ms.
DO $$
BEGIN
    EXECUTE format('ALTER DATABASE %I SET jit = off', current_database());
EXCEPTION WHEN insufficient_privilege THEN
    RAISE WARNING 'jit stays on, because only the owner of the database may change it: ALTER DATABASE % SET jit = off', current_database();
END $$;
