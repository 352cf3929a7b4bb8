"""A page under test: a machine, the server of its page, and a browser that shows it."""

import os
import pathlib
import re

from browser import Browser
from machine import BIN, Machine, wait_for

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
DEMO = SOURCE / "config/demo.yaml"
DESKTOP, TABLET = (1440, 900), (1024, 768)
PICTURES = os.environ.get("AXLECAST_PICTURES")  # a folder: screenshots are kept there, to be looked at


class PageTest(Machine):
    def up(self, config=DEMO):
        """The whole machine, simulated; returns when its messages come."""
        process = self.start("up", BIN / "axlecast", "up", config, "--no-table")
        silent, answers = 6, lambda: self.axlecast("status", config)[0]
        wait_for(lambda: process.poll() is not None or answers() != silent, lambda: f"the machine: {self.log('up')}")
        self.assertIsNone(process.poll(), self.log("up"))
        return process

    def battery(self, volts):
        """Of the demo's axis4; its script leaves it alone from 20 s on, for 100 s."""
        self.set_simulated(DEMO, "rs485-3", "axis4", battery_v=volts)

    def serve(self, *options, name="web"):
        """`axlecast web`; returns the address of its page."""
        process = self.start(name, BIN / "axlecast", "web", *options, "--port", "0")
        found = wait_for(lambda: re.search(r"https?://\S+/", self.log(name)) or process.poll() is not None,
                         lambda: f"the server's address: {self.log(name)}")
        self.assertIsNone(process.poll(), self.log(name))
        return found.group(0)

    def browse(self, url, size=DESKTOP, dark=False):
        browser = Browser(*size, dark=dark)
        self.addCleanup(browser.close)
        browser.open(url)
        return browser

    def go(self, browser, view):
        browser.run("location.hash = arguments[0]", f"#{view}")

    def picture(self, browser, name):
        if PICTURES:
            browser.screenshot(pathlib.Path(PICTURES, f"{name}.png"))

    def number(self, browser, selector):
        """What a place of the page shows, as a number."""
        return float(browser.text(selector).replace("−", "-").replace("\u202f", ""))
