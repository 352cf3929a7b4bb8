-- Partitions and retention. Partitions are by day of UTC, those of position_minute by month: position_chunk_p20261127,
-- position_minute_p202611. There is no DEFAULT partition: with a stranger in it, the partition of its day could not be made any more.

CREATE FUNCTION axlecast.partition_step(kind text) RETURNS text LANGUAGE sql IMMUTABLE
RETURN CASE kind WHEN 'position_minute' THEN 'month' ELSE 'day' END;

-- Makes the partitions of all tables for the days from_day to to_day (UTC), as far as they are within 10 years back and 8 days ahead of
-- the server's clock. Returns the number of new partitions. Call it outside of a batch: other callers wait for its transaction. A writer
-- may call it, although it may not create tables.
CREATE FUNCTION axlecast.ensure_partitions(from_day date, to_day date) RETURNS int
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp SET TimeZone = 'UTC' AS $$
DECLARE
    first_day date := greatest(from_day, current_date - interval '10 years');
    last_day  date := least(to_day, current_date + 8);
    parent    text;
    step      text;
    part      text;
    day       timestamp;
    made      int := 0;
BEGIN
    FOR parent IN SELECT relname FROM pg_class WHERE relnamespace = 'axlecast'::regnamespace AND relkind = 'p' ORDER BY relname LOOP
        step := axlecast.partition_step(parent);
        FOR day IN SELECT generate_series(date_trunc(step, first_day::timestamp), last_day, ('1 ' || step)::interval) LOOP
            part := parent || '_p' || to_char(day, CASE step WHEN 'day' THEN 'YYYYMMDD' ELSE 'YYYYMM' END);
            CONTINUE WHEN to_regclass('axlecast.' || part) IS NOT NULL;
            PERFORM pg_advisory_xact_lock(hashtext('axlecast.ensure_partitions'));
            CONTINUE WHEN to_regclass('axlecast.' || part) IS NOT NULL;  -- made while this call waited
            -- ATTACH disturbs no reader and no writer, as CREATE TABLE … PARTITION OF would.
            EXECUTE format('CREATE TABLE axlecast.%I (LIKE axlecast.%I INCLUDING DEFAULTS INCLUDING CONSTRAINTS INCLUDING STORAGE)', part, parent);
            EXECUTE format('ALTER TABLE axlecast.%I ATTACH PARTITION axlecast.%I FOR VALUES FROM (%L) TO (%L)',
                           parent, part, day || '+00', day + ('1 ' || step)::interval || '+00');
            made := made + 1;
        END LOOP;
    END LOOP;
    RETURN made;
END $$;

-- Deletes what axlecast.retention allows to delete, and makes the partitions of the next 8 days. Returns a row for each table from which
-- something was deleted. A partition that a long query uses stays until the next call. Every shipper calls it about once an hour with
-- unless_within: nothing is done if another call has finished within this time, or is running.
CREATE FUNCTION axlecast.expire(unless_within interval DEFAULT NULL, OUT kind text, OUT partitions int, OUT deleted_rows int8) RETURNS SETOF record
LANGUAGE plpgsql SECURITY DEFINER SET search_path = pg_catalog, pg_temp SET TimeZone = 'UTC' SET lock_timeout = '2s' AS $$
DECLARE
    rule axlecast.retention;
    part text;
BEGIN
    IF NOT pg_try_advisory_xact_lock(hashtext('axlecast.expire')) THEN RETURN; END IF;
    -- With the lock: a call that has just finished is seen.
    IF EXISTS (SELECT FROM axlecast.expiry e WHERE e.finished > now() - unless_within) THEN RETURN; END IF;
    INSERT INTO axlecast.expiry (finished) VALUES (now()) ON CONFLICT (only_row) DO UPDATE SET finished = excluded.finished;
    PERFORM axlecast.ensure_partitions(current_date, current_date + 8);
    FOR rule IN SELECT * FROM axlecast.retention r WHERE r.keep IS NOT NULL ORDER BY r.kind LOOP
        kind := rule.kind;
        partitions := 0;
        deleted_rows := 0;
        FOR part IN
            SELECT c.relname FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid
            WHERE i.inhparent = to_regclass('axlecast.' || quote_ident(rule.kind))
              AND to_date(substring(c.relname FROM '_p(\d+)$'), 'YYYYMMDD') + ('1 ' || axlecast.partition_step(rule.kind))::interval
                  <= now() - rule.keep
            ORDER BY c.relname
        LOOP
            BEGIN
                EXECUTE format('DROP TABLE axlecast.%I', part);
                partitions := partitions + 1;
            EXCEPTION WHEN lock_not_available OR deadlock_detected THEN
                RAISE NOTICE 'partition % is in use, and is dropped later', part;
            END;
        END LOOP;
        IF rule.kind IN ('alarm', 'command', 'trip') THEN
            EXECUTE format('DELETE FROM axlecast.%I WHERE t < now() - $1', rule.kind) USING rule.keep;
            GET DIAGNOSTICS deleted_rows = ROW_COUNT;
        ELSIF rule.kind IN ('hole', 'odd') THEN
            EXECUTE format('DELETE FROM axlecast.%I WHERE noticed < now() - $1', rule.kind) USING rule.keep;
            GET DIAGNOSTICS deleted_rows = ROW_COUNT;
        ELSIF rule.kind = 'received' THEN
            BEGIN
                deleted_rows := axlecast.expire_received(now() - rule.keep);
            EXCEPTION WHEN lock_not_available OR deadlock_detected THEN
                RAISE NOTICE 'runs of axlecast.received are in use, and are deleted later';
            END;
        END IF;
        IF partitions > 0 OR deleted_rows > 0 THEN RETURN NEXT; END IF;
    END LOOP;
END $$;

-- Keeps what device_health reports of writes to non-volatile memory: its partitions are dropped some day.
CREATE FUNCTION axlecast.keep_nv_writes() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO axlecast.nv_writes AS kept (machine, device, boot_id, writes, first_t, last_t)
    SELECT h.machine, h.device, h.boot_id, max(h.nv_writes), min(h.t), max(h.t) FROM arrived h GROUP BY 1, 2, 3 ORDER BY 1, 2, 3
    ON CONFLICT (machine, device, boot_id) DO UPDATE
    SET writes = greatest(kept.writes, excluded.writes), first_t = least(kept.first_t, excluded.first_t),
        last_t = greatest(kept.last_t, excluded.last_t);
    RETURN NULL;
END $$;
CREATE TRIGGER keep_nv_writes AFTER INSERT ON axlecast.device_health REFERENCING NEW TABLE AS arrived
    FOR EACH STATEMENT EXECUTE FUNCTION axlecast.keep_nv_writes();

SELECT axlecast.ensure_partitions(current_date - 1, current_date + 8);
