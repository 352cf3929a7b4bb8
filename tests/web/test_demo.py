"""The demo machine in a browser: what an operator sees of it, and can do."""

import json
import unittest

from browser import END, HOME, LEFT, TAB
from machine import BIN, wait_for
from page import DEMO, TABLET, PageTest

VALUE = '[data-device="axis1"] .value .number'


class Live(PageTest):
    def setUp(self):
        super().setUp()
        self.up()
        self.url = self.serve(DEMO)
        self.browser = self.browse(self.url)

    def tearDown(self):
        self.assertEqual(self.browser.complaints(), [])
        super().tearDown()

    def test_live_values_move(self):
        browser = self.browser
        browser.wait("return document.querySelectorAll('.tile').length === 13", "a tile for each device")
        browser.wait("return /^13 of 13|^12 of 13/.test(document.querySelector('.summary').innerText)", "devices online")
        first = browser.wait("return document.querySelector(arguments[0]).innerText.match(/\\d/) && "
                             "document.querySelector(arguments[0]).innerText", "a value of axis1", VALUE)
        browser.wait("return document.querySelector(arguments[0]).innerText !== arguments[1]", "another value", VALUE, first)
        self.assertLessEqual(abs(self.number(browser, VALUE)), 100.5)  # mm: axis1 shuttles over 100 mm
        self.assertIn("Simulated", browser.text("#head"))
        self.picture(browser, "machine")
        browser.click('[data-device="axis1"]')
        browser.wait("return document.querySelector('.device-view .hero .number')?.innerText.match(/\\d/)", "the device's view")
        self.assertIn("ts5669n127", browser.text(".device-right"))

    def test_an_alarm_appears_and_is_explained(self):
        browser = self.browser
        lost = '[data-alarm="axis4/reference_lost"]'
        browser.wait("return document.querySelector(arguments[0])", "the script's quiet part", lost)
        self.go(browser, "buses")  # not where all alarms are listed: a new one is shown wherever one looks
        battery = "return document.querySelector('#announcements')?.innerText.match(/axis4: Battery alarm[^]*Check or replace the battery/)"
        self.battery(2.9)
        browser.wait(battery, "the battery's alarm, announced")
        self.go(browser, "machine")
        alarm = '[data-alarm="axis4/battery_alarm"]'
        browser.wait("return document.querySelector(arguments[0])", "it stands in the list", alarm)
        self.assertIn("Check or replace the battery; the alarm clears itself", browser.text(alarm))
        self.assertIn("Warning", browser.text(alarm))
        self.assertTrue(browser.run("return document.querySelector('[data-device=axis4] .tile-note .icon') !== null"))
        self.picture(browser, "alarm")
        self.battery(3.6)
        browser.wait("return !document.querySelector(arguments[0])", "it goes when the battery is well again", alarm)

    def span(self):
        return float(self.browser.run("return document.querySelector('.strip-stack').dataset.span"))

    def edge(self):
        """The newest mark of the axis of time moves while a chart follows."""
        return self.browser.run("return document.querySelector('.strip .readout .number').innerText")

    def test_a_chart_pauses_and_zooms(self):
        browser = self.browser
        self.go(browser, "charts/axis1.value,axis1.speed_rpm,conveyor.power_w")
        browser.wait("return document.querySelectorAll('.strip').length === 3", "three strips")
        shown = browser.wait("return document.querySelector('.strip .readout .number').innerText.match(/\\d/)?.input", "a reading")
        browser.wait("return document.querySelector('.strip .readout .number').innerText !== arguments[0]", "it moves", shown)
        browser.click('[data-act="pause"]')
        browser.wait("return document.querySelector('.strip-stack').dataset.following === 'false'", "it is held")
        held = self.edge()
        browser.wait("return document.querySelector('.where').innerText.match(/Held [1-9]/)", "a second has passed")
        self.assertEqual(self.edge(), held)
        before = self.span()
        browser.click('[data-act="closer"]')
        browser.wait("return Number(document.querySelector('.strip-stack').dataset.span) < arguments[0]", "zoomed in", before)
        self.zoom_by_wheel_and_keys()
        self.read_at_the_cursor()
        self.picture(browser, "charts")
        browser.run("document.querySelector('.strips').focus()")
        browser.press(END)
        browser.wait("return document.querySelector('.strip-stack').dataset.following === 'true'", "it follows again")

    def zoom_by_wheel_and_keys(self):
        browser, before = self.browser, self.span()
        browser.wheel(900, 300, -200)
        browser.wait("return Number(document.querySelector('.strip-stack').dataset.span) < arguments[0]", "zoomed by wheel", before)
        browser.run("document.querySelector('.strips').focus()")
        before = self.span()
        browser.press("-")
        browser.wait("return Number(document.querySelector('.strip-stack').dataset.span) > arguments[0]", "zoomed by key", before)

    def read_at_the_cursor(self):
        browser = self.browser
        browser.pointer({"type": "pointerMove", "x": 900, "y": 300, "duration": 0})
        text = browser.wait("return document.querySelector('.where').innerText.match(/cursor (\\S+)/)?.[1]", "the cursor's time")
        browser.pointer({"type": "pointerMove", "x": 700, "y": 300, "duration": 0})
        browser.wait("return document.querySelector('.where').innerText.match(/cursor (\\S+)/)[1] < arguments[0]", "an earlier one", text)
        self.assertFalse(browser.run("return document.querySelector('.cursor').hidden"))

    def test_a_trips_curves_open(self):
        browser = self.browser
        self.go(browser, "trips")
        browser.wait("return document.querySelector('[data-trip^=\"conveyor/\"]')", "the conveyor's trip", limit=180)
        browser.click("[data-trip]")
        browser.wait("return document.querySelectorAll('.trip-panel').length === 7", "a panel for each quantity")
        self.assertIn("Power upper A", browser.text(".trip-detail h3"))
        power = '[data-quantity="power_w"]'
        at_trip = self.number(browser, f"{power} .number")
        self.assertGreater(at_trip, 400)  # W: the limit that it tripped over
        browser.run("document.querySelector('.trip-panels').focus()")
        browser.press(*[LEFT] * 19)
        browser.wait("return document.querySelector('.trip-detail .where').innerText === '19.0 s before the trip'", "all keys arrived")
        self.assertLess(self.number(browser, f"{power} .number"), at_trip)
        self.picture(browser, "trip")

    def test_what_was_commanded_is_shown_with_its_outcome(self):
        browser = self.browser
        self.go(browser, "commands")
        wait_for(lambda: self.axlecast("status", DEMO)[0] in (0, 1), "the machine runs")
        code, _, err = self.axlecast("motor", "stop", "conveyor", "--config", DEMO)
        self.assertEqual(code, 3, err)  # the demo's file does not allow it
        row = browser.wait("const row = document.querySelector('[data-command]')?.innerText;"
                           "return row?.includes('Rejected') && row", "the command's outcome")
        for word in ("conveyor", "Stop motor", "Rejected", "Not permitted"):
            self.assertIn(word, row)

    def test_a_recorder_that_ended_is_not_called_silent(self):
        browser = self.browser
        self.go(browser, "recorders")
        header = "return document.querySelector(`[data-recorder=${arguments[0]}] header`)?.innerText.includes(arguments[1])"
        recorders = {name: self.start(name, BIN / "axlecast", "record", self.folder / f"{name}.lcm", "--config", DEMO, "--name", name)
                     for name in ("ended", "killed")}
        for name in recorders:
            browser.wait(header, f"the recorder {name}", name, "Recording")
        recorders["ended"].terminate()
        self.assertEqual(recorders["ended"].wait(30), 0, self.log("ended"))
        browser.wait(header, "its end", "ended", "Ended")
        self.kill(recorders["killed"])
        browser.wait(header, "the other's silence", "killed", "Silent")
        # The last message of the recorder that ended is older than the last message of the silent recorder.
        self.assertTrue(browser.run(header, "ended", "Ended"), browser.text('[data-recorder="ended"]'))


class Recorded(PageTest):
    def record(self):
        """Some seconds of the demo, with the battery's alarm in it."""
        self.up()
        path = self.folder / "run.lcm"
        alarms = self.watch(DEMO, "--channel", "^ALARM/axis4$")
        recorder = self.start("record", BIN / "axlecast", "record", path, "--config", DEMO)
        wait_for(lambda: "reference_lost" in self.alarms(alarms, "axis4"), "the script's quiet part")
        wait_for(lambda: "battery_alarm" not in self.alarms(alarms, "axis4"), "the battery is well")
        self.battery(2.9)
        wait_for(lambda: "battery_alarm" in self.alarms(alarms, "axis4"), "the battery's alarm")
        self.battery(3.6)
        wait_for(lambda: "battery_alarm" not in self.alarms(alarms, "axis4"), "the battery is well again")
        recorder.terminate()
        recorder.wait(30)
        for process in self.processes:
            if process.poll() is None:
                process.terminate()
                process.wait(30)
        return path

    def test_a_log_is_scrubbed(self):
        path = self.record()
        _, out, err = self.axlecast("log", "info", path, "--json")
        self.assertTrue(json.loads(out), err)
        browser = self.browse(self.serve(DEMO, "--log", path))
        browser.wait("return !document.querySelector('.playback').hidden", "the slider")
        self.assertIn("run.lcm", browser.text(".playback"))
        self.note_what_is_called_silent(browser)
        browser.wait("return document.querySelector('.place').innerText.match(/\\d/)", "the place in the log")
        self.assert_nothing_is_called_silent(browser, "paused at its beginning")
        browser.run("document.querySelector('.playback input').focus()")
        browser.press(END)
        browser.wait("const slider = document.querySelector('.playback input'); return slider.valueAsNumber >= Number(slider.max)",
                     "the end")
        last = self.place(browser)
        self.play_to_the_end(browser)
        self.assert_nothing_is_called_silent(browser, "at its end")
        browser.run("document.querySelector('.playback input').focus()")
        browser.press(HOME)
        browser.wait("return document.querySelector('.place').innerText < arguments[0]", "the start", last)
        self.find_the_alarm(browser)
        self.picture(browser, "log")
        self.play(browser)
        self.assertEqual(browser.complaints(), [])

    @staticmethod
    def note_what_is_called_silent(browser):
        browser.run("""window.notices = [];
                       const notice = document.querySelector('#notice');
                       window.note = () => { if (!notice.hidden) window.notices.push(notice.innerText); };
                       new MutationObserver(window.note).observe(notice, {attributes: true, childList: true, subtree: true});""")

    def assert_nothing_is_called_silent(self, browser, where):
        """The log is paused for twice the time after which the page reports that nothing comes (SILENT_AFTER_MS)."""
        self.assertEqual(browser.run("return document.querySelector('[data-act=play]').getAttribute('aria-label')"), "Play", where)
        seconds = "return document.querySelector('.playback input').valueAsNumber"
        before = browser.run(seconds)

        def nothing_is_called_silent():
            browser.run("window.notices = []; window.note(); window.since = performance.now()")
            browser.wait("return performance.now() - window.since > 4000", "4 s of the page's clock")
            return not browser.run("return window.notices")
        # A host that stalls the server for 2 s makes it silent once; a server that sends nothing while it is paused, always.
        wait_for(nothing_is_called_silent, lambda: f"{where}: {browser.run('return window.notices')}")
        self.assertEqual(browser.text("[data-fresh=true]"), "Log", where)
        self.assertAlmostEqual(browser.run(seconds), before, delta=1, msg=f"{where}: it would play 4 s")

    @staticmethod
    def play_to_the_end(browser):
        """The slider's steps may miss the last message; a log that plays pauses by itself after the last message."""
        browser.run("""const slider = document.querySelector('.playback input');
                       const button = document.querySelector('[data-act=play]');
                       window.offers = [];
                       new MutationObserver(() => window.offers.push(button.getAttribute('aria-label')))
                         .observe(button, {attributes: true, attributeFilter: ['aria-label']});
                       slider.value = Number(slider.max) - 4;
                       slider.dispatchEvent(new Event('input')); slider.dispatchEvent(new Event('change'));""")
        browser.click("[data-act=play]")
        browser.wait("return window.offers.join() === 'Pause,Play'", "it plays, and pauses at the end")
        browser.wait("const slider = document.querySelector('.playback input'); return slider.valueAsNumber > slider.max - 0.5",
                     "its last message")

    def place(self, browser):
        return browser.text(".place")

    def find_the_alarm(self, browser):
        """Steps through the log, as by a finger on the slider, until the alarm is there."""
        alarm = "return document.querySelector('[data-alarm=\"axis4/battery_alarm\"]') !== null"
        steps = """const slider = document.querySelector('.playback input');
                   slider.value = Number(slider.max) * arguments[0];
                   slider.dispatchEvent(new Event('input')); slider.dispatchEvent(new Event('change'));"""
        for step in range(1, 40):
            browser.run(steps, step / 40)
            try:
                browser.wait(alarm, "the alarm", limit=0.7)
                break
            except AssertionError:
                continue
        self.assertTrue(browser.run(alarm), browser.text("body"))
        browser.run(steps, 0)
        browser.wait(f"return !({alarm.removeprefix('return ')})", "before it there is none")

    def play(self, browser):
        place = self.place(browser)
        if browser.run("return document.querySelector('[data-act=play]').getAttribute('aria-label')") == "Play":
            browser.click('[data-act="play"]')
        browser.wait("return document.querySelector('.place').innerText > arguments[0]", "it plays", place)
        browser.click('[data-act="play"]')
        browser.wait("return document.querySelector('[data-act=play]').getAttribute('aria-label') === 'Play'", "it is paused")


class Tablet(PageTest):
    def test_it_can_be_used_with_a_finger_and_by_keys(self):
        self.up()
        browser = self.browse(self.serve(DEMO), size=TABLET)
        browser.wait("return document.querySelectorAll('.tile').length === 13", "a tile for each device")
        for view in ("machine", "charts", "buses", "trips", "commands", "recorders", "device/axis4", "device/conveyor"):
            self.go(browser, view)
            browser.wait("return document.querySelector('#main > *')?.dataset.open === location.hash", view)
            self.picture(browser, f"tablet-{view.replace('/', '-')}")
            with self.subTest(view):
                self.assertEqual(browser.run(SMALL), [])
                self.assertLessEqual(browser.run("return document.documentElement.scrollWidth"), TABLET[0])
                self.assertEqual(browser.run(UNNAMED), [])
        self.assertEqual(browser.complaints(), [])
        browser.open(browser.run("return location.href.replace(/#.*/, '')"))
        # A key that comes before Chromium has painted the page may be lost.
        browser.wait("return performance.getEntriesByType('paint').length > 0", "the page painted")
        browser.press(TAB)
        self.assertEqual(browser.run("return document.activeElement.className"), "skip")


# What is to be touched, and is smaller than 44 by 44 pixels; a box with its label counts as one.
SMALL = """return [...document.querySelectorAll('button, select, summary, nav a, a.button, .tile, .check, input[type=search], .alarm-counts')]
  .filter((node) => node.getClientRects().length > 0)
  .map((node) => [node.outerHTML.slice(0, 80), node.getBoundingClientRect()])
  .filter(([, rect]) => rect.width < 44 || rect.height < 43.9).map(([name, rect]) => `${name}: ${rect.width} x ${rect.height}`)"""

# What can be used, and has no name that could be read out.
UNNAMED = """return [...document.querySelectorAll('button, select, input, a')]
  .filter((node) => node.getClientRects().length > 0)
  .filter((node) => !(node.getAttribute('aria-label') || node.textContent.trim() || node.closest('label')?.textContent.trim()))
  .map((node) => node.outerHTML.slice(0, 80))"""


if __name__ == "__main__":
    unittest.main()
