"""Several axes on one tick. The simulated shafts turn at a constant speed, so that the position that a device sent gives the instant at
which it was sampled, to within the time of one count."""

import json
import time
import unittest

from machine import BIN, Machine, wait_for
from test_time import AHEAD, SLACK, SLEW_PPM, raw_ahead

RPM = 3000
COUNTS = 1 << 17
COUNT_NS = 60 * 10**9 // (RPM * COUNTS) + 1
URL = 'lcm: {url: "udpm://239.255.76.67:7667?ttl=1", command_url: "udpm://239.255.76.67:7668?ttl=1"}'
HOSTS = {"root": ("x", "y"), "cell2": ("v", "w")}


def machine(axes, more="", set_of=None):
    """One simulated T-format bus for each axis."""
    buses = "".join(f"  bus-{axis}: {{family: tformat, poll_hz: 50, simulate: {{{axis}: {{speed_rpm: {RPM}}}}},\n"
                    f"    devices: {{{axis}: {{model: ts5669n127, timeout_us: 500000}}}}}}\n" for axis in axes)
    return (f"machine: test\nbridge: {{unsigned_commands: allow}}\n{URL}\n{more}"
            f"sets: {{gantry: {{axes: [{', '.join(set_of or axes)}], limit_us: 1000}}}}\nbuses:\n{buses}")


class Ticks(Machine):
    def up(self, config, host="", before=()):
        """`axlecast up` with a run directory of the host's own."""
        words = ["--host", host] if host else []
        return self.start(f"up-{host}", *before, BIN / "axlecast", "up", config, *words, "--no-table",
                          env={"AXLECAST_RUN_DIR": str(self.folder / f"run-{host}")})

    def shaft(self, axis, host=""):
        """A function that returns the instant, on the clock of the host, at which the shaft of the axis is at some counts."""
        self.run_dir = self.folder / f"run-{host}"
        state = self.ask_simulator(f"bus-{axis}", {"show": True})
        turns_per_ns = RPM / 60e9
        return lambda counts: state["mono_ns"] + (counts / COUNTS - state["devices"][axis]["angle_deg"] / 360) / turns_per_ns

    def sets(self, watch, count, since=0):
        """This many sets in which every axis is good."""
        good = lambda: [m for m in watch.of("POSITION_SET/gantry", since) if m["state"] != 2]
        return wait_for(lambda: good()[:count] if len(good()) >= count else None,
                        lambda: [len(good()), watch.last("POSITION_SET/gantry"), *(self.log(name.stem) for name in self.folder.glob("*.log"))])

    def assert_true(self, message, instants, slack):
        """Each axis was sampled within its interval, and all within the hull."""
        for axis in message["axes"]:
            at = instants[axis["device"]](axis["counts"])
            stated = message["tick_ns"] + axis["offset_ns"]
            self.assertLessEqual(abs(at + COUNT_NS / 2 - stated), axis["half_width_ns"] + COUNT_NS + slack, (axis, message))
            self.assertGreaterEqual(at + COUNT_NS + slack, message["earliest_ns"], message)
            self.assertLessEqual(at - slack, message["latest_ns"], message)
        aligned = message["latest_ns"] - message["earliest_ns"] <= message["limit_ns"]
        self.assertEqual(message["state_name"], "aligned" if aligned else "not_aligned")


class OneHost(Ticks):
    AXES = [f"axis{i}" for i in range(10)]

    def setUp(self):
        super().setUp()
        self.config = self.write(machine(self.AXES))
        self.watch_all = self.watch(self.config, "--channel", "POSITION_SET|DEVICE")
        self.running = self.up(self.config)

    def test_ten_axes_were_sampled_within_the_stated_hull_on_every_tick(self):
        self.sets(self.watch_all, 5)
        instants = {axis: self.shaft(axis) for axis in self.AXES}
        sets = self.sets(self.watch_all, 200, self.watch_all.mark())
        for message in sets:
            self.assert_true(message, instants, slack=1)
            self.assertEqual(message["tick_ns"], message["tick"] * 20_000_000)
        self.assertEqual({m["base_id"] for m in sets}, {"0000000000000000"})
        device = self.watch_all.last("DEVICE/axis0")
        self.assertEqual((device["tick_period_ns"], device["tick_phase_ns"], device["tick_base_id"]), (20_000_000, 0, "0" * 16), device)

    def test_skew_and_a_missing_axis(self):
        self.sets(self.watch_all, 5)
        code, out, err = self.axlecast("skew", "gantry", "--config", self.config, "--seconds", 2, "--json")
        self.assertEqual(code, 0, err)
        skew = json.loads(out)
        self.assertEqual([axis["device"] for axis in skew["axes"]], self.AXES)
        self.assertGreater(skew["ticks"], 0)
        self.assertEqual(skew["ticks"], skew["aligned"] + skew["wider"] + skew["incomplete"])
        code, out, err = self.axlecast("skew", "axis3", "axis4", "--config", self.config, "--seconds", 1, "--limit-us", 77)
        self.assertEqual(code, 0, err)
        self.assertIn("within 77.0 us", out)
        self.assertEqual(len(out.splitlines()), 5, out)
        code, _, err = self.axlecast("skew", "axis3", "nobody", "--config", self.config)
        self.assertEqual(code, 2)
        self.assertIn("there is no device 'nobody'", err)
        # Without a reply there is no reading on the tick.
        self.run_dir = self.folder / "run-"
        self.ask_simulator("bus-axis7", {"plugged": False})
        missing = lambda: (self.watch_all.last("POSITION_SET/gantry") or {"axes": [{}] * 10})["axes"][7].get("state_name") == "missing"
        wait_for(missing, lambda: self.watch_all.last("POSITION_SET/gantry"))
        self.assertEqual(self.watch_all.last("POSITION_SET/gantry")["state_name"], "incomplete")


class TwoHosts(Ticks):
    """Two time namespaces, whose clocks differ by 25 hours."""

    def setUp(self):
        super().setUp()
        hosts = "".join(f"  {host}: {{{'bridge: true, ' if host == 'root' else ''}buses: [{', '.join(f'bus-{a}' for a in axes)}]}}\n"
                        for host, axes in HOSTS.items())
        axes = [axis for axes in HOSTS.values() for axis in axes]
        self.config = self.write(machine(axes, f"time: {{root: root, address: 127.0.0.1}}\nhosts:\n{hosts}"))
        self.messages = self.watch(self.config, "--channel", "POSITION_SET|DEVICE|TIME")
        self.up(self.config, "root")
        self.other = self.up(self.config, "cell2", ["unshare", "--time", "--fork", "--kill-child", "--monotonic", str(AHEAD),
                                                    "--boottime", str(AHEAD)])

    def tearDown(self):
        self.other.kill()  # unshare hands no SIGTERM on
        super().tearDown()

    def test_four_axes_of_two_hosts_are_read_on_the_same_ticks(self):
        self.sets(self.messages, 5)
        local = {axis: self.shaft(axis, host) for host, axes in HOSTS.items() for axis in axes}
        ahead = {axis: AHEAD * 10**9 if host == "cell2" else 0 for host, axes in HOSTS.items() for axis in axes}
        sets = self.sets(self.messages, 100, self.messages.mark())
        raw = raw_ahead()
        began = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
        instants = {axis: lambda counts, axis=axis: local[axis](counts) - ahead[axis] + raw for axis in local}
        for message in sets:
            age = began + raw - message["tick_ns"]
            self.assert_true(message, instants, slack=SLACK + age * SLEW_PPM // 1_000_000)
        self.assertEqual({m["base_id"] for m in sets}, {self.messages.last("TIME/root")["base_id"]})
        for axis in local:
            device = self.messages.last(f"DEVICE/{axis}")
            self.assertEqual(device["tick_base_id"], self.messages.last("TIME/cell2")["base_id"], device)

    def test_without_a_claim_of_one_host_its_axes_have_no_tick(self):
        self.sets(self.messages, 5)
        self.other.kill()
        incomplete = lambda: [a["state_name"] for a in self.messages.last("POSITION_SET/gantry")["axes"]] == ["good", "good", "missing", "missing"]
        wait_for(incomplete, lambda: self.messages.last("POSITION_SET/gantry"))


if __name__ == "__main__":
    unittest.main()
