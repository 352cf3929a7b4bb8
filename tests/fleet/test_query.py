"""axlecast fleet status, query and the commands of an administrator, on a log that was shipped to a real database."""

import json
import os
import unittest
import uuid

from shipped_machine import MACHINE, ShippedMachine, positions

LATE = 3
NO_ANSWER = 6


class Query(ShippedMachine):
    def test_gives_every_position_as_recorded(self):
        rows = self.query("positions", "--device", "axis1")
        recorded = list(positions(self.recorded))
        self.assertEqual([(row["utime"], row["seq"], row["counts"], row["flags"]) for row in rows],
                         [(utime, seq, counts, flags) for utime, seq, counts, _, flags in recorded])
        for row, (_, _, _, value, flags) in zip(rows, recorded):
            if flags & 1:
                self.assertAlmostEqual(row["value"], value, 6)
            else:
                self.assertIsNone(row["value"])

    def test_selects_by_time_and_limit(self):
        recorded = list(positions(self.recorded))
        begin, end = recorded[100][0], recorded[2000][0]
        utc = self.query("positions", "--limit", "1")[0]["utc"]
        rows = self.query("positions", "--from", utc, "--until", "3")
        self.assertEqual(rows[0]["utime"], recorded[0][0])
        self.assertLess(rows[-1]["utime"], recorded[0][0] + 3_000_000)
        rows = [row for row in self.query("positions") if begin <= row["utime"] < end]
        self.assertEqual(len(rows), 1900)
        self.assertEqual(len(self.query("positions", "--limit", "7")), 7)
        last = self.query("positions", "--from", "-1")
        self.assertEqual(last[-1]["utime"], recorded[-1][0])
        self.assertLess(len(last), len(recorded))

    def test_gives_the_fields_of_detail_full(self):
        row = self.query("positions", "--full", "--limit", "500")[-1]
        for name in ("mono_ns", "time_uncertainty_ns", "raw_counts", "raw_turns", "angle_rad", "published_value", "received_utime"):
            self.assertIsNotNone(row[name], name)

    def test_seconds_and_minutes_are_those_of_the_samples(self):
        recorded = list(positions(self.recorded))
        seconds = self.query("seconds")
        self.assertEqual(sum(second["n"] for second in seconds), len(recorded))
        for second in seconds:
            counts = [one[2] for one in recorded if second["utime"] <= one[0] < second["utime"] + 1_000_000 and one[4] & 1]
            self.assertEqual((second["lo"], second["hi"], second["valid"]), (min(counts), max(counts), len(counts)))
            self.assertAlmostEqual(second["mean"], sum(counts) / len(counts), 3)
        minutes = self.query("minutes")
        self.assertEqual(sum(minute["n"] for minute in minutes), len(recorded))
        self.assertEqual(min(minute["lo"] for minute in minutes), min(second["lo"] for second in seconds))

    def test_csv_has_the_same_rows_as_json(self):
        rows = self.query("positions", "--limit", "1000")
        cells = self.query_csv("positions", "--limit", "1000")
        self.assertEqual([int(cell["utime"]) for cell in cells], [row["utime"] for row in rows])
        self.assertEqual([cell["value"] for cell in cells], ["" if row["value"] is None else repr(row["value"]).removesuffix(".0")
                                                             for row in rows])
        lines = self.must("query", "positions", "--machine", MACHINE, "--limit", "10", "--format", "jsonl").splitlines()
        self.assertEqual([json.loads(line) for line in lines], rows[:10])

    def test_every_kind_has_an_answer(self):
        for kind in ("alarms", "commands", "trips", "health", "buses", "recorders", "motors", "clocks", "holes", "odd"):
            self.assertIsInstance(self.query(kind), list, kind)
        health = self.query("health")
        self.assertEqual({row["device"] for row in health}, {"axis1"})
        self.assertEqual(health[0]["family"], "tformat")
        message = self.query("health", "--message", "--limit", "1")[0]["message"]
        self.assertEqual(message["device"], "axis1")

    def test_texts_of_others_are_quoted(self):
        self.cluster.sql("""INSERT INTO axlecast.hole (machine, cause, t0, t1, channel)
            SELECT id, E'=cmd|"x",\\n\\u001b[31m', '2023-11-14 22:14+00', '2023-11-14 22:15+00', 'a,b' FROM axlecast.machine""")
        hole = self.query_csv("holes")[0]
        self.assertEqual(hole["channel"], "a,b")
        self.assertTrue(hole["cause"].startswith("'=cmd|\"x\",\n"), hole)
        self.assertEqual(self.query("holes")[0]["cause"], '=cmd|"x",\n\u001b[31m')

    def test_a_damaged_chunk_is_reported_and_the_others_are_given(self):
        self.cluster.sql("""UPDATE axlecast.position_chunk SET body = substring(body FOR 20)
            WHERE (stream, t0) IN (SELECT stream, t0 FROM axlecast.position_chunk ORDER BY t0 OFFSET 2 LIMIT 1)""")
        code, out, err = self.fleet("query", "positions", "--machine", MACHINE, "--format", "json")
        self.assertEqual(code, LATE, err)
        self.assertIn("1 chunks cannot be decoded", err)
        recorded = len(list(positions(self.recorded)))
        self.assertIn(recorded - len(json.loads(out)), range(1, 257))

    def test_wrong_words_are_refused_with_a_suggestion(self):
        self.assertIn("did you mean 'capture'", self.fails(1, "query", "positions", "--machine", "captur"))
        self.assertIn("did you mean 'axis1'", self.fails(1, "query", "positions", "--machine", MACHINE, "--device", "axsi1"))
        self.assertIn("no time", self.fails(2, "query", "seconds", "--machine", MACHINE, "--from", "yesterday").replace("is not a time", "no time"))
        self.fails(2, "query", "holes", "--machine", MACHINE, "--device", "axis1")
        self.fails(2, "query", "seconds", "--machine", MACHINE, "--full")
        self.fails(2, "query", "nothing", "--machine", MACHINE)
        self.assertIn("--machine", self.fails(2, "query", "positions"))

    def test_the_connection_is_found_in_three_places(self):
        count = "{}".format(len(self.query("seconds")))
        code, out, err = self.axlecast("fleet", "query", "seconds", "--machine", MACHINE, "--format", "jsonl", "--database", self.database)
        self.assertEqual((code, str(len(out.splitlines()))), (0, count), err)
        os.environ["AXLECAST_DATABASE"] = self.database
        self.addCleanup(os.environ.pop, "AXLECAST_DATABASE", None)
        self.assertEqual(self.axlecast("fleet", "query", "seconds", "--machine", MACHINE, "--format", "jsonl"), (0, out, ""))
        del os.environ["AXLECAST_DATABASE"]
        self.config.write_text(self.config.read_text().replace("host=/nowhere", self.database))
        self.assertEqual(self.axlecast("fleet", "query", "seconds", "--config", self.config, "--format", "jsonl"), (0, out, ""))

    def test_no_connection_is_an_error_with_its_cause(self):
        self.assertTrue(self.fails(NO_ANSWER, "status", database="host=/nowhere dbname=axlecast"))
        err = self.fails(1, "status", database=self.cluster.connection("template1"))
        self.assertIn("fleet init", err)
        self.cluster.sql("INSERT INTO axlecast.schema_version (version, axlecast) VALUES (1000, 'future')")
        self.assertIn("1000", self.fails(1, "query", "positions", "--machine", MACHINE))


class Status(ShippedMachine):
    def status(self, *words):
        code, out, err = self.fleet("status", "--json", *words)
        self.assertIn(code, (0, LATE), err)
        server = json.loads(out)["servers"][0]
        return code, server, {machine["machine"]: machine for machine in server["machines"]}

    def test_a_machine_is_late_by_its_newest_message(self):
        code, server, machines = self.status()
        self.assertEqual(code, LATE)
        self.assertTrue(machines[MACHINE]["late"])
        recorded = list(positions(self.recorded))
        self.assertGreaterEqual(machines[MACHINE]["last_utime"], recorded[-1][0])
        self.assertGreater(server["table_bytes"]["position_chunk"], 0)
        self.assertEqual(server["schema_version"], int(self.cluster.value("SELECT max(version) FROM axlecast.schema_version")))
        self.assertEqual(self.status("--late", "200y")[0], 0)
        self.assertEqual(self.fleet("status", MACHINE, "--late", "200y")[0], 0)
        self.assertIn("did you mean", self.fails(1, "status", "capturr"))

    def test_a_new_hole_needs_attention(self):
        self.cluster.sql("INSERT INTO axlecast.hole (machine, cause) SELECT id, 'disk nearly full' FROM axlecast.machine")
        code, _, machines = self.status("--late", "200y")
        self.assertEqual((code, machines[MACHINE]["new_holes"]), (LATE, 1))
        self.cluster.sql("UPDATE axlecast.hole SET noticed = now() - interval '2 days'")
        code, _, machines = self.status("--late", "200y")
        self.assertEqual((code, machines[MACHINE]["new_holes"], machines[MACHINE]["holes"]), (0, 0, 1))

    def test_a_shard_has_the_machine_and_a_dead_one_is_reported(self):
        self.cluster.create_database("second")
        shard = self.cluster.connection("second")
        self.must("init", shard)
        self.cluster.sql("INSERT INTO axlecast.machine (name, installation) VALUES ('other', gen_random_uuid())", database="second")
        self.must("shard", "other", shard)
        self.assertEqual(self.must("query", "seconds", "--machine", "other", "--format", "json"), "[]\n")
        code, out, err = self.fleet("status", "--json")
        self.assertEqual([[machine["machine"] for machine in server["machines"]] for server in json.loads(out)["servers"]],
                         [[MACHINE], ["other"]], err)
        self.assertTrue(self.fails(1, "shard", "third", "host=/nowhere"))
        self.must("shard", "third", "host=/nowhere", "--no-check")
        code, out, err = self.fleet("status", "--json", "--late", "200y")
        self.assertEqual(code, LATE, err)
        self.assertTrue(any("error" in server for server in json.loads(out)["servers"]), out)
        self.must("shard", "third", "--remove")
        self.fails(1, "shard", "third", "--remove")
        self.fails(1, "shard", "fourth", "host=a password=secret")


class Administration(ShippedMachine):
    def test_renames_a_machine_with_its_history(self):
        before = self.query("seconds")
        self.must("rename", MACHINE, "press3")
        self.fails(1, "query", "seconds", "--machine", MACHINE)
        self.assertEqual(json.loads(self.must("query", "seconds", "--machine", "press3", "--format", "json")), before)
        self.cluster.sql("INSERT INTO axlecast.machine (name, installation) VALUES ('press4', gen_random_uuid())")
        self.assertIn("press4", self.fails(1, "rename", "press3", "press4"))
        self.fails(2, "rename", "press3", "no name")

    def test_adopts_a_machine_from_another_installation(self):
        def state():
            return self.cluster.sql("SELECT installation, generation FROM axlecast.machine")[0]
        before = state()
        new = str(uuid.uuid4())
        self.must("adopt", MACHINE, "--installation", new)
        self.assertEqual(state(), [new, str(int(before[1]) + 1)])
        self.must("adopt", MACHINE, "--here", "--state", self.folder / "ship")
        self.assertEqual(state()[0], before[0])
        self.fails(2, "adopt", MACHINE)
        self.fails(2, "adopt", MACHINE, "--installation", "no-uuid")
        self.fails(1, "adopt", MACHINE, "--here", "--state", self.folder / "nowhere")

    def test_keeps_rows_by_retention(self):
        self.assertIn("position_chunk", self.must("retention"))
        self.assertRegex(self.must("retention", "position_chunk", "30d"), r"position_chunk +30d")
        self.assertRegex(self.must("retention", "position_minute", "unlimited"), r"position_minute +unlimited")
        self.assertIn("did you mean 'position_chunk'", self.fails(1, "retention", "position_chunks", "30d"))
        self.fails(2, "retention", "position_chunk", "1h")
        self.assertIn("position_chunk", self.must("expire"))
        self.assertEqual(self.query("positions"), [])
        self.assertGreater(len(self.query("minutes")), 0)


if __name__ == "__main__":
    unittest.main()
