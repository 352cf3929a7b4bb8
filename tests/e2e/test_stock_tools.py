"""Stock lcm-logger records us, stock lcm-logplayer plays it back, lcm-spy shows our types decoded."""

import math
import os
import pathlib
import signal
import subprocess
import unittest

import lcm_log
from machine import BIN, Machine, one_axis, wait_for

DATA_URL = "udpm://239.255.76.67:7667?ttl=0"


class StockTools(Machine):
    def setUp(self):
        super().setUp()
        self.config = self.write(one_axis("{speed_rpm: 90}"))

    def record(self, messages):
        """A log of at least so many positions, made by lcm-logger of our running machine."""
        log = self.folder / "stock.log"
        watch = self.watch(self.config)
        up = self.start("up", BIN / "axlecast", "up", self.config, "--no-table")
        self.wait_online(watch)
        logger = self.start("lcm-logger", "lcm-logger", "-q", f"--lcm-url={DATA_URL}", log)
        wait_for(lambda: len(watch.of("POSITION/axis1")) > messages + 200, "positions to record")
        logger.send_signal(signal.SIGINT)
        logger.wait(20)
        up.send_signal(signal.SIGINT)
        self.assertEqual(up.wait(20), 0, self.log("up"))
        watch.close()
        return log

    def test_every_logged_position_is_played_back_equal(self):
        log = self.record(1000)
        types = lcm_log.generated_types()
        logged = [types.position_t.decode(data) for channel, data in lcm_log.events(log) if channel == "POSITION/axis1"]
        self.assertGreater(len(logged), 500)
        sequence = [m.seq for m in logged]
        self.assertEqual(sequence, list(range(sequence[0], sequence[0] + len(sequence))), "lcm-logger lost some")

        watch = self.watch(self.config, "--channel", "POSITION/.*")
        self.start("probe", BIN / "axlecast", "watch", "--help").wait()
        # The watch listens once it has printed what a first, short play brings.
        wait_for(lambda: self.play(log) and watch.of("POSITION/axis1"), "the watch to listen")
        wait_for(lambda: watch.last("POSITION/axis1")["seq"] == sequence[-1], "the first play's end")
        mark = watch.mark()
        self.play(log)
        wait_for(lambda: len(watch.of("POSITION/axis1", mark)) >= len(logged), "every position played")
        seen = watch.of("POSITION/axis1", mark)
        self.assertEqual(len(seen), len(logged))
        for ours, stock in zip(seen, logged):
            for field in stock.__slots__:
                expected = getattr(stock, field)
                if field == "boot_id":
                    expected = f"{expected & (2**64 - 1):016x}"
                if isinstance(expected, float) and math.isnan(expected):
                    expected = None
                if field == "spare":
                    continue
                self.assertEqual(ours[field], expected, f"{field} of seq {stock.seq}")

    def play(self, log):
        subprocess.run(["lcm-logplayer", "-l", DATA_URL, "-e", "POSITION/.*", log], check=True, capture_output=True)
        return True

    def test_lcm_spy_shows_positions_decoded(self):
        """lcm-spy under Xvfb: its window is there and lists our channels. AXLECAST_SCREENSHOTS=FOLDER keeps the picture."""
        display = ":77"
        self.start("xvfb", "Xvfb", display, "-screen", "0", "1000x700x24", "-nolisten", "tcp")
        watch = self.watch(self.config)
        self.start("up", BIN / "axlecast", "up", self.config, "--no-table")
        self.wait_online(watch)
        environment = {**os.environ, "DISPLAY": display}
        wait_for(lambda: subprocess.run(["xdpyinfo"], env=environment, capture_output=True).returncode == 0, "Xvfb")
        self.start("spy", BIN / "axlecast", "spy", self.config, env={"DISPLAY": display})
        tree = lambda: subprocess.run(["xwininfo", "-root", "-tree"], env=environment, capture_output=True, text=True).stdout
        wait_for(lambda: "LCM Spy" in tree(), lambda: "the window of lcm-spy\n" + self.log("spy"))
        mark = watch.mark()
        wait_for(lambda: len(watch.of("DEVICE/axis1", mark)) > 3, "some seconds of it")
        shot = pathlib.Path(os.environ.get("AXLECAST_SCREENSHOTS", self.folder)) / "lcm-spy.png"
        subprocess.run(["import", "-window", "root", shot], env=environment, check=True)
        shades = subprocess.run(["identify", "-format", "%k", shot], capture_output=True, text=True, check=True)
        self.assertGreater(int(shades.stdout), 20, "something drawn")
        self.assertNotIn("Exception", self.log("spy"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
