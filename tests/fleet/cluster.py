"""PostgreSQL servers for the tests: a scratch cluster on a Unix socket, as a user that is not root, that can be killed and started again;
and a pair of a primary and its synchronous standby. A server that Debian's package runs is not touched.

    python3 cluster.py COMMAND...    runs COMMAND with $AXLECAST_TEST_DATABASE, the connection string of a new cluster
"""

import csv
import glob
import io
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

LIMIT = 120  # s, for a server to start on a loaded host
FAST = {"fsync": "off", "shared_buffers": "32MB", "max_connections": "60", "listen_addresses": "''", "autovacuum_naptime": "10s"}


def binaries():
    """Returns the folder of the newest installed server."""
    found = glob.glob("/usr/lib/postgresql/*/bin/postgres")
    if not found:
        raise RuntimeError("no PostgreSQL server: apt-get install postgresql-15")
    return pathlib.Path(max(found, key=lambda path: int(path.split("/")[4]))).parent


def unprivileged():
    """Returns what to put before a command so that it does not run as root, which PostgreSQL refuses."""
    if os.geteuid() != 0:
        return []
    if any(int(line.split()[2]) > 65534 for line in pathlib.Path("/proc/self/uid_map").read_text().splitlines()):
        return ["setpriv", "--reuid=nobody", "--regid=nogroup", "--clear-groups", "--"]
    # Root of a user namespace that has no other user (tests/e2e/in_namespace.sh without root).
    return ["unshare", "--user", "--map-user=65534", "--map-group=65534", "--"]


def new_folder():
    """Returns a new folder that the server's user may write."""
    folder = pathlib.Path(tempfile.mkdtemp(prefix="axlecast-pg-"))
    if unprivileged()[:1] == ["setpriv"]:
        shutil.chown(folder, "nobody", "nogroup")
    return folder


def run(*words, **options):
    """Runs a command as the server's user, and returns its output. A failure shows what the command printed."""
    done = subprocess.run([*unprivileged(), *map(str, words)], capture_output=True, text=True, cwd="/", **options)
    if done.returncode != 0:
        raise RuntimeError(f"{words[0]}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def children_of(pid):
    """Returns the processes that `pid` has started."""
    try:
        return [int(child) for child in pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except FileNotFoundError:
        return []


class Cluster:
    """One server, in a folder of its own. A context manager: afterwards the server and the folder are gone."""

    def __init__(self, folder=None, port=5432, **settings):
        self.folder = pathlib.Path(folder) if folder else new_folder()
        self.owned = folder is None
        self.port = port
        self.data = self.folder / f"data{port}"
        self.settings = {**FAST, **settings}
        self.process = None

    def __enter__(self):
        return self.create().start()

    def __exit__(self, *_):
        self.kill()
        if self.owned:
            shutil.rmtree(self.folder, ignore_errors=True)

    def create(self):
        run(binaries() / "initdb", "-D", self.data, "-U", "postgres", "-A", "trust", "-E", "UTF8", "--locale=C", "--no-sync")
        return self

    def start(self, wait=True):
        """Starts the server; waits until it answers unless `wait` is false."""
        options = [word for name, value in self.settings.items() for word in ("-c", f"{name}={value}".replace("''", ""))]
        with open(self.folder / f"log{self.port}", "ab") as log:
            # pylint: disable=consider-using-with
            self.process = subprocess.Popen(
                [*unprivileged(), str(binaries() / "postgres"), "-D", str(self.data), "-k", str(self.folder), "-p", str(self.port),
                 *options], stdout=log, stderr=log, cwd="/")
        if wait:
            self.wait_until_ready()
        return self

    def wait_until_ready(self):
        deadline = time.monotonic() + LIMIT
        while subprocess.run([binaries() / "pg_isready", "-q", "-h", self.folder, "-p", str(self.port)], check=False).returncode != 0:
            if self.process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError(f"the server does not start:\n{self.log()}")
            time.sleep(0.05)

    def kill(self):
        """Kills the server and all its processes at once, as a power cut would."""
        if self.process is None:
            return
        processes = [self.process.pid, *children_of(self.process.pid)]
        for pid in processes:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        self.process.wait()
        deadline = time.monotonic() + LIMIT  # the others have init as their parent now
        while any(pathlib.Path(f"/proc/{pid}/stat").exists() and not is_zombie(pid) for pid in processes[1:]):
            if time.monotonic() > deadline:
                raise RuntimeError("a killed server process is still there")
            time.sleep(0.01)
        self.process = None

    def stop(self):
        """Stops the server as an administrator does (fast shutdown)."""
        self.process.send_signal(signal.SIGINT)
        self.process.wait(LIMIT)
        self.process = None

    def restart(self):
        self.stop()
        return self.start()

    def set(self, **settings):
        """Changes settings of the running server that need no restart."""
        for name, value in settings.items():
            self.sql(f"ALTER SYSTEM SET {name} = '{value}'", database="postgres")
        self.sql("SELECT pg_reload_conf()", database="postgres")

    def log(self):
        return (self.folder / f"log{self.port}").read_text(errors="replace")

    def connection(self, database="axlecast", user="postgres"):
        return f"host={self.folder} port={self.port} dbname={database} user='{user}'"

    def create_database(self, name="axlecast"):
        self.sql(f"CREATE DATABASE {name}", database="postgres")
        return self

    def sql(self, text, database="axlecast", user="postgres"):
        """Runs statements (all in one transaction if there are several), and returns the rows of the last one as lists of texts. NULL becomes None."""
        done = subprocess.run([binaries() / "psql", "-X", "-q", "--csv", "-t", "-v", "ON_ERROR_STOP=1", "-P", "null=\\N", "-d",
                               self.connection(database, user), "-f", "-"], input=text, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise SqlError(done.stderr.strip())
        return [[None if value == "\\N" else value for value in row] for row in csv.reader(io.StringIO(done.stdout))]

    def value(self, text, **options):
        """Returns the only value of a query."""
        return self.sql(text, **options)[0][0]

    def wait_for(self, query, expected="t", limit=LIMIT, **options):
        """Waits until the only value of a query is `expected`."""
        deadline = time.monotonic() + limit
        while (seen := self.value(query, **options)) != expected:
            if time.monotonic() > deadline:
                raise RuntimeError(f"{query}: {seen} after {limit} s, expected {expected}")
            time.sleep(0.05)


def is_zombie(pid):
    try:
        return re.sub(r".*\) ", "", pathlib.Path(f"/proc/{pid}/stat").read_text())[0] == "Z"
    except FileNotFoundError:
        return True


class SqlError(Exception):
    """What psql printed."""


class Pair:
    """A primary and its synchronous standby, on ports 5432 and 5433 of one socket folder. A context manager."""

    def __init__(self, **settings):
        self.folder = new_folder()
        self.primary = Cluster(self.folder, 5432, **settings)
        self.standby = Cluster(self.folder, 5433, **settings)

    def __enter__(self):
        self.primary.create().start()
        self.add_standby()
        return self

    def __exit__(self, *_):
        self.primary.kill()
        self.standby.kill()
        shutil.rmtree(self.folder, ignore_errors=True)

    def connection(self, database="axlecast", user="postgres"):
        """Names both: a writer finds the one that accepts writes."""
        return f"host={self.folder},{self.folder} port=5432,5433 dbname={database} user={user}"

    def promote(self):
        """Makes the standby a primary that waits for no standby."""
        self.standby.sql("SELECT pg_promote(true, 120)", database="postgres")
        self.standby.set(synchronous_standby_names="")

    def add_standby(self):
        """Makes an empty server the synchronous standby of the primary, as docs/fleet.md states."""
        run("rm", "-rf", self.standby.data)
        run(binaries() / "pg_basebackup", "-h", self.folder, "-p", self.primary.port, "-U", "postgres", "-D", self.standby.data, "-R", "-X",
            "stream", "-c", "fast", "--no-sync")
        configuration = self.standby.data / "postgresql.auto.conf"  # names the standby for synchronous_standby_names
        text = re.sub("primary_conninfo = '(application_name=standby )?", "primary_conninfo = 'application_name=standby ",
                      configuration.read_text())
        configuration.write_text(text)
        self.standby.start()
        self.primary.set(synchronous_standby_names="standby")
        self.primary.wait_for("SELECT coalesce((SELECT sync_state FROM pg_stat_replication), '')", "sync", database="postgres")

    def fail_over(self):
        """Kills the primary and promotes the standby, which then is the primary. The other one stays down."""
        self.primary.kill()
        self.set_standby_frozen(False)
        self.promote()
        self.primary, self.standby = self.standby, self.primary

    def set_standby_frozen(self, frozen):
        """Stops the standby's receiver, so that commits wait, or resumes it."""
        for pid in children_of(self.standby.process.pid):
            os.kill(pid, signal.SIGSTOP if frozen else signal.SIGCONT)


if __name__ == "__main__":
    with Cluster() as cluster:
        cluster.create_database()
        sys.exit(subprocess.run(sys.argv[1:], env={**os.environ, "AXLECAST_TEST_DATABASE": cluster.connection(),
                                                   "AXLECAST_TEST_SERVER": str(cluster.process.pid)}, check=False).returncode)
