#!/usr/bin/env python3
"""Plants one defect after the other into a copy of the source, and runs the simulation until it finds it. Exit code 0: each was found.

  tests/simulation/planted.py                  all
  tests/simulation/planted.py epoch sync       those of these names

A copy of the tree is built in build/planted. Takes some minutes for the build, then about a minute for each defect."""

import pathlib
import shutil
import subprocess
import sys
import time

TOP = pathlib.Path(__file__).resolve().parents[2]
COPY = TOP / "build/planted"
HOURS = 1  # of the machine: by then it must be found
PROGRAM = "whole_machine_in_virtual_time"
SEEDS = {"sequence": 1000}  # the first one, where an hour from seed 1 does not show the defect: some two hours do on average

# Name, file, the present text, the text that takes its place, and what the defect is.
PLANTED = [
    ("late_reply", "drivers/runtime/bus/stale_reply_guard.cpp",
     "  if (exchange.reply_length == nullptr) return now;\n", "  return now;\n",
     "a late reply is taken as that of another request"),
    ("sequence", "drivers/runtime/command/command_authority.cpp",
     "  if (bridge_epoch <= newest_) return Verdict::kOlder;\n  newest_", "  newest_",
     "a driver takes orders in any sequence"),
    ("fsync", "bridge/store/database.cpp", "PRAGMA synchronous = FULL", "PRAGMA synchronous = OFF",
     "the journal acknowledges what is not on the disk"),
    ("epoch", "bridge/store/sqlite_store.cpp", "{first + count - 1});", "{last});",
     "the epoch is not stored"),
    ("checksum", "drivers/tformat/codec.cpp", "  if (Crc(reply) != 0) return Failed(ReplyError::kChecksum);\n", "",
     "a damaged reply is taken as a reading"),
    ("widening", "core/time/offset_bound.cpp",
     "MonoNs Widening(MonoNs time, std::int64_t ppb) { return (std::abs(time) / kMillisecond + 1) * ppb / 1'000 + 1; }",
     "MonoNs Widening(MonoNs time, std::int64_t ppb) { return (std::abs(time) / kMillisecond + 1) * ppb / 1'000'000 + 1; }",
     "the bound of a clock does not grow with time"),
    ("uncertainty", "drivers/runtime/axis/device_publisher.cpp",
     "position_.time_uncertainty_ns = Narrow(sample.at.HalfWidth());", "position_.time_uncertainty_ns = 1'000;",
     "a reading states its instant as known"),
    ("memory_of_ids", "drivers/runtime/command/driver_command_server.cpp",
     "if (CommandStatusTable::Entry* const known = statuses_.Find(IdOf(order.id))) {",
     "if (CommandStatusTable::Entry* const known = statuses_.Find(CommandId{})) {",
     "a driver executes an order again when it is repeated"),
    ("log_sync", "platform/os/log_file.cpp", "  if (fdatasync(file_.get()) != 0) return errno;\n", "",
     "a log is not on the disk when it should be"),
    ("losses", "core/messages/sequence_count.cpp", "lost_ += seq - publisher.newest - 1;", "lost_ += 1;",
     "several messages that are lost in a row count as one"),
    ("alarm_table", "bridge/state/device_state.cpp",
     "  return static_cast<std::size_t>(others) < AlarmShelves::kMax;\n", "  return others >= 0;\n",
     "the table of shelved alarms is not bounded"),
    ("freshness", "client/axlecast/position_tracker.h", "  if (age + valid_half_width_ > max_age) return Freshness::kStale;\n", "", "an old reading is called fresh"),
]


def run(*command, **options):
    return subprocess.run(command, cwd=COPY / "source", check=False, **options)


def prepare():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=TOP, stdout=subprocess.PIPE, check=True, text=True).stdout
    for name in filter(None, listed.split("\0")):
        source, copy = TOP / name, COPY / "source" / name
        # A file that is the same is not compiled again; one in which a defect was left is restored.
        if not source.is_file() or (copy.exists() and copy.read_bytes() == source.read_bytes()):
            continue
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, copy)
    configured = run("cmake", "--preset", "gcc", "-DAXLECAST_UPLOT=none", "-DAXLECAST_UNIT_TESTS=OFF", stdout=subprocess.DEVNULL)
    if configured.returncode != 0:
        sys.exit("the copy cannot be configured")


def build():
    built = run("cmake", "--build", "--preset", "gcc", "--target", PROGRAM, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if built.returncode != 0:
        sys.exit(built.stdout[-4000:])


def try_one(name, file, old, new, what):
    path = COPY / "source" / file
    text = path.read_text()
    if text.count(old) < 1:
        sys.exit(f"{name}: {file} does not contain the place of the defect any more: correct PLANTED")
    path.write_text(text.replace(old, new, 1))
    try:
        build()
        began = time.monotonic()
        done = run(COPY / "source/build/gcc/campaign" / PROGRAM, str(HOURS), "--seed", str(SEEDS.get(name, 1)), "--stories", "1", "--no-shrink", stdout=subprocess.PIPE, text=True)
    finally:
        path.write_text(text)
    story = [line for line in done.stdout.splitlines() if "<-- breach" in line]
    if done.returncode == 1 and story:
        print(f"found   {name}: {what}; after {time.monotonic() - began:.0f} s: {story[0].strip()}", flush=True)
        return True
    print(f"MISSED  {name}: {what}; exit code {done.returncode} after {HOURS} machine-hours", flush=True)
    return False


def main():
    wanted = sys.argv[1:]
    unknown = set(wanted) - {defect[0] for defect in PLANTED}
    if unknown:
        sys.exit(f"no such defect: {' '.join(sorted(unknown))}; there are: {' '.join(defect[0] for defect in PLANTED)}")
    prepare()
    build()
    found = [try_one(*defect) for defect in PLANTED if not wanted or defect[0] in wanted]
    print(f"{sum(found)} of {len(found)} planted defects were found")
    sys.exit(0 if all(found) else 1)


if __name__ == "__main__":
    main()
