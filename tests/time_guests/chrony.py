"""chronyd in the guests."""

import pathlib
import sys

from guests import ADDRESS, OTHER, ROOT, wait_for

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "chrony"))
import chrony_package  # noqa: E402  tests/chrony

SETTINGS = {
    ROOT: "local stratum 1\nallow 10.0.0.0/24\n",
    # As docs/time.md has it: CLOCK_MONOTONIC stays within max_slew_ppm.
    OTHER: f"server {ADDRESS[ROOT]} iburst minpoll -2 maxpoll -2 xleave\nmakestep 0.0001 3\nrtcsync\nmaxslewrate 500\n",
}
# Moves CLOCK_REALTIME by 5 ms: ADJ_SETOFFSET | ADJ_NANO of struct timex.
STEP = ("import ctypes, struct; t = ctypes.create_string_buffer(208); struct.pack_into('<I', t, 0, 0x2100); "
        "struct.pack_into('<2q', t, 72, 0, 5000000); exit(ctypes.CDLL(None).clock_adjtime(0, t) < 0)")


def start(run):
    """chronyd in both guests; in b also a record of its claims, twice a second."""
    programs = chrony_package.prepare(run.build / "vm")
    for guest in (run.a, run.b):
        (guest.folder / "chrony.conf").write_text(SETTINGS[guest.name] + "pidfile /run/tmp/chronyd.pid\n")
        guest(f"{programs}/usr/sbin/chronyd -u root -f /run/vm/chrony.conf")
    run.b("while :; do echo $(cut -d' ' -f1 /proc/uptime),$("
          f"{programs}/usr/bin/chronyc -c tracking); sleep 0.5; done >>/run/vm/chrony.csv 2>&1 &")
    record = run.b.folder / "chrony.csv"
    wait_for(lambda: record.exists() and "Normal" in record.read_text(), "chronyd of b is synchronised", 120)
