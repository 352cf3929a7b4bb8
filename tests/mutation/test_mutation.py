#!/usr/bin/env python3
"""The short form of the mutation tests, for ctest.

    test_mutation.py modbus_codec BUILD     the mutants of one codec
    test_mutation.py tool BUILD             that the tool fails when it has to: a test without one of its assertions, a survivor
                                            that is listed although it is killed, a line without a reason"""

import pathlib
import subprocess
import sys
import tempfile

RUN = pathlib.Path(__file__).resolve().parent / "run.py"
SURVIVOR = ("tests/mutation/sample/limited.cpp // Limited // value > maximum => value >= maximum")


def run(build, folder, survivors=None):
    """The exit status of the tool and what it prints."""
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
        file.write(survivors or "")
        file.flush()
        listed = [] if survivors is None else ["--survivors", file.name]
        done = subprocess.run([sys.executable, RUN, build, folder, "--built", *listed], capture_output=True, text=True)
    print(done.stdout + done.stderr, flush=True)
    return done.returncode, done.stdout + done.stderr


def expect(what, expected, status_and_output, contains=""):
    status, output = status_and_output
    if status != expected or contains not in output:
        raise SystemExit(f"{what}: exit status {status} instead of {expected}, or no \"{contains}\"")


def tool(build):
    expect("tests that kill every mutant", 0, run(build, "sample", ""))
    expect("a test without an assertion", 1, run(build, "sample_blind", ""), f"survives: {SURVIVOR}")
    expect("the same with a reason, below 95 %", 1, run(build, "sample_blind", f"{SURVIVOR} // only here\n"), " 1 survive")
    expect("a survivor that is killed", 1, run(build, "sample", f"{SURVIVOR} // it is killed\n"), "does not survive any more")
    expect("a survivor without a reason", 1, run(build, "sample", f"{SURVIVOR}\n"), "expected")


def main():
    case, build = sys.argv[1:]
    if case == "tool":
        tool(build)
    else:
        expect("a codec", 0, run(build, "modbus"))


if __name__ == "__main__":
    main()
