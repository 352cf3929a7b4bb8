"""A time base over two hosts: here two time namespaces, whose CLOCK_MONOTONIC and CLOCK_MONOTONIC_RAW differ by 25 hours."""

import json
import signal
import subprocess
import time
import unittest

from machine import BIN, Machine, one_axis, wait_for

AHEAD = 90_000  # s, of the second host's clocks
# Beside the half width that is stated: the width of this test's own readings, and what CLOCK_MONOTONIC was slewed since the message.
SLACK = 20_000  # ns
SLEW_PPM = 200
ROOT, OTHER = "root", "cell2"


def raw_ahead():
    """CLOCK_MONOTONIC_RAW minus CLOCK_MONOTONIC of this host, in ns: the narrowest of some readings."""
    best = None
    for _ in range(20):
        before = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
        raw = time.clock_gettime_ns(time.CLOCK_MONOTONIC_RAW)
        after = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
        if best is None or after - before < best[0]:
            best = after - before, raw - (before + after) // 2
    return best[1]


class TwoHosts(Machine):
    def setUp(self):
        super().setUp()
        self.config = self.write(f"{one_axis()}time: {{root: {ROOT}, address: 127.0.0.1}}\n")
        self.root = self.service(ROOT)
        self.other = self.service(OTHER, *self.elsewhere())
        self.messages = self.watch(self.config, "--commands")

    def tearDown(self):
        self.other.kill()  # unshare hands no SIGTERM on
        super().tearDown()

    def elsewhere(self):
        return ["unshare", "--time", "--fork", "--kill-child", "--monotonic", str(AHEAD), "--boottime", str(AHEAD)]

    def service(self, host, *before):
        return self.start(f"time-{host}", *before, BIN / "axlecast", "time", self.config, "--host", host)

    def claims(self, host, since=0):
        return [m for m in self.messages.of(f"TIME/{host}", since) if m["half_width_ns"] >= 0]

    def wait_claim(self, host, since=0):
        return wait_for(lambda: self.claims(host, since), lambda: f"a claim of {host}: {self.log(f'time-{host}')}")

    def wait_no_claim(self, since):
        return wait_for(lambda: [m for m in self.messages.of(f"TIME/{OTHER}", since) if m["half_width_ns"] < 0], "the end of the claim")

    def assert_true(self, message, ahead):
        """The root's clock is this test's, and the other host's is it plus a constant, so that the truth is known."""
        here = message["mono_ns"] - ahead * 1_000_000_000
        age = time.clock_gettime_ns(time.CLOCK_MONOTONIC) - here
        error = abs(message["base_ns"] - here - raw_ahead())
        self.assertLessEqual(error, message["half_width_ns"] + SLACK + age * SLEW_PPM // 1_000_000, message)

    def test_messages_state_their_instant_on_the_base(self):
        """Live, and from a log."""
        log = self.folder / "hours.lcm"
        recorder = self.start("record", BIN / "axlecast", "record", log, "--config", self.config)
        self.wait_claim(OTHER)
        live = [wait_for(lambda: next((m for m in reversed(self.messages.of(f"TIME/{host}")) if m.get("on_base")), None), "an instant on the base")
                for host in (ROOT, OTHER)]
        recorder.terminate()
        self.assertEqual(recorder.wait(), 0, self.log("record"))
        code, lines, err = self.axlecast("log", "cat", log)
        self.assertEqual(code, 0, err)
        logged = [m for m in map(json.loads, lines.splitlines()) if m["channel"].startswith("TIME/") and m["half_width_ns"] >= 0]
        self.assertEqual({m["host"] for m in logged}, {ROOT, OTHER})
        for message in live + logged:
            self.assertEqual(message["on_base"]["base_id"], message["base_id"])
            self.assertLessEqual(abs(message["on_base"]["ns"] - message["base_ns"]), message["half_width_ns"])

    def test_a_permit_states_its_instant_on_the_base(self):
        """As a driver on the other host needs it."""
        self.wait_claim(OTHER)
        ids = {m["base_id"] for m in self.claims(ROOT)}
        self.start("permit", BIN / "axlecast", "permit", "axis1", "zero_single_turn", "--config", self.config)
        body = wait_for(lambda: next((m["permit_decoded"] for m in self.messages.of("PERMIT/axis1")
                                      if m["permit_decoded"]["base_id"] in ids), None), lambda: f"a permit with the base: {self.log('permit')}")
        error = abs(body["issued_base_ns"] - body["issued_mono_ns"] - raw_ahead())
        self.assertLessEqual(error, body["issued_half_width_ns"] + SLACK + SLEW_PPM * 10_000)

    def test_every_interval_holds_the_truth(self):
        self.wait_claim(OTHER)
        wait_for(lambda: len(self.claims(OTHER)) >= 50, "50 claims")
        for host, ahead in ((ROOT, 0), (OTHER, AHEAD)):
            for message in self.claims(host):
                self.assert_true(message, ahead)
        ids = {host: {(m["base_id"], m["epoch"]) for m in self.claims(host)} for host in (ROOT, OTHER)}
        self.assertEqual(ids[ROOT], ids[OTHER])
        self.assertNotEqual(self.claims(ROOT)[-1]["clock_id"], self.claims(OTHER)[-1]["clock_id"])
        self.assertEqual({m["grade"] for m in self.claims(OTHER)}, {3})
        self.assertLess(self.claims(ROOT)[-1]["half_width_ns"], 5_000_000)

    def test_a_root_that_hangs_ends_the_claim_and_comes_back(self):
        self.wait_claim(OTHER)
        self.stand_still(self.root)
        stopped = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
        mark = self.messages.mark()
        lost = self.wait_no_claim(mark)[0]
        self.assertIn("no answer of the root", lost["reason"])
        last = self.claims(OTHER)[-1]
        self.assertLess(last["mono_ns"] - AHEAD * 1_000_000_000 - stopped, 2_000_000_000)
        status = json.loads(self.axlecast("status", self.config, "--json")[1])
        self.assertFalse(status["good"])
        self.assertTrue([fault for fault in status["faults"] if OTHER in fault], status["faults"])
        mark = self.messages.mark()
        self.root.send_signal(signal.SIGCONT)
        back = self.wait_claim(OTHER, mark)[-1]
        self.assert_true(back, AHEAD)
        self.assertEqual(back["base_id"], last["base_id"])

    def test_a_root_that_is_restarted_keeps_its_clock(self):
        before = self.wait_claim(OTHER)[-1]
        self.kill(self.root)
        self.wait_no_claim(self.messages.mark())
        mark = self.messages.mark()
        self.root = self.service(ROOT)
        after = self.wait_claim(OTHER, mark)[-1]
        self.assertEqual((before["base_id"], before["epoch"]), (after["base_id"], after["epoch"]))
        self.assert_true(after, AHEAD)

    def test_a_position_of_the_other_host_is_usable_with_its_time(self):
        self.simulator(self.config, "rs485-0")
        self.start("driver", "nsenter", f"--time=/proc/{self.other.pid}/ns/time_for_children", BIN / "axlecast-tformat", "--config", self.config, "--bus", "rs485-0")
        self.wait_claim(OTHER)
        url = "udpm://239.255.76.67:7667?ttl=0"
        for microseconds, expected in ((0, "runs on another host"), (5_000_000, " ms old")):
            reader = subprocess.Popen([BIN / "print_position", "axis1", url, str(microseconds)], stdout=subprocess.PIPE, text=True)
            self.addCleanup(reader.stdout.close)
            self.addCleanup(reader.wait)
            self.addCleanup(reader.kill)
            lines = []
            wait_for(lambda: lines.append(reader.stdout.readline()) or expected in lines[-1], lambda: lines[-3:])


class Refusals(Machine):
    def test_what_is_wrong_is_named(self):
        without = self.write(one_axis(), "without.yaml")
        code, _, err = self.axlecast("time", without)
        self.assertEqual(code, 1)
        self.assertIn("time: {root: HOST", err)
        config = self.write(f"{one_axis()}time: {{root: {ROOT}, address: 192.0.2.1}}\n")
        code, _, err = self.axlecast("time", config, "--host", ROOT)
        self.assertEqual(code, 4)
        self.assertIn("must be an address of this host", err)
        wrong = self.write(f"{one_axis()}time: {{root: a b, address: somewhere}}\n", "wrong.yaml")
        code, _, err = self.axlecast("check-config", wrong)
        self.assertEqual(code, 1)
        self.assertIn("no name of a host", err)
        self.assertIn("no IP address", err)


if __name__ == "__main__":
    unittest.main()
