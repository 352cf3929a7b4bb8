"""axlecast fleet init: creates and migrates the schema, and explains what prevents it."""

import json
import os
import pathlib
import subprocess
import unittest

from cluster import Cluster, Pair, SqlError
from machine import BIN

SCHEMA = sorted((pathlib.Path(os.environ["AXLECAST_SOURCE"]) / "tools/fleet/schema").glob("*.sql"))
VERSION = len(SCHEMA)


def init(connection, *options):
    """Returns exit code, JSON (or None) and error text."""
    done = subprocess.run([BIN / "axlecast", "fleet", "init", connection, "--json", *options], capture_output=True, text=True, check=False)
    return done.returncode, json.loads(done.stdout) if done.stdout else None, done.stderr


class Init(unittest.TestCase):
    def setUp(self):
        self.cluster = self.enterContext(Cluster())
        self.cluster.create_database()
        self.connection = self.cluster.connection()

    def must(self, *options):
        code, result, errors = init(self.connection, *options)
        self.assertEqual((code, errors), (0, ""))
        return result

    def fails(self, connection, *options, code=1):
        exit_code, result, errors = init(connection, *options)
        self.assertEqual((exit_code, result), (code, None), errors)
        return errors

    def test_creates_the_schema_and_repeats_without_effect(self):
        first = self.must("--writer", "ship one", "--reader", "look")
        self.assertEqual((first["from"], first["version"], first["writer"]), (0, VERSION, "ship one"))
        second = self.must("--writer", "ship one", "--reader", "look")
        self.assertEqual((second["from"], second["version"]), (VERSION, VERSION))
        self.assertEqual(self.cluster.value("SELECT count(*) FROM axlecast.schema_version"), str(VERSION))
        self.cluster.sql("INSERT INTO axlecast.machine (name, installation) VALUES ('m', gen_random_uuid())", user="ship one")
        self.assertEqual(self.cluster.value("SELECT name FROM axlecast.machine", user="look"), "m")
        with self.assertRaisesRegex(SqlError, "permission denied"):
            self.cluster.sql("DELETE FROM axlecast.machine", user="look")

    def test_two_at_once_create_it_once(self):
        processes = [subprocess.Popen([BIN / "axlecast", "fleet", "init", self.connection], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
                     for _ in range(4)]
        outputs = [process.communicate()[0] for process in processes]
        self.assertEqual([process.returncode for process in processes], [0] * 4, outputs)
        self.assertEqual(sum("Created" in output for output in outputs), 1, outputs)

    def test_migrates_an_older_schema_and_keeps_its_data(self):
        self.cluster.sql("BEGIN; SET search_path = pg_catalog;" + SCHEMA[0].read_text()
                         + "INSERT INTO axlecast.schema_version (version, axlecast) VALUES (1, 'old');"
                           "INSERT INTO axlecast.machine (name, installation) VALUES ('m', gen_random_uuid()); COMMIT")
        self.assertEqual(self.must()["from"], 1)
        self.assertEqual(self.cluster.value("SELECT machine FROM axlecast.fleet_status"), "m")

    def test_failed_migration_changes_nothing(self):
        self.cluster.sql("CREATE VIEW public.fleet AS SELECT 1; CREATE SCHEMA axlecast")
        self.assertIn("a schema `axlecast` that this program has not created", self.fails(self.connection))
        self.cluster.sql("DROP SCHEMA axlecast; CREATE ROLE builder LOGIN; GRANT CREATE ON DATABASE axlecast TO builder")
        errors = self.fails(self.cluster.connection(user="builder"))  # may not create roles
        self.assertIn("005_roles.sql failed, and nothing was changed", errors)
        self.assertEqual(self.cluster.value("SELECT count(*) FROM pg_namespace WHERE nspname = 'axlecast'"), "0")

    def test_refuses_a_newer_schema(self):
        self.must()
        self.cluster.sql("INSERT INTO axlecast.schema_version (version, axlecast) VALUES (999, '99.0')")
        self.assertIn("schema version 999, and this program knows versions up to", self.fails(self.connection))

    def test_refuses_a_user_without_permission(self):
        self.cluster.sql("CREATE ROLE nobody LOGIN")
        errors = self.fails(self.cluster.connection(user="nobody"))
        self.assertIn("permission denied", errors)
        self.assertIn("42501", errors)

    def test_names_a_missing_server_and_database(self):
        self.assertIn("Check that the server runs", self.fails("host=/nowhere dbname=axlecast", code=6))
        self.assertIn("createdb", self.fails(self.cluster.connection("other")))
        self.assertIn("not valid", self.fails("hots=x"))

    def test_password_comes_from_a_file_and_is_never_shown(self):
        self.cluster.sql("SET password_encryption = 'scram-sha-256'; CREATE ROLE owner LOGIN SUPERUSER PASSWORD 'hunter2'")
        hba = self.cluster.data / "pg_hba.conf"
        hba.write_text("local all postgres trust\nlocal all all scram-sha-256\n")
        self.cluster.sql("SELECT pg_reload_conf()")
        connection = self.cluster.connection(user="owner")
        self.cluster.wait_for("SELECT count(*) FROM pg_hba_file_rules WHERE auth_method = 'scram-sha-256'", "1")
        secret = self.cluster.folder / "password"
        secret.write_text("hunter3\n")
        secret.chmod(0o600)
        wrong = self.fails(connection, "--password-file", secret)
        self.assertIn("password authentication failed", wrong)
        self.assertIn("Check the user and the password file", wrong)
        self.assertIn("password", self.fails(connection))
        in_string = self.fails(connection + " password=hunter2")
        for errors in (wrong, in_string):
            self.assertNotIn("hunter", errors)
        secret.write_text("hunter2\n")
        self.assertEqual(init(connection, "--password-file", str(secret))[0], 0)


class InitOfPair(unittest.TestCase):
    def test_finds_the_primary_before_and_after_a_failover(self):
        pair = self.enterContext(Pair())
        pair.primary.create_database()
        self.assertEqual(init(pair.connection())[1]["from"], 0)
        pair.primary.kill()
        self.assertEqual(init(pair.connection())[0], 6)  # the standby accepts no writes
        pair.promote()
        self.assertEqual(init(pair.connection())[1]["from"], VERSION)


if __name__ == "__main__":
    unittest.main()
