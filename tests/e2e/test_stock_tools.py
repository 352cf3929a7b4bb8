"""Stock lcm-logger records us, stock lcm-logplayer plays it back, lcm-spy shows our types decoded."""

import math
import os
import pathlib
import re
import shlex
import signal
import subprocess
import unittest

import lcm_log
from machine import BIN, Machine, one_axis, wait_for

AXES = ("axis1", "axis2", "axis3", "axis4", "joint1", "joint2", "hoist", "boom", "winch", "gantry", "turntable")
DATA_URL = "udpm://239.255.76.67:7667?ttl=0"
OWN_URL = "udpm://239.255.76.67:7700?ttl=0"  # differs from liblcm's default, which a program without a URL uses


class StockTools(Machine):
    def setUp(self):
        super().setUp()
        self.config = self.write(one_axis("{speed_rpm: 90}") + f'lcm: {{url: "{OWN_URL}"}}\n')

    def record(self, config, messages):
        """A log of at least so many positions of axis1, made by lcm-logger of the running machine."""
        log = self.folder / "stock.log"
        watch = self.watch(config)
        up = self.start("up", BIN / "axlecast", "up", config, "--no-table")
        for axis in AXES:
            wait_for(lambda: watch.of(f"POSITION/{axis}"), f"positions of {axis}")
        logger = self.start("lcm-logger", "lcm-logger", "-q", f"--lcm-url={DATA_URL}", log)
        wait_for(lambda: len(watch.of("POSITION/axis1")) > messages, "positions to record")
        logger.send_signal(signal.SIGINT)
        logger.wait(20)
        up.send_signal(signal.SIGINT)
        self.assertEqual(up.wait(20), 0, self.log("up"))
        watch.close()
        return log

    def test_every_logged_position_of_the_demo_is_played_back_equal(self):
        demo = pathlib.Path(os.environ["AXLECAST_SOURCE"]) / "config/demo.yaml"
        log = self.record(demo, 1500)
        types = lcm_log.generated_types()
        logged = [(channel, types.position_t.decode(data)) for channel, data in lcm_log.events(log)
                  if channel.startswith("POSITION/")]
        self.assertEqual({channel for channel, _ in logged}, {f"POSITION/{axis}" for axis in AXES})
        self.assertGreater(len(logged), 1000)

        watch = self.watch(demo, "--channel", "^POSITION/")
        last_channel, last = logged[-1]
        # The watch listens when something of a first play arrives; that play ends with the log's last message.
        wait_for(lambda: self.play(log) and watch.last(last_channel), "the watch to listen")
        wait_for(lambda: watch.last(last_channel)["seq"] == last.seq, "the first play's end")
        mark = watch.mark()
        self.play(log)
        wait_for(lambda: len(watch.since(mark)) >= len(logged), "every position played")
        seen = watch.since(mark)
        self.assertEqual(len(seen), len(logged))
        for ours, (channel, stock) in zip(seen, logged):
            self.assertEqual(ours["channel"], channel)
            for field in (name for name in stock.__slots__ if name != "spare"):
                expected = getattr(stock, field)
                if field in ("boot_id", "machine_id", "clock_id"):
                    expected = f"{expected & (2**64 - 1):016x}"
                if isinstance(expected, float) and math.isnan(expected):
                    expected = None
                self.assertEqual(ours[field], expected, f"{field} of {channel}, seq {stock.seq}")

    def play(self, log):
        subprocess.run(["lcm-logplayer", "-l", DATA_URL, "-e", "POSITION/.*", log], check=True, capture_output=True)
        return True

    def witness(self):
        """The Java agent that prints from within lcm-spy what it shows."""
        source = pathlib.Path(__file__).with_name("spy_witness") / "SpyWitness.java"
        subprocess.run(["javac", "-nowarn", "-d", self.folder / "classes", source], check=True)
        manifest = self.write("Premain-Class: SpyWitness\n", "manifest")
        jar = self.folder / "witness.jar"
        subprocess.run(["jar", "--create", "--file", jar, "--manifest", manifest, "-C", self.folder / "classes", "."], check=True)
        return jar

    def test_lcm_spy_shows_positions_decoded(self):
        self.assert_positions_are_shown(":77", BIN / "axlecast", "spy", self.config)

    def test_the_printed_command_of_spy_shows_positions_decoded(self):
        code, line, err = self.axlecast("spy", self.config, "--print")
        self.assertEqual(code, 0, err)
        words = shlex.split(line)
        places = [pathlib.Path(place) for place in words[words.index("-cp") + 1].split(":")]
        self.assertEqual([place for place in places if not place.is_file()], [])
        self.assertIn(BIN.parent / "share/axlecast/lcmtypes_axlecast.jar", places, "the types of this build")
        self.assert_positions_are_shown(":78", "sh", "-c", line)

    def assert_positions_are_shown(self, display, *spy):
        """lcm-spy under Xvfb: its viewer shows the positions that are published. AXLECAST_SCREENSHOTS=FOLDER keeps the picture."""
        self.start("xvfb", "Xvfb", display, "-screen", "0", "1000x700x24", "-nolisten", "tcp",
                   "-noreset")  # it would, when the client that asks for it below has gone
        watch = self.watch(self.config)
        self.start("up", BIN / "axlecast", "up", self.config, "--no-table")
        self.wait_online(watch)
        environment = {**os.environ, "DISPLAY": display}
        wait_for(lambda: subprocess.run(["xdpyinfo"], env=environment, capture_output=True).returncode == 0, "Xvfb")
        options = f"-javaagent:{self.witness()}=POSITION/axis1"
        self.start("spy", *spy, env={"DISPLAY": display, "JAVA_TOOL_OPTIONS": options})
        tree = lambda: subprocess.run(["xwininfo", "-root", "-tree"], env=environment, capture_output=True, text=True).stdout
        wait_for(lambda: "LCM Spy" in tree(), lambda: "the window of lcm-spy\n" + self.log("spy"))

        def compared():
            """What the viewer of POSITION/axis1 shows beside the same message as `watch` decodes it."""
            published = {message["seq"]: message for message in watch.of("POSITION/axis1")}
            for line in re.findall(r"^SHOWN (.*)\n", self.log("spy"), re.MULTILINE):
                row, shown, *fields = line.split()
                values = dict(field.split("=", 1) for field in fields)
                message = published.get(int(values["seq"]))
                if message and message["value"] is not None:
                    return row, shown, values, message
            return None
        row, shown, values, message = wait_for(compared, lambda: "a position in lcm-spy's viewer\n" + self.log("spy")[-2000:])
        self.assertEqual((row, shown), ("position_t", "axlecast.position_t"))
        for name in ("value", "angle_rad", "counts", "raw_counts", "speed_rad_s", "mono_ns", "flags"):
            if message[name] is None:  # unknown: the speed of the first readings
                self.assertTrue(math.isnan(float(values[name])), name)
            else:
                self.assertAlmostEqual(float(values[name]), float(message[name]), msg=name)
        self.assertNotEqual(float(values["value"]), 0, "the shaft turns")
        shot = pathlib.Path(os.environ.get("AXLECAST_SCREENSHOTS", self.folder)) / "lcm-spy.png"
        subprocess.run(["import", "-window", "root", shot], env=environment, check=True)
        shades = subprocess.run(["identify", "-format", "%k", shot], capture_output=True, text=True, check=True)
        self.assertGreater(int(shades.stdout), 20, "something drawn")
        self.assertNotIn("Exception", self.log("spy"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
