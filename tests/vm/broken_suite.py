"""A suite of two cases, of which the second does what a test of the runner asks for."""

import os
import pathlib
import subprocess
import tempfile
import textwrap

RUN = pathlib.Path(__file__).resolve().parent / "run"
BUILD = pathlib.Path(os.environ["AXLECAST_BIN"]).parent

SUITE = textwrap.dedent("""\
    import pathlib
    import time
    import unittest


    class Broken(unittest.TestCase):
        def test_good(self):
            pass

        def test_then(self):
            {then}
    """)


def run_suite(case, then, *options, environment=None):
    """Runs a suite whose second case does `then`: (exit code, output)."""
    with tempfile.TemporaryDirectory(prefix="axlecast-vm-") as folder:
        suite = pathlib.Path(folder, "test_broken.py")
        suite.write_text(SUITE.format(then=then))
        done = subprocess.run([RUN, "--build", BUILD, "--results", f"{folder}/results", *options, suite],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              env={**os.environ, **(environment or {})}, check=False)
    case.assertNotIn("Traceback (most recent call last):\n  File \"" + str(RUN), done.stdout)
    return done.returncode, done.stdout
