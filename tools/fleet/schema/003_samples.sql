-- Decodes the bodies of position_chunk. The format: docs/fleet.md.

-- Returns the 8 bytes at `at` (from 0) as a signed integer, big-endian.
CREATE FUNCTION axlecast.int8_at(body bytea, at int) RETURNS int8 LANGUAGE sql IMMUTABLE PARALLEL SAFE
RETURN ('x' || encode(substring(body FROM at + 1 FOR 8), 'hex'))::bit(64)::int8;

-- Returns the value modulo 2^64 as a signed integer.
CREATE FUNCTION axlecast.wrapped(value numeric) RETURNS int8 LANGUAGE sql IMMUTABLE PARALLEL SAFE
RETURN (mod(mod(value + 9223372036854775808, 18446744073709551616) + 18446744073709551616, 18446744073709551616) - 9223372036854775808)::int8;

-- Returns the residual of `width` bytes (1, 2 or 4) at `at` (from 0). It is inlined: the caller's expression becomes longer, and no call is made.
CREATE FUNCTION axlecast.residual_at(body bytea, at int, width int) RETURNS int LANGUAGE sql IMMUTABLE PARALLEL SAFE
RETURN CASE width
    WHEN 1 THEN (get_byte(body, at) >> 1) # -(get_byte(body, at) & 1)
    WHEN 2 THEN ((get_byte(body, at) << 7) | (get_byte(body, at + 1) >> 1)) # -(get_byte(body, at + 1) & 1)
    ELSE ((get_byte(body, at) << 23) | (get_byte(body, at + 1) << 15) | (get_byte(body, at + 2) << 7) | (get_byte(body, at + 3) >> 1))
         # -(get_byte(body, at + 3) & 1) END;

-- column_values for values so large that int8 overflows on the way: residuals of 8 bytes, or beginning beyond 2^60. Slow, and rare.
CREATE FUNCTION axlecast.wide_column_values(body bytea, at int, finish int, mode int, width int, n int) RETURNS int8[]
LANGUAGE plpgsql IMMUTABLE STRICT PARALLEL SAFE AS $$
DECLARE
    start  int8 := axlecast.int8_at(body, at);
    other  int8;
    p      int := at + 8;
    given  int := CASE mode WHEN 2 THEN 2 WHEN 1 THEN 1 ELSE 0 END;  -- values without a residual
    u      numeric;
    r      int8;
    v      int8 := start;
    d      int8 := 0;
    result int8[] := '{}';
BEGIN
    IF mode <> 1 THEN
        other := axlecast.int8_at(body, p);
        p := p + 8;
    END IF;
    FOR i IN 0 .. n - 1 LOOP
        r := 0;
        IF i >= given AND width > 0 THEN
            u := 0;
            FOR k IN 0 .. width - 1 LOOP u := u * 256 + get_byte(body, p + k); END LOOP;
            p := p + width;
            IF width <= 2 AND u = 256 ^ width - 1 THEN
                u := 0;
                FOR k IN 0 .. 7 LOOP u := u * 256 + get_byte(body, p + k); END LOOP;
                p := p + 8;
            END IF;
            r := CASE WHEN mod(u, 2) = 0 THEN div(u, 2) ELSE -div(u, 2) - 1 END;
        END IF;
        IF mode = 0 THEN
            v := axlecast.wrapped(start::numeric + CASE WHEN n > 1 THEN div((other::numeric - start) * i, n - 1) ELSE 0 END + r);
        ELSIF mode = 1 THEN
            v := axlecast.wrapped(v::numeric + r);
        ELSIF i = 1 THEN
            d := other;
            v := axlecast.wrapped(v::numeric + d);
        ELSIF i > 1 THEN
            d := axlecast.wrapped(d::numeric + r);
            v := axlecast.wrapped(v::numeric + d);
        END IF;
        result[i + 1] := v;
    END LOOP;
    IF p <> finish THEN
        RAISE EXCEPTION 'a column of a chunk does not have % values', n;
    END IF;
    RETURN result;
END $$;

-- Returns the n values of a column of a chunk's body, or NULL if the body has no such column. Columns: 1 t (us after t0), 2 counts,
-- 3 flags, 4 seq, 5 missed, 6 uncertainty, 7 mono_ns - utime, 8 raw_counts, 9 raw_turns, 10 speed, 11 device_status, 12 tick, 13 received.
-- Loops with one or two statements are faster here than window functions. So the escapes are searched first, and the values between them
-- need no check.
CREATE FUNCTION axlecast.column_values(body bytea, wanted int, n int) RETURNS int8[]
LANGUAGE plpgsql IMMUTABLE STRICT PARALLEL SAFE AS $$
DECLARE
    b      bytea := body || ''::bytea;  -- read from its table once, not for each byte
    at     int := 2;
    mode   int;
    width  int;
    size   int;
    p      int;
    finish int;
    i      int := 1;
    k      int;
    stop   int;
    q      int;
    u      int8;
    v      int8;
    d      int8 := 0;
    last   int8;
    steps  int := greatest(n - 1, 1);
    result int8[] := '{}';
BEGIN
    IF get_byte(b, 0) <> 1 THEN
        RAISE EXCEPTION 'body of a chunk has version %, and this database decodes version 1', get_byte(b, 0)
            USING HINT = 'Run axlecast fleet init of the version that wrote it.';
    END IF;
    FOR column_number IN 1 .. get_byte(b, 1) LOOP
        mode := get_byte(b, at + 1);
        width := get_byte(b, at + 2);
        size := (get_byte(b, at + 3) << 24) | (get_byte(b, at + 4) << 16) | (get_byte(b, at + 5) << 8) | get_byte(b, at + 6);
        EXIT WHEN get_byte(b, at) = wanted;
        at := at + 7 + size;
        mode := NULL;
    END LOOP;
    IF mode IS NULL THEN RETURN NULL; END IF;
    p := at + 7;
    finish := p + size;
    IF length(b) < finish OR size < 0 OR n < 1 THEN
        RAISE EXCEPTION 'column % of a chunk ends behind the body', wanted;
    END IF;
    IF mode = 3 THEN  -- runs
        WHILE i <= n LOOP
            IF p + 10 > finish THEN
                RAISE EXCEPTION 'column % of a chunk does not have % values', wanted, n;
            END IF;
            k := (get_byte(b, p) << 8) | get_byte(b, p + 1);
            result := result || array_fill(axlecast.int8_at(b, p + 2), ARRAY[least(k, n - i + 1)]);
            p := p + 10;
            i := i + k;
        END LOOP;
        IF p <> finish OR i <> n + 1 THEN
            RAISE EXCEPTION 'column % of a chunk does not have % values', wanted, n;
        END IF;
        RETURN result;
    ELSIF mode > 3 THEN
        RAISE EXCEPTION 'column % of a chunk has the unknown mode %', wanted, mode;
    END IF;

    k := CASE mode WHEN 1 THEN 8 ELSE 16 END;  -- bytes before the residuals
    IF size < k OR width = 0 AND size > k THEN
        RAISE EXCEPTION 'column % of a chunk does not have % values', wanted, n;
    END IF;
    v := axlecast.int8_at(b, p);
    p := p + 8;
    IF mode <> 1 THEN
        last := axlecast.int8_at(b, p);  -- or the first difference
        p := p + 8;
    END IF;
    IF width = 8 OR v NOT BETWEEN -1::int8 << 60 AND 1::int8 << 60
       OR mode = 0 AND last - v NOT BETWEEN -1::int8 << 52 AND 1::int8 << 52 OR mode = 2 AND last NOT BETWEEN -1::int8 << 50 AND 1::int8 << 50 THEN
        RETURN axlecast.wide_column_values(b, at + 7, finish, mode, width, n);
    END IF;
    IF width = 0 THEN
        IF mode = 1 OR mode = 0 AND last = v OR mode = 2 AND last = 0 THEN RETURN array_fill(v, ARRAY[n]); END IF;
        RETURN ARRAY(SELECT v + CASE mode WHEN 0 THEN (last - v) * j / steps ELSE last * j END FROM generate_series(0, n - 1) j);
    END IF;
    result := array_fill(v, ARRAY[n]);
    IF mode = 1 THEN
        i := 2;
    ELSIF mode = 2 THEN
        i := 3;
        d := last;
        IF n > 1 THEN result[2] := v + d; END IF;
    END IF;
    WHILE i <= n LOOP
        -- The values i to stop have no escape, and value j has its residual at q + j * width.
        k := CASE width WHEN 1 THEN position('\xff'::bytea IN substring(b FROM p + 1 FOR finish - p))
                        WHEN 2 THEN (position('\xffff'::bytea IN substring(b FROM p + 1 FOR finish - p)) + 1) / 2 ELSE 0 END;
        stop := CASE k WHEN 0 THEN n ELSE least(n, i + k - 2) END;
        q := p - i * width;
        IF mode = 1 THEN
            FOR j IN i .. stop LOOP
                result[j] := result[j - 1] + axlecast.residual_at(b, q + j * width, width);
            END LOOP;
        ELSIF mode = 2 THEN
            FOR j IN i .. stop LOOP
                d := d + axlecast.residual_at(b, q + j * width, width);
                result[j] := result[j - 1] + d;
            END LOOP;
        ELSE
            FOR j IN i .. stop LOOP
                result[j] := v + (last - v) * (j - 1) / steps + axlecast.residual_at(b, q + j * width, width);
            END LOOP;
        END IF;
        i := stop + 1;
        p := q + i * width;
        EXIT WHEN i > n;
        -- An escape, or two bytes of 0xff of different values.
        u := axlecast.residual_at(b, p, width);
        IF get_byte(b, p) = 255 AND (width = 1 OR get_byte(b, p + 1) = 255) THEN
            u := axlecast.int8_at(b, p + width);
            IF u NOT BETWEEN 0 AND 1::int8 << 44 THEN RETURN axlecast.wide_column_values(b, at + 7, finish, mode, width, n); END IF;
            u := (u >> 1) # -(u & 1);  -- zigzag
            p := p + 8;
        END IF;
        p := p + width;
        d := CASE mode WHEN 2 THEN d ELSE 0 END + u;
        result[i] := CASE mode WHEN 0 THEN v + (last - v) * (i - 1) / steps ELSE result[i - 1] END + d;
        i := i + 1;
    END LOOP;
    IF p <> finish THEN
        RAISE EXCEPTION 'column % of a chunk does not have % values', wanted, n;
    END IF;
    RETURN result;
END $$;

-- Returns the samples of a device from from_time to to_time, both included, in the order of time.
--   value   in the device's unit; NULL if the sample is not valid, or the unit is not known
--   missed  readings that failed before this sample; NULL if they are not stored
--   seq     NULL if it is not stored (detail other than `full`)
--   stream  counts of different streams cannot be compared
CREATE FUNCTION axlecast.samples(machine text, device text, from_time timestamptz, to_time timestamptz)
RETURNS TABLE (t timestamptz, counts int8, value float8, flags int4, valid bool, missed int4, seq int8, stream int4)
LANGUAGE plpgsql STABLE PARALLEL SAFE ROWS 2500 AS $$
#variable_conflict use_column
DECLARE
    -- A value that the planner knows: it opens the partitions of this time only.
    earliest timestamptz := from_time - interval '1 day';
    c record;
BEGIN
    FOR c IN
        SELECT p.t0, p.n, p.body, p.stream, s.unit_per_count,
               -- Columns with one value need no decoding.
               CASE p.flags_or WHEN p.flags_and THEN p.flags_or END AS flags, CASE p.missed WHEN 0 THEN 0 END AS missed
        FROM axlecast.machine m
        JOIN axlecast.device d ON d.machine = m.id
        JOIN axlecast.stream s ON s.device = d.id
        -- The chunk that begins before from_time may reach into the time.
        CROSS JOIN LATERAL (SELECT max(q.t0) AS t0 FROM axlecast.position_chunk q
                            WHERE q.stream = s.id AND q.t0 <= from_time AND q.t0 >= earliest) before
        JOIN LATERAL (SELECT * FROM axlecast.position_chunk q
                      WHERE q.stream = s.id AND q.t0 >= coalesce(before.t0, from_time) AND q.t0 <= to_time
                        AND q.t0 >= earliest) p ON p.t1 >= from_time
        WHERE m.name = samples.machine AND d.name = samples.device
        ORDER BY p.t0
    LOOP
        RETURN QUERY
        SELECT v.t, a.counts, CASE WHEN v.flags & 1 = 1 THEN a.counts * c.unit_per_count END, v.flags, v.flags & 1 = 1,
               coalesce(c.missed, a.missed::int4), a.seq, c.stream
        FROM unnest(axlecast.column_values(c.body, 1, c.n), axlecast.column_values(c.body, 2, c.n),
                    CASE WHEN c.flags IS NULL THEN axlecast.column_values(c.body, 3, c.n) END,
                    CASE WHEN c.missed IS NULL THEN axlecast.column_values(c.body, 5, c.n) END,
                    axlecast.column_values(c.body, 4, c.n)) AS a (us, counts, flags, missed, seq),
             LATERAL (SELECT c.t0 + a.us * interval '1 us', coalesce(c.flags, a.flags::int4)) AS v (t, flags)
        WHERE v.t BETWEEN from_time AND to_time;
    END LOOP;
END $$;
