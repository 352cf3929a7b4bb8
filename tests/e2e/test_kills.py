"""kill -9 of the bridge, and of a driver, at their transitions: before and after each thing that the bridge writes into
its journal or sends, and that the driver tells the bridge or has the encoder change. The program is then started again,
and what the client was told and what the journal has are compared with what the encoder counted.

axlecast-bridge-faults and axlecast-tformat-faults (tests/faulty_programs) die at $AXLECAST_KILL_AT. A spread of
AXLECAST_KILL_POINTS transitions is taken; 0: all of them (tools/campaign)."""

import json
import os
import re
import subprocess
import time
import unittest

from machine import BIN, LIMIT, Machine, one_axis, wait_for

POINTS = int(os.environ.get("AXLECAST_KILL_POINTS", "8"))
FAULTY = BIN.parent / "campaign"
SPEED_VALID = 0x10
NOTHING_DONE = {"rejected", "expired", "cancelled", "not_accepted"}
COUNTERS = ("zeroings", "turn_resets", "error_clears", "eeprom_writes")


class Kills(Machine):
    def run_machine(self):
        self.config = self.write(one_axis("{start_deg: 100}", "eeprom_writable: [10]", poll_hz=200))
        self.simulator(self.config, "rs485-0")
        self.data = self.watch(self.config, "--commands")
        self.runs = {}  # name: its present process
        self.kills = self.round = 0
        self.shaft_deg = 100
        self.tally = {}

    # -- the two programs

    COMMANDS = {"bridge": ("axlecast-bridge", ()), "driver": ("axlecast-tformat", ("--bus", "rs485-0"))}

    def run_program(self, name, kill_at=None):
        """kill_at: the faulty program; -1: it counts only."""
        program, options = self.COMMANDS[name]
        folder, suffix, env = (BIN, "", None) if kill_at is None else (FAULTY, "-faults", {"AXLECAST_KILL_AT": str(kill_at)})
        self.runs[name] = self.start(name, folder / (program + suffix), "--config", self.config, *options, env=env)

    def end_program(self, name):
        self.runs[name].terminate()
        self.runs[name].wait(LIMIT)

    def revive(self, name):
        """As a supervisor does: starts it again when it was killed."""
        code = self.runs[name].poll()
        if code is None:
            return
        self.assertEqual(code, -9, self.log(name)[-2000:])
        self.kills += 1
        self.run_program(name)

    # -- the encoder

    def counters(self):
        device = self.simulated(self.config, "rs485-0")["devices"]["axis1"]
        return {name: device[name] for name in COUNTERS}

    def turn_away_from_zero(self):
        """So that a zero can be distinguished from no zero."""
        mark = self.data.mark()
        self.shaft_deg = self.shaft_deg + 70
        self.set_simulated(self.config, "rs485-0", motion=f"move:{self.shaft_deg},300")
        angle = lambda: self.simulated(self.config, "rs485-0")["devices"]["axis1"]["angle_deg"]
        wait_for(lambda: abs(angle() - self.shaft_deg) < 0.01, lambda: f"the shaft at {self.shaft_deg}, not {angle()}")
        self.wait_standstill(mark)
        if not 3000 < self.data.last("POSITION/axis1")["raw_counts"] < 128000:
            self.turn_away_from_zero()

    def wait_standstill(self, mark, name=None):
        """As readings after `mark` have it; `name` is started again if it is killed meanwhile."""
        stands = lambda m: m["flags"] & SPEED_VALID and abs(m["speed_rad_s"]) < 1e-3

        def seen():
            if name:
                self.revive(name)
            return any(stands(m) for m in self.data.of("POSITION/axis1", since=mark)[-1:])

        wait_for(seen, "standstill is seen")

    def datum(self):
        code, out, err = self.axlecast("datum", "show", "axis1", "--json", "--config", self.config)
        self.assertIn(code, (0, 1), err)
        return (json.loads(out)["datum"] or {}).get("command") if code == 0 else None

    # -- the scene

    def scene(self):
        """Each with the counter that it raises by one, if any."""
        byte = f"{self.round % 255 + 1:02X}"
        return ((("eeprom", "write", "axis1", "10", byte, "--yes"), "eeprom_writes"), (("zero", "axis1", "--yes"), "zeroings"),
                (("home", "axis1", "--value", str(self.round), "--yes"), "datum"), (("eeprom", "read", "axis1", "10"), None))

    def give(self, name, words):
        """The outcome of one command, whichever process is killed meanwhile."""
        client = subprocess.Popen([BIN / "axlecast", *words, "--json", "--config", self.config], stdout=subprocess.PIPE,
                                  text=True, stdin=subprocess.DEVNULL)
        wait_for(lambda: self.revive(name) or client.poll() is not None, f"an outcome of {words}", 2 * LIMIT)
        outcome = json.loads(client.communicate()[0])
        if self.is_open(outcome):
            outcome = self.ask_until_known(name, outcome["id"])
        return outcome

    @staticmethod
    def is_open(outcome):
        return outcome["outcome"] == "unknown" or (outcome["outcome"] == "indeterminate" and outcome["found"] == "none")

    def ask_until_known(self, name, identity):
        """Asks for the id; of one that no bridge knows (a read that died with its bridge) nothing is known."""
        deadline = time.monotonic() + LIMIT
        while True:
            self.revive(name)
            _, out, _ = self.axlecast("outcome", identity, "--json", "--config", self.config)
            outcome = json.loads(out)
            unknown = outcome["outcome"] == "unknown" and "does not know" in outcome.get("problem", "")
            if unknown or not self.is_open(outcome) or time.monotonic() > deadline:
                return outcome

    def judge(self, words, counter, outcome, before, after):
        effects = {key: after[key] - before[key] for key in COUNTERS if after[key] != before[key]}
        done = effects.get(counter, 0)
        self.assertLessEqual(set(effects), {counter}, (words, outcome))
        self.assertLessEqual(done, 1, (words, outcome))
        word = outcome["outcome"]
        if counter == "datum":
            done = int(self.datum() == outcome["id"])
        if word == "succeeded":
            self.assertEqual(done, 0 if counter is None else 1, outcome)
        elif word in NOTHING_DONE:
            self.assertEqual(done, 0, outcome)
        elif word == "indeterminate":
            self.assertIn(outcome["found"], ("effect_seen", "no_effect_seen", "cannot_tell"), outcome)
            if counter and outcome["found"] != "cannot_tell":
                self.assertEqual(done, 1 if outcome["found"] == "effect_seen" else 0, outcome)
        elif word == "unknown":
            self.assertIsNone(counter, outcome)
        if counter and word != "not_accepted":
            self.compare_journal(outcome)
        what = " ".join(words[:2]) if words[0] == "eeprom" else words[0]
        key = f"{what}: {word} {outcome.get('found', '')} {outcome.get('reason', '')}, done {done}"
        self.tally[key] = self.tally.get(key, 0) + 1

    def compare_journal(self, outcome):
        code, out, err = self.axlecast("history", outcome["id"], "--json", "--config", self.config)
        if code != 0:  # refused at once: not taken up
            return self.assertIn(outcome["outcome"], NOTHING_DONE, err)
        written = json.loads(out.splitlines()[0])
        if outcome.get("text", "").endswith("the journal has not noted it"):  # a disk that has stalled for a second
            def noted():
                entry = json.loads(self.axlecast("history", outcome["id"], "--json", "--config", self.config)[1].splitlines()[0])
                return entry if entry["is_final"] else None
            written = wait_for(noted, "the outcome in the journal")
        self.assertEqual(written["outcome"], outcome["outcome"], (written, outcome))
        self.assertEqual(written["found"], outcome.get("found", "none"), (written, outcome))

    def play(self, name, kill_at):
        """One scene; the transitions of the faulty program, if it lived to print them."""
        self.round += 1
        self.turn_away_from_zero()
        self.end_program(name)
        kills = self.kills
        self.run_program(name, kill_at)
        before = self.counters()
        for words, counter in self.scene():
            self.wait_standstill(self.data.mark(), name)
            outcome = self.give(name, words)
            after = self.counters()
            self.judge(words, counter, outcome, before, after)
            before = after
        self.revive(name)
        if self.kills > kills:
            return None
        self.end_program(name)
        self.run_program(name)
        return int(re.findall(r"transitions: (\d+)", self.log(name))[-1])

    def kill_at_transitions(self, name):
        self.run_machine()
        self.run_program("bridge")
        self.run_program("driver")
        self.wait_online(self.data)
        transitions = self.play(name, -1)
        self.assertGreater(transitions, 20)
        step = max(1, transitions // POINTS) if POINTS else 1
        points = range(step // 2, transitions, step)
        for point in points:
            self.play(name, point)
        print(f"the {name}: {transitions} transitions, {len(points)} of them tried, killed {self.kills} times")
        for what, count in sorted(self.tally.items()):
            print(f"  {count:5}  {what}")
        # The later ones of a run may not be reached: what is sent while nothing happens depends on the time.
        self.assertGreaterEqual(self.kills, len(points) * 3 // 4)

    def test_the_bridge_at_its_transitions(self):
        self.kill_at_transitions("bridge")

    def test_the_driver_at_its_transitions(self):
        self.kill_at_transitions("driver")


if __name__ == "__main__":
    unittest.main(verbosity=2)
