"""A driver killed on the way of a reset, again and again: each command ends in one outcome, and outcome and finding
agree with what the encoder counted. AXLECAST_KILLS sets how often (tools/campaign)."""

import json
import os
import random
import subprocess
import time
import unittest

from machine import BIN, Machine, one_axis, wait_for

KILLS = int(os.environ.get("AXLECAST_KILLS", "3"))
SUCCEEDED, REJECTED, FAILED, INDETERMINATE = 4, 5, 6, 9
EFFECT_SEEN, NO_EFFECT_SEEN, CANNOT_TELL = 1, 2, 3


class Kill(Machine):
    def test_outcome_and_finding_agree_with_the_encoder(self):
        chance = random.Random(1)
        config = self.write(one_axis("{start_deg: 100}"))
        data = self.watch(config, "--commands")
        self.simulator(config, "rs485-0")
        driver = self.driver(config, "rs485-0")
        self.bridge(config)
        encoder = lambda: self.simulated(config, "rs485-0")["devices"]["axis1"]
        tally = {}
        for round_number in range(KILLS):
            self.wait_state(data, 1)
            code, out, err = self.axlecast("simulate", config, "--bus", "rs485-0", "--set", "axis1.speed_rpm=60")
            self.assertEqual(code, 0, out + err)
            wait_for(lambda: abs(data.last("POSITION/axis1")["raw_counts"] - 65536) < 40000, "away from zero")
            self.axlecast("simulate", config, "--bus", "rs485-0", "--set", "axis1.speed_rpm=0")
            wait_for(lambda: abs(data.last("POSITION/axis1")["speed_rad_s"] or 0) < 1e-3 and data.last("POSITION/axis1")["flags"] & 0x10, "standstill")
            before = encoder()["zeroings"]
            running = subprocess.Popen([BIN / "axlecast", "zero", "axis1", "--yes", "--json", "--config", config],
                                       stdout=subprocess.PIPE, text=True, stdin=subprocess.DEVNULL)
            # A kill at a random instant is the point here: the sequence takes about 0.45 s.
            time.sleep(chance.uniform(0.1, 0.7))
            self.kill(driver)
            driver = self.driver(config, "rs485-0")
            out, _ = running.communicate(timeout=60)
            outcome = json.loads(out)
            done = encoder()["zeroings"] - before
            self.assertLessEqual(done, 1)
            statuses = lambda: [m for m in data.of("COMMAND_STATUS") if m["id"] == outcome["id"] and m["is_final"]]
            if outcome["state"] == INDETERMINATE:
                wait_for(lambda: any(m["finding"] for m in statuses()), "the finding")
                finding = next(m["finding"] for m in statuses() if m["finding"])
                self.assertIn(finding, (CANNOT_TELL, EFFECT_SEEN if encoder()["zeroings"] > before else NO_EFFECT_SEEN))
            else:
                self.assertEqual(done, 1 if outcome["state"] == SUCCEEDED else 0, outcome)
            self.assertEqual({m["state"] for m in statuses()}, {outcome["state"]}, "one outcome")
            key = f"state {outcome['state']}, done {done}"
            tally[key] = tally.get(key, 0) + 1
        print("killed", KILLS, "times:", tally)


if __name__ == "__main__":
    unittest.main(verbosity=2)
