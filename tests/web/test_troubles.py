"""What the page shows when its server is silent, gone, or sends nonsense: never that all is well."""

import os
import unittest

from browser import LEFT, Browser
from fake_server import FakeServer, alarms, trip
from machine import wait_for
from page import SOURCE

VALUE = '[data-device="axis1"] .value .number'
FRESH = "return document.querySelector('.freshness')?.dataset.fresh === arguments[0]"


class Troubles(unittest.TestCase):
    def setUp(self):
        self.server = FakeServer([SOURCE / "tools/web/page", os.environ["AXLECAST_FETCHED"]])
        self.addCleanup(self.server.close)
        self.browser = Browser()
        self.addCleanup(self.browser.close)
        self.browser.open(self.server.url)
        self.browser.wait(FRESH, "it is live", "true")
        self.browser.wait("return document.querySelector(arguments[0])?.innerText.match(/\\d/)", "a value", VALUE)

    def notice(self, text):
        self.browser.wait("return document.querySelector('#notice').innerText.includes(arguments[0])", f"it says: {text}", text)

    def test_a_lost_connection_is_said_and_comes_back(self):
        self.server.stop_listening()
        self.notice("Connection lost")
        self.browser.wait(FRESH, "it is old", "false")
        shown = self.browser.text(VALUE)
        self.assertIn("What is shown is of", self.browser.text("#notice"))
        self.assertEqual(self.browser.text(VALUE), shown)
        self.server.listen_again()
        self.browser.wait(FRESH, "it is live again", "true")
        self.browser.wait("return document.querySelector(arguments[0]).innerText !== arguments[1]", "values move again", VALUE, shown)
        self.assertTrue(self.browser.run("return document.querySelector('#notice').hidden"))

    def test_silence_is_said(self):
        self.server.silence()
        self.notice("Nothing comes from the server")
        self.browser.wait(FRESH, "it is old", "false")
        self.server.speak()
        self.browser.wait(FRESH, "it is live again", "true")

    def test_nonsense_is_said_and_does_no_harm(self):
        for nonsense in ("{", "[]", '{"type":"state","utime":1,"devices":7}', '{"type":"unheard of"}', '{"type":"alarms"}'):
            self.server.say(nonsense)
        self.notice("(4 times)")
        shown = self.browser.text(VALUE)
        self.browser.wait("return document.querySelector(arguments[0]).innerText !== arguments[1]", "values move on", VALUE, shown)

    def test_text_from_the_field_is_never_markup(self):
        entry = {"name": "<img src=x onerror=alert(1)>", "code": 1, "source": "device", "severity": "error", "state": "live",
                 "first_utime": 1, "last_utime": 1, "count": 1, "action": "<b>bold</b>"}
        self.server.say(alarms("axis1", [entry], [entry["name"]]))
        self.browser.wait("return document.querySelector('.alarm')?.innerText.includes('<b>bold</b>')", "the text as it is")
        self.assertEqual(self.browser.run("return document.querySelectorAll('#main img, .alarm b').length"), 0)

    def test_what_was_left_out_is_counted_on_the_page(self):
        self.browser.run("location.hash = '#charts/axis1.value'")
        wait_for(lambda: any(frame["type"] == "subscribe" and frame["devices"] == ["axis1"] for frame in self.server.heard), "a subscription")
        self.server.silence()
        sample = {"type": "samples", "device": "axis1", "t0_utime": 9e15, "dt_us": [0], "columns": {"value": [1]}, "dropped": 1234}
        self.server.say(sample)
        self.browser.wait("return document.querySelector('#head').innerText.includes('1\u202f234 readings left out')", "the count")
        self.browser.wait("return document.querySelector('.left-out').innerText === '1\u202f234 left out'", "and at its strip")

    def test_a_trip_that_is_sent_again_moves_neither_read_out_nor_focus(self):
        self.browser.run("location.hash = '#trips'")
        self.server.say(trip("axis1", 2, 1))
        self.browser.wait("return document.querySelector('.trip-panels')", "the curves")
        self.browser.run("document.querySelector('.trip-panels').focus()")
        where = "return document.querySelector('.trip-detail .where').innerText === arguments[0]"
        for count, (frame, shown) in enumerate([(trip("axis1", 2, 1), "no change"), (trip("axis1", 2, 2), "other values"),
                                                (trip("axis1", 1, 1), "an older one")], 1):
            self.browser.press(LEFT)
            self.server.say(frame)
            self.browser.wait(where, shown, f"{count}.0 s before the trip")
        self.browser.wait("return document.querySelector('.older')", "the older trip's curve")
        self.browser.press(LEFT)
        self.browser.wait(where, "it has the focus still", "4.0 s before the trip")

    def test_a_refusal_is_final(self):
        self.server.hang_up(1008)
        self.notice("Load the page again")
        self.assertEqual(self.browser.run("return document.querySelector('.freshness').dataset.fresh"), "false")

    def test_the_page_asks_nobody_else(self):
        for view in ("charts", "device/axis1", "buses", "trips", "commands", "recorders", "machine"):
            self.browser.run("location.hash = arguments[0]", f"#{view}")
            self.browser.wait("return document.querySelector('#main > *')?.dataset.open === location.hash", view)
        hosts = self.browser.run("return [...new Set(performance.getEntriesByType('resource').map((entry) => new URL(entry.name).host))]")
        self.assertEqual(hosts, [f"127.0.0.1:{self.server.port}"])
        self.assertEqual(self.browser.complaints(), [])


if __name__ == "__main__":
    unittest.main()
