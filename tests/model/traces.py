#!/usr/bin/env python3
"""Checks that real runs of bridge and driver are runs of the model. The simulation of tests/command_simulation writes the events
of COUNT worlds of two commands. For each, spin searches a run of commands.pml with the same events in the same sequence. Also
damages traces, each of which the model must refuse. Exits 1 if a trace of a real run is refused, or a damaged one is accepted.

  traces.py PROGRAM COUNT     PROGRAM: command_traces"""

import argparse
import collections
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

from verifier import Verifier

EVENTS = ["accepted", "routed", "sent", "begun", "taken", "effect", "reported", "outcome", "finding", "published",
          "bridge_killed", "driver_killed", "end"]
WORDS = {"rejected": 6, "expired": 7, "cancelled": 8, "failed": 9, "succeeded": 10, "indeterminate": 5, "effect_seen": 11,
         "no_effect_seen": 12, "cannot_tell": 13}
MAX_KILLS = 100
MAX_EVENTS = 240


def traces_of(program, count):
    """The lines of each trace. Fails if the simulation has found a breach itself."""
    done = subprocess.run([program, str(count)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{program}: exit code {done.returncode}\n{done.stderr}")
    traces = [part.splitlines()[1:] for part in re.split(r"^(?=trace )", done.stdout, flags=re.MULTILINE) if part]
    if len(traces) != count:
        sys.exit(f"{len(traces)} traces instead of {count}")
    return traces


def events_of(lines):
    """The events that the model can see. Of the orders, that is the first EXECUTE of a command by each bridge."""
    events, sent = [], set()
    for line in lines:
        name, *words = line.split()
        if name != "order":
            events.append((name, *words))
            continue
        kind, command, bridge = words[:3]
        if kind == "execute" and command != "-" and (command, bridge) not in sent:
            sent.add((command, bridge))
            events.append(("sent", command))
    return events


def epochs_increase(lines):
    """What the model takes for granted: every order has a higher epoch than all before it, also over restarts of the bridge."""
    epochs = [int(line.split()[4]) for line in lines if line.startswith("order ")]
    return all(first < second for first, second in zip(epochs, epochs[1:]))


def number_of(word):
    return WORDS[word] if word in WORDS else int(word)


class Model:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        parameters = ["TRACE", "COMMANDS=2", f"BRIDGE_RESTARTS={MAX_KILLS}", f"DRIVER_RESTARTS={MAX_KILLS}"]
        Verifier(self.folder / "pan", parameters, ["-O1", "-DSAFETY"])

    def reached(self, events):
        """How many of the events the model can follow, and how many there are with the end."""
        if len(events) > MAX_EVENTS or sum(event[0].endswith("_killed") for event in events) > MAX_KILLS:
            sys.exit(f"a trace of {len(events)} events is too long for the model")
        file = self.folder / "trace"
        with open(file, "w", encoding="ascii") as out:
            for name, *words in [*events, ("end",)]:
                command, word, *_ = [*map(number_of, words), 0, 0]
                out.write(f"{EVENTS.index(name) + 1} {command} {word}\n")
        done = subprocess.run([self.folder / "pan" / "pan", "-w16", "-m10000"], env={**os.environ, "TRACE": str(file)},
                              cwd=self.folder, capture_output=True, text=True, check=False)
        reached, length = map(int, re.search(r"reached (\d+) of (\d+)", done.stdout).groups())
        return reached, length

    def accepts(self, events):
        reached, length = self.reached(events)
        return reached == length


def explain(model, number, events):
    reached, _ = model.reached(events)
    print(f"trace {number}: the model cannot follow event {reached + 1}:")
    for index, event in enumerate(events):
        print(f"  {'->' if index == reached else '  '} {' '.join(event)}")


# ---- damaged traces: a function returns the damaged events, or None if the trace has no place for this damage ----


def index_of(events, *names):
    """The places of the first events of these names that are about one command; None if a name is missing."""
    for command in ("0", "1"):
        places = [next((i for i, event in enumerate(events) if event[:2] == (name, command)), None) for name in names]
        if None not in places:
            return places
    return None


def doubled(name):
    def damage(events):
        place = index_of(events, name)
        return place and [*events[:place[0] + 1], events[place[0]], *events[place[0] + 1:]]
    return damage


def swapped(first, second):
    def damage(events):
        places = index_of(events, first, second)
        if not places:
            return None
        result = list(events)
        result[places[0]], result[places[1]] = result[places[1]], result[places[0]]
        return result
    return damage


def without(name, later):
    def damage(events):
        places = index_of(events, name, later)
        return places and [*events[:places[0]], *events[places[0] + 1:]]
    return damage


def outcome_changed(before, after):
    """The driver, the journal and the bridge all have the wrong outcome: only the effect contradicts it."""
    def damage(events):
        changed = [(*event[:2], after) if event[0] in ("reported", "outcome", "published") and event[2] == before else event
                   for event in events]
        return changed if changed != events else None
    return damage


DAMAGES = {
    "a second effect": doubled("effect"),
    "a second outcome": doubled("outcome"),
    "routed before it is in the journal": swapped("accepted", "routed"),
    "sent before that is in the journal": swapped("routed", "sent"),
    "published before it is in the journal": swapped("outcome", "published"),
    "an effect before the driver has begun": swapped("taken", "effect"),
    "no entry in the journal before the effect": without("routed", "effect"),
    "rejected with an effect": outcome_changed("succeeded", "rejected"),
    "failed instead of succeeded": outcome_changed("succeeded", "failed"),
    "succeeded without an effect": outcome_changed("failed", "succeeded"),
}


def check_damages(model, traces, each):
    """Damages up to `each` traces in each way. Returns the number of damaged traces that were accepted."""
    accepted = 0
    for name, damage in DAMAGES.items():
        damaged = []
        for events in traces:
            result = damage(events)
            if result:
                damaged.append(result)
            if len(damaged) == each:
                break
        wrong = [events for events in damaged if model.accepts(events)]
        accepted += len(wrong)
        print(f"  {len(damaged) - len(wrong):6} of {len(damaged)} refused: {name}")
        for events in wrong[:1]:
            print("\n".join("    " + " ".join(event) for event in events))
        if not damaged:
            print("no trace has a place for this damage: more traces are needed")
            accepted += 1
    return accepted


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("count", type=int)
    arguments = parser.parse_args()
    start = time.monotonic()
    raw = traces_of(arguments.program, arguments.count)
    traces = [events_of(lines) for lines in raw]
    kinds = collections.Counter(event[0] for events in traces for event in events)
    outcomes = collections.Counter(event[2] for events in traces for event in events if event[0] in ("outcome", "finding"))
    unordered = [number for number, lines in enumerate(raw, 1) if not epochs_increase(lines)]
    for number in unordered:
        print(f"trace {number}: an order has no higher epoch than one before it")
    with tempfile.TemporaryDirectory() as folder:
        model = Model(folder)
        refused = [number for number, events in enumerate(traces, 1) if not model.accepts(events)]
        for number in refused[:3]:
            explain(model, number, traces[number - 1])
        print(f"{len(traces) - len(refused)} of {len(traces)} traces of the real bridge and driver are runs of the model")
        print(f"  {sum(kinds.values())} events: {', '.join(f'{kinds[name]} {name}' for name in EVENTS if kinds[name])}")
        print(f"  {', '.join(f'{number} {word}' for word, number in outcomes.most_common())}")
        print("damaged traces:")
        accepted = check_damages(model, traces, max(1, len(traces) // 100))
    print(f"{time.monotonic() - start:.1f} s")
    return 1 if refused or unordered or accepted else 0


if __name__ == "__main__":
    sys.exit(main())
