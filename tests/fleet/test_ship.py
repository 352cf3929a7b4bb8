"""axlecast ship: recorded messages reach a real PostgreSQL exactly once, whatever is killed, and each mistake is explained."""

import json
import random
import signal
import subprocess
import time
import unittest

import lcm_log
from cluster import SqlError, new_folder, run, unprivileged
from machine import BIN, wait_for, wrong_unix_time
from shipping import Load, Positions, Shipping


class Ship(Shipping):
    def test_what_was_recorded_is_in_the_database_once(self):
        sender = self.record(600)
        self.make_quiet()
        status = self.must_ship()
        self.assertEqual(status["samples"], 1_200)
        self.assert_exactly_once(sender)
        self.assertEqual(self.must_ship()["samples"], 0)
        self.assert_exactly_once(sender)
        # The recorder may delete what the file states, and no other file is needed for that.
        shipped = json.loads((self.logs / "shipped.json").read_text())["logs"]
        self.assertEqual(set(shipped), {path.name for path in self.logs.glob("*.lcm")})
        self.assertTrue(all(log["complete"] for log in shipped.values()), shipped)
        self.assertEqual(self.cluster.value("SELECT text FROM axlecast.machine_file"), self.config.read_text())

    def test_live_data_follows_within_seconds(self):
        recorder = self.recorder()
        shipper = self.shipper()
        sender = Positions(self.axes)
        self.addCleanup(sender.close)

        def arrived():
            sender.send(10)
            return self.cluster.value("SELECT count(*) FROM axlecast.position_chunk") != "0"
        begun = time.monotonic()
        wait_for(arrived, lambda: "a chunk in the database: " + self.log("ship"))
        print(f"first chunk after {time.monotonic() - begun:.1f} s")
        for process in (recorder, shipper):
            process.send_signal(signal.SIGTERM)
            self.assertIn(process.wait(60), (0, 3), self.log("ship"))
        self.must_ship()
        self.assert_exactly_once(sender)

    def test_kills_of_shipper_and_server_neither_lose_nor_double(self):
        sender = self.record(18_000)  # some seconds, and so some stretches between seals, each at least one batch
        self.make_quiet()
        config = self.machine_file(ship="bandwidth: 48kB")
        chance = random.Random(21)
        upto = lambda: int(self.cluster.value("SELECT coalesce(sum(upto), 0) FROM axlecast.log"))
        complete = lambda: self.cluster.value("SELECT count(*) = 2 FROM axlecast.log WHERE closed") == "t"
        kills = 0
        while not complete():
            before = upto()
            shipper = self.shipper(config=config, name=f"ship{kills}")
            wait_for(lambda: upto() > before or complete(), lambda: "a batch: " + self.log(f"ship{kills}"))
            time.sleep(chance.random() * 0.5)
            if kills % 2 == 0:
                self.kill(shipper)
            else:
                self.cluster.kill()
                time.sleep(chance.random() * 0.5)
                self.cluster.start()
                self.kill(shipper)
            kills += 1
        print(f"{kills} kills")
        self.assertGreater(kills, 3)
        self.must_ship()
        self.assert_exactly_once(sender)

    def test_compressed_renamed_and_torn_logs(self):
        sender = self.record(300, stop=signal.SIGKILL)
        log = self.log_of()
        log.write_bytes(log.read_bytes() + b"\xed\xa1\xda\x01torn")
        log.rename(self.logs / "somebody renamed it.lcm")
        self.make_quiet()
        code, status, errors = self.ship_once()
        self.assertEqual((code, status["holes"]), (3, 1), errors)
        self.assert_exactly_once(sender)
        self.assertIn("torn", self.holes()[0][0])
        later = self.record(200, boot_id=78)
        plain = next(path for path in self.logs.glob("*positions*.lcm"))
        subprocess.run(["zstd", "-q", "--rm", plain], check=True)
        self.must_ship()
        self.assertEqual(sum(len(self.samples(axis)) for axis in self.axes), 2 * 300 + 2 * 200, later.sent.keys())

    def test_damage_becomes_holes_and_the_rest_is_shipped(self):
        sender = self.record(1_000)
        log = self.log_of()
        data = bytearray(log.read_bytes())
        chance = random.Random(4)
        begin = data.index(b"POSITION/")
        for _ in range(20):
            data[begin + chance.randrange(len(data) - begin)] ^= 1 << chance.randrange(8)
        log.write_bytes(data)
        self.make_quiet()
        code, status, errors = self.ship_once()
        self.assertEqual(code, 3, errors)
        self.assertGreater(status["holes"], 0)
        lost = int(self.cluster.value("SELECT sum(messages) FROM axlecast.hole"))
        stored = sum(len(self.samples(axis)) for axis in self.axes)
        # A hole counts a damaged seal, and the head of the log, as messages too.
        self.assertLessEqual(2_000, stored + lost)
        self.assertLessEqual(stored + lost, 2_000 + 20 + 3)
        for axis in self.axes:
            self.assertLessEqual(set(self.samples(axis)), set(sender.sent[axis]))
        self.assertEqual(self.ship_once()[1]["holes"], 0, "each hole is recorded once")

    def test_clock_far_ahead_is_kept_as_odd(self):
        sender = self.record(100, begin=int((time.time() + 10 * 365.25 * 86400) * 1e6))
        status = self.must_ship()
        self.assertEqual((status["samples"], status["odd"]), (0, 200))
        self.assertEqual(self.cluster.value("SELECT count(*) FROM axlecast.odd WHERE cause = 'time out of range'"), "200")
        self.assertEqual(sum(map(len, sender.sent.values())), 200)

    def test_clock_10_years_ahead_and_right_again(self):
        years = round(10 * 365.25 * 86400)
        shipper = self.shipper()
        wrong = self.record(100, begin=int((time.time() + years) * 1e6), env=wrong_unix_time(years))
        wait_for(lambda: self.cluster.value("SELECT count(*) FROM axlecast.odd WHERE channel LIKE 'POSITION%'") == "200", lambda: self.log("ship"))
        # The clock is right: the new log begins 10 years before the other one, and is the one that grows.
        recorder = self.recorder(name="record-right")
        right = Positions(self.axes, boot_id=78)
        self.addCleanup(right.close)
        load = Load(right)
        load.start()
        self.addCleanup(load.stop)
        wait_for(lambda: len(right.sent["a1"]) > 3_000, "12 s of messages")
        wait_for(lambda: self.cluster.value("SELECT coalesce(sum(n), 0) > 2000 FROM axlecast.position_second") == "t", lambda: self.log("ship"))
        self.assertEqual(self.holes(), [])
        load.stop()
        wait_for(lambda: self.recorded() == 200 + sum(map(len, right.sent.values())), "the logs to have all messages")
        for process in (recorder, shipper):
            process.send_signal(signal.SIGTERM)
            self.assertIn(process.wait(60), (0, 3), self.log("ship"))
        self.must_ship()
        self.assert_exactly_once(right)
        odd = self.cluster.sql("SELECT utime, channel, cause FROM axlecast.odd WHERE channel LIKE 'POSITION%' ORDER BY channel, utime")
        self.assertEqual(odd, [[str(utime), f"POSITION/{axis}", "time out of range"] for axis in self.axes for utime, _ in wrong.sent[axis]])
        self.assertEqual(self.holes(), [])

    def test_logs_that_the_recorder_had_to_delete_are_holes_once(self):
        self.record(50)
        head = json.loads(next(data for channel, data in lcm_log.events(self.log_of()) if channel == "AXLECAST/recorder"))
        hole = {"file": "press3-positions_20260101T000000Z.lcm", "logs": 1, "name": "positions", "host": head["host"],
                "start_utime": 1_767_225_600_000_000, "file_number": 0, "first_event": 12, "last_utime": 1_767_225_700_000_000,
                "bytes": 1000, "cause": "disk nearly full", "utime": 1_767_225_800_000_000}
        (self.logs / "holes.jsonl").write_text(json.dumps(hole) + "\n")
        self.assertEqual(self.ship_once()[0], 3)
        self.assertEqual(self.holes(), [["disk nearly full", "12", None]])
        (self.logs / "shipped.json").unlink()
        self.ship_once()
        self.assertEqual(len(self.holes()), 1)

    def test_what_was_shipped_of_a_log_that_is_gone_is_complete(self):
        recorder, shipper = self.recorder(), self.shipper()
        sender = Positions(self.axes)
        self.addCleanup(sender.close)
        sender.send(200)
        wait_for(lambda: self.cluster.value("SELECT coalesce(sum(n), 0) > 300 FROM axlecast.position_chunk") == "t", lambda: self.log("ship"))
        self.kill(shipper)
        sender.send(200)
        self.kill(recorder)
        # The recorder would delete the log because the disk is nearly full.
        name, host, start, number, upto = self.cluster.sql("SELECT name, host, start_utime, file_number, upto FROM axlecast.log WHERE name = 'positions'")[0]
        hole = {"file": self.log_of().name, "logs": 1, "name": name, "host": host, "start_utime": int(start), "file_number": int(number),
                "first_event": int(upto), "last_utime": sender.utime, "bytes": 1000, "cause": "disk nearly full", "utime": sender.utime}
        self.log_of().unlink()
        (self.logs / "holes.jsonl").write_text(json.dumps(hole) + "\n")
        self.ship_once()
        self.assertEqual([row[0] for row in self.holes()], ["disk nearly full"])
        for axis in self.axes:
            stored = self.samples(axis)
            self.assertEqual(stored, sender.sent[axis][:len(stored)])
            for table in ("second", "minute"):
                rolled_up = self.cluster.value(f"SELECT sum(n) FROM axlecast.position_{table} JOIN axlecast.axis USING (stream) WHERE device = '{axis}'")
                self.assertEqual(int(rolled_up), len(stored), table)
            runs = self.cluster.sql(f"SELECT first_seq, last_seq FROM axlecast.received WHERE channel = 'POSITION/{axis}'")
            self.assertEqual(runs, [["0", str(len(stored) - 1)]])


class Mistakes(Shipping):
    def setUp(self):
        super().setUp()
        self.sender = self.record(60)

    def fails(self, text, *options, **more):
        code, status, errors = self.ship_once(*options, **more)
        self.assertEqual(code, 4, errors)
        self.assertIn(text, errors)
        return status

    def assert_nothing_lost(self):
        self.must_ship()
        self.assert_exactly_once(self.sender)

    def test_newest_shipper_replaces_the_others(self):
        config = self.machine_file(ship="bandwidth: 10kB")
        first = self.shipper(config=config, name="first")
        wait_for(lambda: "connected to" in self.log("first"), "the first shipper")
        # As the same installation on another host would: the lock of the state folder does not see it.
        subprocess.run(["cp", "-r", self.folder / "ship-state", self.folder / "copy"], check=True)
        self.must_ship(state="copy")
        self.record(30, boot_id=78)
        self.assertEqual(first.wait(60), 8, self.log("first"))
        self.assertIn("has taken the machine 'press3' over", self.log("first"))

    def test_second_shipper_of_this_host_is_refused(self):
        self.shipper(name="first")
        wait_for(lambda: "connected to" in self.log("first"), "the first shipper")
        self.fails("another `axlecast ship` uses this state folder")

    def test_two_machines_with_one_name(self):
        self.assert_nothing_lost()
        self.fails("axlecast fleet adopt press3", state="other")
        self.assert_nothing_lost()

    def test_renamed_machine(self):
        self.assert_nothing_lost()
        config = self.machine_file("press4")
        self.fails("axlecast fleet rename press3 press4", config=config)
        self.cluster.sql("UPDATE axlecast.machine SET name = 'press4'")
        later = self.record(40, boot_id=78, config=config)
        self.must_ship(config=config)
        self.assertEqual([len(self.samples(axis, "press4")) for axis in self.axes], [100, 100])
        self.assertEqual(len(later.sent["a1"]), 40)

    def test_other_versions_of_the_schema(self):
        self.cluster.sql("INSERT INTO axlecast.schema_version (version, axlecast) VALUES (999, '99')")
        self.fails("999")
        self.cluster.sql("DELETE FROM axlecast.schema_version WHERE version = 999")
        newest = self.cluster.sql("DELETE FROM axlecast.schema_version WHERE version = (SELECT max(version) FROM axlecast.schema_version) RETURNING *")
        self.fails("axlecast fleet init")  # an older schema
        self.cluster.sql(f"INSERT INTO axlecast.schema_version VALUES ({', '.join(repr(value) for value in newest[0])})")
        self.assert_nothing_lost()
        self.cluster.sql("DROP SCHEMA axlecast CASCADE")
        self.fails("axlecast fleet init")
        self.init()
        self.assert_nothing_lost()

    def test_wrong_password_and_missing_server(self):
        self.cluster.sql("SET password_encryption = 'scram-sha-256'; CREATE ROLE shipper LOGIN PASSWORD 'hunter2' IN ROLE axlecast_writer")
        rules = self.cluster.data / "pg_hba.conf"
        rules.write_text("local all shipper scram-sha-256\n" + rules.read_text())
        self.cluster.sql("SELECT pg_reload_conf()")
        password = self.folder / "password"
        password.write_text("hunter3")
        password.chmod(0o600)
        connection = self.cluster.connection(user="shipper")
        options = ("--database", connection, "--password-file", password)
        status = self.fails("password", *options)
        self.assertNotIn("hunter3", json.dumps(status))
        password.write_text("hunter2")
        self.must_ship(*options)
        self.assert_exactly_once(self.sender)
        self.fails("axlecast", "--database", "host=/nowhere dbname=axlecast")

    def test_missing_database_and_missing_rights(self):
        shipper = self.shipper("--database", self.cluster.connection(database="plant"), state="ship-state")
        wait_for(lambda: "createdb" in self.log("ship"), lambda: "the cause: " + self.log("ship"))
        self.assertIn('database "plant" does not exist', self.log("ship"))
        self.cluster.sql("CREATE DATABASE plant TEMPLATE axlecast", database="postgres")  # now the shipper connects
        wait_for(lambda: "connected to" in self.log("ship"), lambda: self.log("ship"))
        self.kill(shipper)

        self.cluster.sql("CREATE ROLE stranger LOGIN; CREATE ROLE reader LOGIN IN ROLE axlecast_reader; CREATE ROLE writer LOGIN IN ROLE axlecast_writer")
        for user in ("stranger", "reader"):
            status = self.fails("permission denied", "--database", self.cluster.connection(user=user))
            self.assertIn("axlecast_writer", status["problem"])
        self.cluster.sql("GRANT axlecast_writer TO stranger")
        self.must_ship("--database", self.cluster.connection(user="stranger"))
        self.assert_exactly_once(self.sender)

    def test_full_disk_of_the_server(self):
        place = new_folder()
        self.addCleanup(place.rmdir)
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=24m", "tmpfs", place], check=True)
        self.addCleanup(subprocess.run, ["umount", "-l", place])
        if unprivileged()[:1] == ["setpriv"]:
            subprocess.run(["chown", "nobody:nogroup", place], check=True)
        else:
            place.chmod(0o777)
        run("mkdir", "-m", "700", place / "space")
        self.cluster.sql(f"CREATE TABLESPACE small LOCATION '{place / 'space'}'")
        self.cluster.sql("ALTER DATABASE axlecast SET default_tablespace = small")
        filler = place / "filler"
        with open(filler, "wb") as file:
            try:
                while True:
                    file.write(bytes(1 << 16))
                    file.flush()
            except OSError:
                pass
        with self.assertRaises(SqlError):
            self.cluster.sql("ALTER TABLE axlecast.odd SET TABLESPACE small")
        self.cluster.sql("DO $$ DECLARE p text; BEGIN FOR p IN SELECT inhrelid::regclass FROM pg_inherits WHERE inhparent = "
                         "'axlecast.position_chunk'::regclass LOOP EXECUTE 'DROP TABLE ' || p; END LOOP; END $$")
        shipper = self.shipper()
        wait_for(lambda: "No space left" in self.log("ship") or "disk" in self.log("ship"), lambda: "the cause: " + self.log("ship"))
        self.assertIsNone(shipper.poll())
        filler.unlink()
        wait_for(lambda: self.cluster.value("SELECT bool_and(upto > 0) FROM axlecast.log") == "t", lambda: self.log("ship"), limit=120)
        self.kill(shipper)
        self.assert_nothing_lost()

    def test_server_is_killed_and_comes_back(self):
        shipper = self.shipper()
        wait_for(lambda: "connected to" in self.log("ship"), "the connection")
        self.cluster.kill()
        self.record(30, boot_id=78)
        wait_for(lambda: '"connected":false' in self.log("ship") or self.log("ship").count("\n") > 2, "the loss")
        self.cluster.start()
        wait_for(lambda: self.cluster.value("SELECT coalesce(sum(p.n), 0) >= 180 FROM axlecast.position_second p") == "t",
                 lambda: self.log("ship"), limit=120)
        self.kill(shipper)


if __name__ == "__main__":
    unittest.main()
