#!/usr/bin/env python3
"""Zeroes an axis through the CLI and acts on the outcome: zero_axis.py CONFIG DEVICE [--attempts N]

The exit code is that of `axlecast do` (docs/commands.md): 0 done and verified, 3 nothing was done, 4 failed,
5 indeterminate, 6 not known, 7 done but not verifiable."""

import argparse
import json
import subprocess
import sys
import time

DONE, REJECTED, FAILED, INDETERMINATE, NO_ANSWER, UNVERIFIED = 0, 3, 4, 5, 6, 7


def axlecast(*words):
    """Exit code and the outcome's JSON; {} if the CLI printed only an error on standard error."""
    done = subprocess.run(["axlecast", *words, "--json"], stdout=subprocess.PIPE, text=True, stdin=subprocess.DEVNULL)
    return done.returncode, json.loads(done.stdout) if done.stdout else {}


def zero(config, device, attempts):
    code, outcome = NO_ANSWER, {}
    for attempt in range(attempts):
        code, outcome = axlecast("do", device, "zero_single_turn", "--yes", "--config", config)
        # A time-out is no failure: the command may act yet. Ask for its id; never send it again.
        for _ in range(10):
            if code != NO_ANSWER or outcome.get("outcome") != "unknown":
                break
            code, outcome = axlecast("outcome", outcome["id"], "--config", config)
        # Nothing was done, and the machine's state was in the way: this may be sent again.
        if not outcome.get("temporary") or attempt + 1 == attempts:
            break
        time.sleep(1)
    return code, outcome


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("config")
    parser.add_argument("device")
    parser.add_argument("--attempts", type=int, default=3)
    arguments = parser.parse_args()
    code, outcome = zero(arguments.config, arguments.device, arguments.attempts)
    text = outcome.get("problem") or outcome.get("text", "")
    meaning = {DONE: "done and verified", UNVERIFIED: "done; look at the device", REJECTED: "nothing was done",
               FAILED: "failed, perhaps in part; look at the device",
               INDETERMINATE: "nobody can tell; look at the device", NO_ANSWER: "no answer"}
    print(f"{meaning.get(code, 'the CLI refused it')}: {outcome.get('reason', '')} {text}".rstrip())
    return code


if __name__ == "__main__":
    sys.exit(main())
