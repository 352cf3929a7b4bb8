"""axlecast fleet up: a server in a folder, that survives whatever ends it."""

import os
import pathlib
import pwd
import re
import shutil
import signal
import socket
import subprocess
import unittest

from cluster import LIMIT, binaries, new_folder, unprivileged
from machine import BIN, wait_for


class Up(unittest.TestCase):
    def setUp(self):
        self.root = new_folder()
        self.addCleanup(shutil.rmtree, self.root, True)
        self.folder = self.root / "desk"
        self.processes = []
        self.addCleanup(self.kill_all)

    def kill_all(self):
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.communicate()

    def start(self, *options, prefix=None):
        prefix = unprivileged() if prefix is None else prefix
        process = subprocess.Popen([*prefix, BIN / "axlecast", "fleet", "up", self.folder, *options], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True, cwd="/")
        self.processes.append(process)
        return process

    def connection_of(self, process):
        """Waits until the server is ready."""
        for line in process.stdout:
            if found := re.match(r"connection: (.*)", line):
                return found[1]
        self.fail(process.stderr.read())

    def ready(self, *options, prefix=None):
        process = self.start(*options, prefix=prefix)
        return process, self.connection_of(process)

    def psql(self, connection, statement):
        # As the owner of the folder, who alone may reach the socket.
        done = subprocess.run([*unprivileged(), binaries() / "psql", "-XAt", "-d", connection, "-c", statement], capture_output=True, text=True,
                              cwd="/", check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout.strip()

    def failure(self, process):
        errors = process.communicate(timeout=LIMIT)[1]
        self.assertEqual(process.returncode, 1, errors)
        return errors

    def end(self, process, number=signal.SIGINT):
        process.send_signal(number)
        errors = process.communicate(timeout=LIMIT)[1]
        self.assertEqual((process.returncode, errors), (0, ""))

    def add(self, connection, name):
        self.psql(connection, f"INSERT INTO axlecast.machine (name, installation) VALUES ('{name}', gen_random_uuid())")

    def machines(self, connection):
        return self.psql(connection, "SELECT string_agg(name, ' ' ORDER BY name) FROM axlecast.machine")

    def test_runs_until_ctrl_c_and_keeps_its_data(self):
        process, connection = self.ready()
        self.assertEqual(self.folder.stat().st_mode & 0o777, 0o700)
        self.add(connection, "a")
        self.end(process)
        self.assertFalse((self.folder / "data/postmaster.pid").exists())
        process, connection = self.ready()
        self.assertEqual(self.machines(connection), "a")
        self.end(process, signal.SIGTERM)

    def test_starts_again_after_a_kill(self):
        process, connection = self.ready()
        self.add(connection, "a")
        process.kill()
        process.communicate()
        process, connection = self.ready()  # at once: the processes of the killed server may still be there
        self.assertEqual(self.machines(connection), "a")
        server = int((self.folder / "data/postmaster.pid").read_text().split()[0])
        self.add(connection, "b")
        os.kill(server, signal.SIGKILL)
        errors = process.communicate(timeout=LIMIT)[1]
        self.assertEqual(process.returncode, 4)
        self.assertIn("the server has ended (killed by signal 9", errors)
        process, connection = self.ready()
        self.assertEqual(self.machines(connection), "a b")
        self.end(process)

    def test_starts_again_after_a_kill_while_the_data_is_created(self):
        process = self.start()
        wait_for(lambda: (self.folder / "data.new/PG_VERSION").exists(), "initdb begins")
        process.kill()
        process.communicate()
        process, connection = self.ready()
        self.assertEqual(self.psql(connection, "SELECT count(*) FROM axlecast.schema_version") > "0", True)
        self.assertFalse((self.folder / "data.new").exists())
        self.end(process)

    def test_a_stale_pid_file_of_another_process_is_removed(self):
        process, _ = self.ready()
        self.end(process)
        (self.folder / "data/postmaster.pid").write_text(f"{os.getpid()}\n{self.folder}/data\n1\n5432\n{self.folder}\n\n1 1\n")
        process, _ = self.ready()
        self.end(process)

    def test_only_one_runs_in_a_folder(self):
        process, _ = self.ready()
        self.assertIn("another axlecast fleet up uses", self.failure(self.start()))
        self.end(process)

    def test_port_is_local_and_asks_for_a_password(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        process, connection = self.ready("--port", str(port))
        self.assertIn(f"port={port}", connection)
        self.psql(connection, "ALTER ROLE axlecast PASSWORD 'hunter2'")
        for password, code in (("hunter2", 0), ("hunter3", 2)):
            done = subprocess.run([binaries() / "psql", "-XAt", "-d", f"host=127.0.0.1 port={port} dbname=axlecast user=axlecast", "-c", "SELECT 1"],
                                  env={**os.environ, "PGPASSWORD": password}, capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, code, done.stderr)
        listening = pathlib.Path("/proc/net/tcp").read_text() + pathlib.Path("/proc/net/tcp6").read_text()
        self.assertEqual(re.findall(rf"(\w+):{port:04X} \w+:0000 0A", listening), ["0100007F"])
        self.end(process)

    def test_root_must_name_a_user(self):
        if os.geteuid() != 0:
            self.skipTest("not root")
        self.assertIn("add --user NAME", self.failure(self.start(prefix=[])))
        self.assertIn("there is no user", self.failure(self.start("--user", "no-such-user", prefix=[])))

    def test_root_runs_it_as_another_user(self):
        if unprivileged()[:1] != ["setpriv"]:
            self.skipTest("there is no other user")
        process, connection = self.ready("--user", "nobody", prefix=[])
        self.add(connection, "a")
        server = int((self.folder / "data/postmaster.pid").read_text().split()[0])
        self.assertEqual(pathlib.Path(f"/proc/{server}").stat().st_uid, pwd.getpwnam("nobody").pw_uid)
        process.kill()
        process.communicate()
        process, connection = self.ready("--user", "nobody", prefix=[])
        self.assertEqual(self.machines(connection), "a")
        self.end(process)

    def test_path_that_is_too_long_is_refused(self):
        self.folder = self.root / ("x" * 100)
        self.assertIn("is too long for a socket", self.failure(self.start()))


if __name__ == "__main__":
    unittest.main()
