"""The schema of the fleet database in a server of a test, as a user installs it."""
import os
import pathlib
import subprocess

AXLECAST = pathlib.Path(os.environ["AXLECAST_BIN"]) / "axlecast"


def install_schema(cluster, reader=None):
    """Runs `axlecast fleet init`; `reader`: the name of a login that may read."""
    cluster.create_database()
    logins = ["--reader", reader] if reader else []
    done = subprocess.run([AXLECAST, "fleet", "init", cluster.connection(), *logins], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"axlecast fleet init: {done.stderr}")
