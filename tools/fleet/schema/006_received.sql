-- Which messages the logs contain, by their numbers: what was sent and is in no log.

-- A run of messages of one publisher without a gap. Every publisher (boot_id) numbers its messages of a channel from 0. A log has several
-- runs of a channel if messages are missing between them.
CREATE TABLE axlecast.received (
    t0        timestamptz NOT NULL,  -- reception of the first message
    t1        timestamptz NOT NULL,  -- reception of the last message
    boot_id   int8 NOT NULL,
    first_seq int8 NOT NULL,
    last_seq  int8 NOT NULL,
    machine   int4 NOT NULL,
    log       int4 NOT NULL,
    channel   text NOT NULL
);
-- Neither has last_seq or t1, so that a run grows without a change of an index.
CREATE INDEX received_run ON axlecast.received (log, channel, boot_id);
CREATE INDEX received_channel ON axlecast.received (machine, channel, boot_id, first_seq);
CREATE INDEX received_time ON axlecast.received (t0) WHERE first_seq > 0;  -- for expire_received: the runs that may be old

-- Adds runs of a log: extends the run that each of them continues.
CREATE FUNCTION axlecast.add_received(of_machine int4, of_log int4, channels text[], boot_ids int8[], first_seqs int8[], last_seqs int8[],
                                      t0s timestamptz[], t1s timestamptz[]) RETURNS void
LANGUAGE plpgsql SET search_path = pg_catalog, pg_temp AS $$
BEGIN
    FOR i IN 1 .. cardinality(channels) LOOP
        UPDATE axlecast.received r SET last_seq = last_seqs[i], t1 = greatest(r.t1, t1s[i])
        WHERE r.log = of_log AND r.channel = channels[i] AND r.boot_id = boot_ids[i] AND r.last_seq = first_seqs[i] - 1;
        IF NOT FOUND THEN
            INSERT INTO axlecast.received (t0, t1, boot_id, first_seq, last_seq, machine, log, channel)
            VALUES (t0s[i], t1s[i], boot_ids[i], first_seqs[i], last_seqs[i], of_machine, of_log, channels[i]);
        END IF;
    END LOOP;
END $$;

-- Messages that were sent and are in no log: between two runs of a publisher, in the order of their numbers. Messages before a publisher's
-- first run are `before the recording`. Until a machine's logs are all shipped, the gap may be one of them: lag_logs of fleet_status.
CREATE VIEW axlecast.gaps AS
SELECT m.name AS machine, g.channel, g.boot_id, g.first_seq, g.last_seq, g.last_seq - g.first_seq + 1 AS messages, g.t0, g.t1,
       coalesce((SELECT min(h.cause) FROM axlecast.hole h WHERE h.machine = g.machine AND h.t0 <= g.t1 AND h.t1 >= g.t0),
                CASE WHEN g.first_seq = 0 THEN 'before the recording' ELSE 'not recorded' END) AS cause
FROM (SELECT r.machine, r.channel, r.boot_id, coalesce(max(r.last_seq) OVER earlier + 1, 0) AS first_seq, r.first_seq - 1 AS last_seq,
             coalesce(max(r.t1) OVER earlier, r.t0) AS t0, r.t0 AS t1
      FROM axlecast.received r
      WINDOW earlier AS (PARTITION BY r.machine, r.channel, r.boot_id ORDER BY r.first_seq ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING)) g
JOIN axlecast.machine m ON m.id = g.machine
WHERE g.first_seq <= g.last_seq;

-- Joins the runs of each publisher that are older than `before`, and so forgets the gaps between them. A run is old if its last message
-- and the newest message of its log are. The newest of the old runs stays, and begins with 0 then: without it, all numbers before the next
-- run would be a new gap. Old runs behind a run that is kept (a clock was wrong) stay as well. Returns the number of deleted rows.
CREATE FUNCTION axlecast.expire_received(before timestamptz) RETURNS int8
LANGUAGE plpgsql SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    deleted int8;
BEGIN
    WITH publisher AS (
        SELECT DISTINCT r.machine, r.channel, r.boot_id FROM axlecast.received r WHERE r.first_seq > 0 AND r.t0 < before
    ), run AS MATERIALIZED (
        SELECT r.ctid AS place, r.machine, r.channel, r.boot_id, r.first_seq, r.last_seq,
               r.t1 < before AND coalesce(axlecast.time_of(l.last_utime) < before, true) AS old
        FROM publisher p
        JOIN axlecast.received r ON (r.machine, r.channel, r.boot_id) = (p.machine, p.channel, p.boot_id)
        LEFT JOIN axlecast.log l ON l.id = r.log
        FOR UPDATE OF r
    ), judged AS (
        SELECT *, min(first_seq) FILTER (WHERE NOT old) OVER (PARTITION BY machine, channel, boot_id) AS first_kept FROM run
    ), expired AS (
        SELECT place, row_number() OVER (PARTITION BY machine, channel, boot_id ORDER BY last_seq DESC, place) AS age FROM judged
        WHERE old AND (first_kept IS NULL OR first_seq < first_kept)
    ), joined AS (
        UPDATE axlecast.received r SET first_seq = 0 FROM expired e WHERE r.ctid = e.place AND e.age = 1 AND r.first_seq > 0
    )
    DELETE FROM axlecast.received r USING expired e WHERE r.ctid = e.place AND e.age > 1;
    GET DIAGNOSTICS deleted = ROW_COUNT;
    RETURN deleted;
END $$;

GRANT SELECT ON axlecast.received, axlecast.gaps TO axlecast_writer, axlecast_reader;
GRANT INSERT, UPDATE ON axlecast.received TO axlecast_writer;
