#!/usr/bin/env python3
"""Explores the model of the command protocol (commands.pml) exhaustively with spin, and prints states and time. Also plants
faults into the model, each of which must give a counter-example. Exits 1 if a search finds what it must not, does not find what it
must, or is not complete.

  explore.py [--full]

--full: two commands, two restarts of the bridge and two of the driver. The short form has one command and one restart of each."""

import argparse
import pathlib
import sys
import tempfile

from verifier import Verifier

BREADTH = ["BREADTH"], ["-DSAFETY", "-DBFS"]  # finds a shortest counter-example
CYCLES = ["CYCLES"], ["-DNP"], "-l"            # finds an endless run
# Name, what it is, the smallest parameters with which it gives a counter-example, and the search.
FAULTS = [
    ("NO_EPOCH", "the driver does not compare epochs", (1, 0, 0), BREADTH),
    ("NO_FENCING", "the driver takes orders of a replaced bridge", (2, 1, 0), BREADTH),
    ("CANCEL_ENDS_RECOVERED", "a cancel ends a command of an earlier bridge that waits in the queue", (1, 1, 0), BREADTH),
    ("NO_MEMORY", "the driver does not store ids", (1, 0, 0), BREADTH),
    ("NO_BOOT_ID", "the driver takes orders for an earlier boot", (1, 0, 1), BREADTH),
    ("NO_RECOVERY", "a bridge does not end what an earlier one accepted", (1, 1, 0), BREADTH),
    ("LATE_HELLO", "HELLOs of a replaced driver arrive without end", (1, 0, 1), CYCLES),
]


def parameters_of(commands, bridge_restarts, driver_restarts):
    return [f"COMMANDS={commands}", f"BRIDGE_RESTARTS={bridge_restarts}", f"DRIVER_RESTARTS={driver_restarts}"]


def text_of(commands, bridge_restarts, driver_restarts):
    plural = lambda number, noun: f"{number} {noun}{'' if number == 1 else 's'}"  # noqa: E731
    return (f"{plural(commands, 'command')}, {plural(bridge_restarts, 'restart')} of the bridge, "
            f"{driver_restarts} of the driver")


class Exploration:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.searches = 0
        self.failed = False

    def verifier(self, parameters, options):
        self.searches += 1
        return Verifier(self.folder / str(self.searches), parameters, options)

    def fail(self, what, result):
        self.failed = True
        print(f"FAILED: {what}\n{result.text}")

    def holds(self, title, size, parameters, options, *arguments, all_reached=False):
        """Prints the figures of a search that must be complete and find no counter-example."""
        result = self.verifier([*parameters_of(*size), *parameters], options).search(*arguments)
        print(f"{title}: {text_of(*size)}: {result.states} states, {result.seconds:.1f} s, {result.memory_mb} MB, "
              f"{result.errors} counter-examples", flush=True)
        if result.errors != 0 or not result.complete:
            self.fail(title, result)
        unreached = [line for line in result.unreached() if "-end-" not in line]
        if all_reached and unreached:
            self.fail("steps of the model that no run takes:\n" + "\n".join(unreached), result)

    def finds(self, name, what, size, search):
        """Prints the counter-example to a planted fault."""
        parameters, options, *arguments = search
        result = self.verifier([*parameters_of(*size), name, *parameters], ["-O0", *options]).search(*arguments)
        steps = result.counter_example()
        print(f"{name}, {what}: {text_of(*size)}: counter-example of {len(steps)} steps", flush=True)
        for step in steps:
            print(f"    {step}")
        if not steps:
            self.fail(f"{name} gives no counter-example", result)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true")
    full = parser.parse_args().full
    size = (2, 2, 2) if full else (1, 1, 1)
    collapse = ["-O2" if full else "-O0", "-DCOLLAPSE"]
    with tempfile.TemporaryDirectory() as folder:
        explore = Exploration(folder)
        explore.holds("safety, and progress at the end of every run", size, [], ["-DSAFETY", *collapse], all_reached=full)
        # A cycle without a loss would be an endless run although the faults have ended.
        explore.holds("no run is endless once the faults end", size, ["CYCLES"], ["-DNP", *collapse], "-l")
        if full:
            # States that differ only in what has no further consequence are kept apart here.
            explore.holds("safety without merged states", size, ["KEEP"], ["-DSAFETY", *collapse])
            explore.holds("safety with late HELLOs of replaced drivers", size, ["LATE_HELLO"], ["-DSAFETY", *collapse])
            explore.holds("safety with more restarts", (2, 3, 3), [], ["-DSAFETY", *collapse])
        for fault in FAULTS:
            explore.finds(*fault)
    return 1 if explore.failed else 0


if __name__ == "__main__":
    sys.exit(main())
