"""The page where room is small: a phone shows every view whole, and new alarms are beside the data, never on it."""

import os
import pathlib
import unittest

from browser import Browser
from fake_server import alarms
from full_machine import VIEWS, FullMachine, alarm
from page import DESKTOP, PICTURES, SOURCE

PHONE = (390, 844)

# What is seen and reaches past the right edge of the screen, or of a part that cuts it off.
CUT_OFF = """const seen = [...document.querySelectorAll('#head *, #main *, #notice, #announcements *, #foot *')]
    .filter((node) => node.getClientRects().length > 0 && !node.closest('.strip-plot'));
  const isCut = (node) => {
    const rect = node.getBoundingClientRect();
    const hides = getComputedStyle(node).overflowX !== 'visible' && !node.matches('.tile h3, .tile footer span, .tile-note span, .row-name, .machine-name');
    return rect.width > 1 && (rect.right > innerWidth + 1 || rect.left < -1 || (hides && node.scrollWidth > node.clientWidth + 1));
  };
  const inks = [...document.querySelectorAll('#main svg text')].filter((node) => {
    const [ink, frame] = [node.getBoundingClientRect(), node.ownerSVGElement.getBoundingClientRect()];
    return ink.width > 0 && (ink.left < frame.left - 1 || ink.right > frame.right + 1);
  });
  return [...seen.filter(isCut), ...inks].map((node) => `${node.tagName}.${node.className.baseVal ?? node.className} ${node.textContent.slice(0, 40)}`)"""

COVERED = """const toast = document.querySelector('.toast').getBoundingClientRect();
  const view = document.getElementById('main').getBoundingClientRect();
  return toast.height > 0 && toast.top >= view.bottom - 1 && toast.bottom <= innerHeight + 1"""


class Sizes(unittest.TestCase):
    folders = [SOURCE / "tools/web/page", os.environ["AXLECAST_FETCHED"]]

    def setUp(self):
        self.server = FullMachine(self.folders)
        self.addCleanup(self.server.close)

    def browse(self, size):
        browser = Browser(*size)
        self.addCleanup(browser.close)
        browser.size(*size)
        browser.open(self.server.url)
        browser.wait("return document.querySelectorAll('.tile').length === 3", "a tile for each device")
        self.server.tell_the_past()
        browser.wait("return document.querySelector('#main').innerText.includes('Counter overflow')", "the past")
        return browser

    def go(self, browser, view):
        browser.run("location.hash = arguments[0]", f"#{view}")
        browser.wait("return document.querySelector('#main > *')?.dataset.open === location.hash", view)

    def picture(self, browser, name):
        if PICTURES:
            browser.screenshot(pathlib.Path(PICTURES, f"{name.replace('/', '-')}.png"))

    def test_a_phone_shows_every_view_whole(self):
        browser = self.browse(PHONE)
        for view in VIEWS:
            self.go(browser, view)
            self.picture(browser, f"phone-{view}")
            with self.subTest(view):
                self.assertEqual(browser.run(CUT_OFF), [])
                self.assertLessEqual(browser.run("return document.documentElement.scrollWidth"), PHONE[0])
        self.assertEqual(browser.complaints(), [])

    def test_a_motor_shows_how_far_it_is_from_each_trip_limit(self):
        rows = """return Object.fromEntries([...document.querySelectorAll('.limits tbody tr')].map((row) =>
          [row.dataset.limit, [...row.cells].map((cell) => cell.innerText)]))"""
        for size in (PHONE, DESKTOP):
            browser = self.browse(size)
            self.go(browser, "device/conveyor")
            browser.wait("return document.querySelectorAll('.limits tbody tr').length === 6", "a row for each limit")
            shown = browser.run(rows)
            self.assertEqual(shown["power_upper_a"], ["Power above A, W", "300.0", "10000.0", "9700.0"])
            self.assertEqual(shown["power_upper_b"][3], "−10.0", "beyond its limit")
            self.assertEqual(shown["power_lower_a"], ["Power below A, W", "300.0", "100.0", "200.0"])
            self.assertEqual(shown["power_lower_b"][2:], ["Off", "–"])
            self.assertEqual(shown["overheat"], ["Overheat, °C", "40.0", "90.0", "50.0"])
            self.assertEqual(shown["excessive_shock"][2:], ["–", "–"], "not read yet")
            self.assertTrue(browser.run("return document.querySelector('.limits [data-beyond]').dataset.limit === 'power_upper_b'"))
            self.assertIn("received 7.0 s ago", browser.text(".limits-note"))
            self.assertEqual(browser.run(CUT_OFF), [])
            self.picture(browser, f"limits-{size[0]}")
            self.go(browser, "device/axis1")
            browser.wait("return document.querySelector('.limits').getClientRects().length === 0", "an encoder, which has none")
            self.assertEqual(browser.complaints(), [])

    def test_a_new_alarm_covers_no_data(self):
        browser = self.browse(DESKTOP)
        for view in ("charts", "buses", "device/axis1"):
            self.go(browser, view)
            self.server.say(alarms("axis2", [], []))
            self.server.say(alarms("axis2", [alarm("over_speed", "error", "Reduce the speed")], ["over_speed"]))
            browser.wait("return document.querySelector('.toast')?.innerText.includes('Over speed')", "the alarm, announced")
            browser.run("document.getAnimations().forEach((animation) => animation.finish())")
            self.picture(browser, f"toast-{view}")
            self.assertTrue(browser.run(COVERED), view)

    def test_a_motors_small_curve_begins_with_what_the_server_remembers(self):
        browser = self.browse(DESKTOP)
        points = "return (document.querySelector('.spark-line').getAttribute('d') ?? '').split('L').length > 100"
        browser.wait(points, "a minute and a half of points at once")

    def test_a_recorder_that_has_ended_is_not_called_silent(self):
        browser = self.browse(DESKTOP)
        self.go(browser, "recorders")
        self.assertIn("Ended", browser.text('[data-recorder="run"] header'))


class WithoutCurves(Sizes):
    """A build that has no uPlot: the rest of the page is as always, and it shows what is missing."""

    folders = [SOURCE / "tools/web/without_uplot", *Sizes.folders]

    def test_says_what_is_missing_and_how_to_add_it(self):
        browser = self.browse(DESKTOP)
        for view in ("charts", "device/axis1"):
            self.go(browser, view)
            self.picture(browser, f"without-curves-{view}")
            self.assertIn("AXLECAST_UPLOT", browser.text(".strip-stack"))
        self.go(browser, "trips")
        browser.wait("return document.querySelectorAll('.trip-panel').length === 7", "a trip's curves, which need no uPlot")
        self.assertEqual(browser.complaints(), [])


if __name__ == "__main__":
    unittest.main()
