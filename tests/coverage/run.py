#!/usr/bin/env python3
"""Prints which branches of a folder's sources the unit tests of this folder take, by clang's source-based coverage. A branch is one
outcome, true or false, of one condition. Each branch that no test takes needs a reason in reasons.txt. Exits 1 on one without a
reason, and on a reason for a branch that is taken.

    run.py BUILD [FOLDER...]     BUILD: a build by the preset coverage; FOLDER: default all"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
TOP = HERE.parents[1]
LLVM = "14"
SOMETIMES = "sometimes: "  # begins the reason of a branch that the scheduling of threads takes in some runs

# Name: what its sources begin with, and the programs of their tests.
FOLDERS = {
    "tformat": (["drivers/tformat/codec."], ["family_tformat_test"]),
    "saa_serial": (["drivers/saa_serial/codec.", "drivers/saa_serial/stream_parser."], ["family_saa_serial_test"]),
    "saa_modbus": (["drivers/saa_modbus/codec."], ["family_saa_modbus_test"]),
    "saa_can": (["drivers/saa_can/codec."], ["family_saa_can_test"]),
    "ssi": (["drivers/ssi/codec."], ["family_ssi_test"]),
    "biss": (["drivers/biss/codec."], ["family_biss_test"]),
    "tsubaki_sc": (["drivers/tsubaki_sc/requests.", "drivers/tsubaki_sc/register_map."], ["family_tsubaki_sc_test"]),
    "modbus": (["drivers/protocol/modbus/"], ["protocol_modbus_test"]),
    "canopen": (["drivers/protocol/canopen/"], ["protocol_canopen_test"]),
    "position": (["drivers/runtime/axis/"], ["runtime_axis_test"]),
    "bridge": (["bridge/access/", "bridge/dispatch/", "bridge/state/", "bridge/store/"],
               ["bridge_access_test", "bridge_dispatch_test", "bridge_state_test", "bridge_store_test"]),
    "recorder": (["tools/recorder/"], ["recorder_test"]),
}


def run(*command, **options):
    return subprocess.run([str(word) for word in command], check=True, stdout=subprocess.PIPE, text=True, **options).stdout


def measured(build, program):
    """What llvm-cov reports of a program."""
    with tempfile.TemporaryDirectory() as folder:
        raw, merged = pathlib.Path(folder) / "raw", pathlib.Path(folder) / "merged"
        path = build / "test" / program
        subprocess.run([path, "--gtest_brief=1"], check=True, stdout=subprocess.DEVNULL, env={**os.environ, "LLVM_PROFILE_FILE": str(raw)})
        run(f"llvm-profdata-{LLVM}", "merge", "-o", merged, raw)
        return json.loads(run(f"llvm-cov-{LLVM}", "export", path, f"-instr-profile={merged}"))["data"][0]["files"]


def branches(files, folders):
    """(file, line, column, text of the condition, true or false): whether it is taken. A template or a header counts once."""
    taken = {}
    for file in files:
        path = pathlib.Path(os.path.normpath(file["filename"]))
        name = str(path.relative_to(TOP)) if path.is_relative_to(TOP) else ""
        product = name.endswith((".cpp", ".h")) and not name.endswith(("_test.cpp", "_fixture.h")) and "/simulat" not in name
        if not product or not name.startswith(tuple(folders)):
            continue
        lines = path.read_text(encoding="utf-8").split("\n")
        for first, start, last, end, when_true, when_false, *_ in file["branches"]:
            whole = lines[first - 1][start - 1:end - 1] if first == last else lines[first - 1][start - 1:]
            for outcome, count in (("true", when_true), ("false", when_false)):
                key = (name, first, start, whole.strip(), outcome)
                taken[key] = taken.get(key, 0) + count
    return {key: count > 0 for key, count in taken.items()}


def reasons(path):
    """file // condition // true or false: reason, for each place of the file with this condition; `*`: any."""
    known = {}
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if not line or line.startswith("#"):
            continue
        parts = line.split(" // ")
        if len(parts) != 4 or not parts[3].strip():
            raise SystemExit(f"{path}:{number}: expected `file // condition // true or false // reason`")
        known[tuple(parts[:3])] = parts[3]
    return known


def reason_of(key, known):
    """The entry of `known` for a branch, if there is one."""
    file, _, _, text, outcome = key
    return next((entry for entry in ((file, text, outcome), (file, text, "*"), (file, "*", "*")) if entry in known), None)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("folders", nargs="*", metavar="FOLDER")
    given = parser.parse_args()
    if unknown := set(given.folders) - set(FOLDERS):
        parser.error(f"no such folder: {' '.join(sorted(unknown))}; there are: {' '.join(FOLDERS)}")
    known = reasons(HERE / "reasons.txt")
    good, used = True, set()
    for name in given.folders or FOLDERS:
        folders, programs = FOLDERS[name]
        found = branches([file for program in programs for file in measured(given.build, program)], folders)
        missed = sorted(key for key, taken in found.items() if not taken)
        explained = {key: reason_of(key, known) for key in missed}
        unexplained = [key for key in missed if explained[key] is None]
        used |= set(explained.values())
        share = 100 * (len(found) - len(missed)) / max(1, len(found))
        print(f"{name:12} {len(found):5} branches {share:6.1f} % taken, {len(missed):3} not taken, {len(unexplained):3} of them without a reason", flush=True)
        for file, line, _, text, outcome in unexplained:
            print(f"  {file}:{line}: never {outcome}: {text}")
        good = good and bool(found) and not unexplained
        for key in known:
            if key[0].startswith(tuple(folders)) and key not in used and not known[key].startswith(SOMETIMES):
                print(f"  taken, or no condition any more: {' // '.join(key)}")
                good = False
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
