-- Reading across shards: docs/fleet.md, "Shards". Run it as a superuser of PostgreSQL on the coordinator, after `axlecast fleet init` there:
--
--     psql -d axlecast -f /usr/share/axlecast/fleet/coordinator.sql
--     INSERT INTO axlecast.shard VALUES ('press3', 'host=db3,db4 dbname=axlecast user=axlecast_press'), ...;
--     SELECT axlecast.attach_shards('axlecast_reader_login', 'its password');
--
-- It makes the schema `fleet` with the names of the schema `axlecast`: each view that has a column `machine text`, and each function whose
-- first argument is `machine text`. Nothing here writes to a shard: a shipper connects to the shard of its machine.

\set ON_ERROR_STOP on
BEGIN;

CREATE EXTENSION IF NOT EXISTS postgres_fdw;
CREATE EXTENSION IF NOT EXISTS dblink;  -- calls the functions of a shard, which postgres_fdw cannot

-- Splits a connection string of libpq into its settings.
CREATE OR REPLACE FUNCTION axlecast.connection_settings(connection text) RETURNS TABLE (name text, value text)
LANGUAGE plpgsql IMMUTABLE AS $$
DECLARE
    setting CONSTANT text := $re$(\w+)\s*=\s*('(?:[^'\\]|\\.)*'|[^\s']+)$re$;
BEGIN
    IF regexp_replace(connection, setting, '', 'g') !~ '^\s*$' THEN
        RAISE EXCEPTION 'axlecast.shard: the connection "%" is not a list of name=value', connection
            USING HINT = 'Write host=db1,db2 dbname=axlecast user=axlecast_press; URIs are not understood here.';
    END IF;
    RETURN QUERY
        SELECT part[1], CASE WHEN part[2] LIKE '''%' THEN regexp_replace(substr(part[2], 2, length(part[2]) - 2), '\\(.)', '\1', 'g')
                             ELSE part[2] END
          FROM regexp_matches(connection, setting, 'g') AS part;
END $$;

-- Returns the name of the foreign server of a connection: connections that differ in their user only are one shard.
CREATE OR REPLACE FUNCTION axlecast.shard_server(connection text) RETURNS text LANGUAGE sql IMMUTABLE AS $$
    SELECT 'shard_' || left(md5(string_agg(name || '=' || value, ' ' ORDER BY name)), 12)
      FROM axlecast.connection_settings(connection) WHERE name <> 'user'
$$;

-- Returns the foreign server that has the data of a machine.
CREATE OR REPLACE FUNCTION axlecast.server_of(machine text) RETURNS text LANGUAGE plpgsql STABLE AS $$
DECLARE
    found_server text := (SELECT axlecast.shard_server(s.connection) FROM axlecast.shard s WHERE s.machine = server_of.machine);
BEGIN
    IF found_server IS NULL THEN
        RAISE EXCEPTION 'axlecast.shard has no row for the machine "%"', machine USING HINT = 'SELECT machine FROM axlecast.shard';
    END IF;
    RETURN found_server;
END $$;

-- Makes the foreign servers from axlecast.shard. `reader` and `password`: a login of every shard that is a member of axlecast_reader. Without a
-- password the server of the coordinator authenticates itself in another way: a certificate, ~postgres/.pgpass, or peer.
-- keepalives and tcp_user_timeout: a shard whose host has vanished fails within 15 s instead of hanging. fdw_tuple_cost and
-- use_remote_estimate: there are no statistics of remote rows here, and the planner would regard their journey as cheap.
CREATE OR REPLACE FUNCTION axlecast.make_shard_servers(reader text, password text) RETURNS void LANGUAGE plpgsql AS $$
DECLARE
    shard record;
BEGIN
    FOR shard IN SELECT DISTINCT ON (axlecast.shard_server(connection)) axlecast.shard_server(connection) AS server, connection
                   FROM axlecast.shard LOOP
        EXECUTE format('CREATE SERVER %I FOREIGN DATA WRAPPER postgres_fdw OPTIONS (%s)', shard.server,
            (SELECT string_agg(format('%I %L', name, value), ', ') FROM (
                SELECT name, value FROM axlecast.connection_settings(shard.connection) WHERE name <> 'user'
                UNION ALL
                SELECT * FROM (VALUES ('connect_timeout', '3'), ('keepalives_idle', '5'), ('keepalives_interval', '3'),
                                      ('keepalives_count', '3'), ('tcp_user_timeout', '15000')) AS ours(name, value)
                 WHERE name NOT IN (SELECT name FROM axlecast.connection_settings(shard.connection))
                UNION ALL
                VALUES ('fetch_size', '10000'), ('async_capable', 'true'), ('updatable', 'false'), ('fdw_tuple_cost', '1'),
                       ('use_remote_estimate', 'true')) AS options));
        EXECUTE format('CREATE USER MAPPING FOR PUBLIC SERVER %I OPTIONS (user %L, %s)', shard.server, reader,
            CASE WHEN password IS NULL THEN 'password_required ''false''' ELSE format('password %L', password) END);
        EXECUTE format('CREATE FOREIGN TABLE fleet.%I (version int4) SERVER %I OPTIONS (schema_name ''axlecast'', table_name ''schema_version'')',
            'schema_version ' || shard.server, shard.server);
    END LOOP;
END $$;

-- Makes fleet.`name`: a table that is partitioned by machine, with a foreign partition for each shard. A WHERE with constant names of machines
-- asks their shards only; with `machine` in GROUP BY the shards aggregate at once, and only results travel.
CREATE OR REPLACE FUNCTION axlecast.make_shard_table(name text, source regclass) RETURNS void LANGUAGE plpgsql AS $$
DECLARE
    shard record;
BEGIN
    EXECUTE format('CREATE TABLE fleet.%I (%s) PARTITION BY LIST (machine)', name,
        (SELECT string_agg(format('%I %s', attname, format_type(atttypid, atttypmod)), ', ' ORDER BY attnum)
           FROM pg_attribute WHERE attrelid = source AND attnum > 0 AND NOT attisdropped));
    FOR shard IN SELECT axlecast.shard_server(connection) AS server, string_agg(quote_literal(machine), ', ' ORDER BY machine) AS machines
                   FROM axlecast.shard GROUP BY 1 LOOP
        EXECUTE format('CREATE FOREIGN TABLE fleet.%I PARTITION OF fleet.%I FOR VALUES IN (%s) SERVER %I '
                       'OPTIONS (schema_name ''axlecast'', table_name %L)', left(name, 40) || ' ' || shard.server, name, shard.machines,
                       shard.server, (SELECT relname FROM pg_class WHERE oid = source));
    END LOOP;
END $$;

-- Makes fleet.`name` for a function of the schema axlecast: it runs on the shard of the machine.
CREATE OR REPLACE FUNCTION axlecast.make_shard_function(source regprocedure) RETURNS void LANGUAGE plpgsql AS $$
DECLARE
    result text := pg_get_function_result(source);
    name text := (SELECT proname FROM pg_proc WHERE oid = source);
    dblink text := (SELECT format('%I.dblink', n.nspname) FROM pg_extension e JOIN pg_namespace n ON n.oid = e.extnamespace
                     WHERE e.extname = 'dblink');
    inputs int := (SELECT pronargs FROM pg_proc WHERE oid = source);
BEGIN
    EXECUTE format(
        'CREATE FUNCTION fleet.%I(%s) RETURNS %s LANGUAGE sql VOLATILE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS %L',
        name, pg_get_function_arguments(source), result,
        format('SELECT * FROM %s(axlecast.server_of($1), format(%L, %s)) AS remote(%s)', dblink,
            format('SELECT * FROM axlecast.%I(%s)', name, (SELECT string_agg('%L', ', ') FROM generate_series(1, inputs))),
            (SELECT string_agg('$' || i, ', ') FROM generate_series(1, inputs) i),
            substr(result, 7, length(result) - 7)));  -- of TABLE(...)
END $$;

-- Reads fleet.`kind` shard by shard: a shard that does not answer costs its machines only, and a warning. Each shard is asked for all its rows:
-- for tables with few. SELECT * FROM axlecast.living(NULL::fleet.alarms, 't > now() - interval ''1 h''')
CREATE OR REPLACE FUNCTION axlecast.living(kind anyelement, condition text DEFAULT 'true') RETURNS SETOF anyelement
LANGUAGE plpgsql STABLE AS $$
DECLARE
    part record;
BEGIN
    FOR part IN SELECT i.inhrelid::regclass AS name, s.srvname AS server
                  FROM pg_type t JOIN pg_inherits i ON i.inhparent = t.typrelid
                  JOIN pg_foreign_table f ON f.ftrelid = i.inhrelid JOIN pg_foreign_server s ON s.oid = f.ftserver
                 WHERE t.oid = pg_typeof(kind) ORDER BY s.srvname LOOP
        BEGIN
            RETURN QUERY EXECUTE format('SELECT * FROM %s WHERE %s', part.name, condition);
        EXCEPTION WHEN sqlclient_unable_to_establish_sqlconnection OR connection_exception OR connection_failure OR fdw_error
                    OR admin_shutdown OR crash_shutdown OR cannot_connect_now OR too_many_connections THEN
            RAISE WARNING '%: machines of this shard are missing: %', part.server, SQLERRM;
        END;
    END LOOP;
END $$;

-- Makes the schema fleet from axlecast.shard, and drops an earlier one with all that depends on it. Call it after each change of that table
-- and after each `axlecast fleet init`. It asks no shard: one may be away.
CREATE OR REPLACE FUNCTION axlecast.attach_shards(reader text, password text DEFAULT NULL) RETURNS void LANGUAGE plpgsql
SET client_min_messages = warning AS $$
DECLARE
    one record;
BEGIN
    IF NOT EXISTS (SELECT FROM axlecast.shard) THEN
        RAISE EXCEPTION 'axlecast.shard has no rows' USING HINT = 'INSERT INTO axlecast.shard (machine, connection) VALUES (...)';
    END IF;
    DROP SCHEMA IF EXISTS fleet CASCADE;
    FOR one IN SELECT srvname FROM pg_foreign_server WHERE srvname ~ '^shard_[0-9a-f]{12}$' LOOP
        EXECUTE format('DROP SERVER %I CASCADE', one.srvname);
    END LOOP;
    CREATE SCHEMA fleet;
    PERFORM axlecast.make_shard_servers(reader, password);
    FOR one IN SELECT c.oid::regclass AS source, c.relname
                 FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid AND a.attname = 'machine' AND a.atttypid = 'text'::regtype
                WHERE c.relnamespace = 'axlecast'::regnamespace AND c.relkind = 'v' LOOP
        PERFORM axlecast.make_shard_table(CASE one.relname WHEN 'fleet_status' THEN 'fleet_status of shards' ELSE one.relname END, one.source);
    END LOOP;
    -- The list of machines, which is read first, has no machine of a shard that is away.
    CREATE VIEW fleet.fleet_status AS SELECT * FROM axlecast.living(NULL::fleet."fleet_status of shards");
    FOR one IN SELECT oid::regprocedure AS source FROM pg_proc
                WHERE pronamespace = 'axlecast'::regnamespace AND proretset AND proargnames[1] = 'machine' AND proargtypes[0] = 'text'::regtype
                  AND pg_get_function_result(oid) LIKE 'TABLE(%' LOOP
        PERFORM axlecast.make_shard_function(one.source);
    END LOOP;
    GRANT USAGE ON SCHEMA fleet TO axlecast_reader;
    GRANT SELECT ON ALL TABLES IN SCHEMA fleet TO axlecast_reader;
    EXECUTE format('ALTER DATABASE %I SET enable_partitionwise_aggregate = on', current_database());
END $$;

-- Lists the shards: does each answer, and has it the schema of the coordinator?
CREATE OR REPLACE FUNCTION axlecast.shards() RETURNS TABLE (server text, hosts text, machines text[], version int4, problem text)
LANGUAGE plpgsql STABLE AS $$
DECLARE
    own int4 := (SELECT max(v.version) FROM axlecast.schema_version v);
    detail text;
BEGIN
    FOR server, hosts, machines IN
        SELECT axlecast.shard_server(s.connection), min((SELECT c.value FROM axlecast.connection_settings(s.connection) c WHERE c.name = 'host')),
               array_agg(s.machine ORDER BY s.machine) FROM axlecast.shard s GROUP BY 1 ORDER BY 1 LOOP
        version := NULL;
        problem := NULL;
        BEGIN
            EXECUTE format('SELECT max(version) FROM fleet.%I', 'schema_version ' || server) INTO version;
            IF version IS DISTINCT FROM own THEN
                problem := format('schema version %s, the coordinator has %s: run `axlecast fleet init` on the older one', version, own);
            END IF;
        EXCEPTION WHEN OTHERS THEN
            GET STACKED DIAGNOSTICS detail = PG_EXCEPTION_DETAIL;
            problem := concat_ws(': ', SQLERRM, nullif(detail, ''));
        END;
        RETURN NEXT;
    END LOOP;
END $$;

GRANT SELECT ON axlecast.shard, axlecast.schema_version TO axlecast_reader;
REVOKE ALL ON FUNCTION axlecast.attach_shards, axlecast.make_shard_servers, axlecast.make_shard_table, axlecast.make_shard_function FROM PUBLIC;

COMMIT;
