"""The page of a machine with 300 devices: found by group, legible, and no more work for the browser than what has changed."""

import os
import pathlib
import unittest

from browser import Browser
from fake_server import FakeServer, alarms, now_us, reading
from machine import wait_for
from page import DESKTOP, PICTURES, SOURCE
from test_sizes import CUT_OFF, PHONE

DEVICES, A_BUS = 300, 10
ROWS = "return document.querySelectorAll('.device-row').length"
GROUPS = """return [...document.querySelectorAll('.device-group')].map((group) =>
    [group.querySelector('.group-name').innerText, group.querySelector('.count').innerText, group.querySelectorAll('.device-row').length])"""
CHOOSE = """const choose = document.getElementById('group-by'); choose.value = arguments[0];
  choose.dispatchEvent(new Event('input', { bubbles: true }))"""
# Changes of the document between two state frames, of which each row and the numbers of the groups are drawn.
WATCH = """window.changes = 0;
  new MutationObserver((list) => { window.changes += list.length; })
    .observe(document.querySelector('.groups'), { subtree: true, childList: true, characterData: true, attributes: true })"""


class Hall(FakeServer):
    """30 buses on two hosts; two kinds of name. Readings move only while `moving`."""

    def __init__(self, folders):
        self.moving, self.states, self.down = True, 0, set()
        names = [f"{'axis' if i % 3 else 'press-axis-'}{i:03}" for i in range(DEVICES)]
        super().__init__(folders, names)

    def bus_of(self, index):
        return f"line{index // A_BUS:02}"

    def hello(self):
        hello = super().hello()
        for index, device in enumerate(hello["devices"]):
            device["bus"] = self.bus_of(index)
        hello["buses"] = [{"bus": f"line{bus:02}", "family": "saa_can", "port": f"can{bus}", "simulated": True,
                           "host": "plc1" if bus < 20 else "cell2",
                           "devices": self.devices[bus * A_BUS:(bus + 1) * A_BUS]} for bus in range(DEVICES // A_BUS)]
        return hello

    def state(self):
        state = super().state()
        still = reading(0)
        for device in state["devices"]:
            device["reading"] = reading(now_us()) if self.moving else still
            if device["device"] in self.down:
                device.update(state="OFFLINE", reason="no reply")
        state["buses"] = [{**state["buses"][0], "bus": f"line{bus:02}", "state": "DOWN" if bus == 7 else "UP"}
                          for bus in range(DEVICES // A_BUS)]
        self.states += 1
        return state


class ManyDevices(unittest.TestCase):
    def setUp(self):
        self.server = Hall([SOURCE / "tools/web/page", os.environ["AXLECAST_FETCHED"]])
        self.addCleanup(self.server.close)

    def browse(self, size=DESKTOP):
        browser = Browser(*size)
        self.addCleanup(browser.close)
        browser.size(*size)
        browser.open(self.server.url)
        browser.wait(f"{ROWS} === arguments[0]", "a row for each device", DEVICES)
        browser.wait("return document.querySelector('.summary').innerText.includes('300 of 300')", "the states")
        return browser

    def picture(self, browser, name):
        if PICTURES:
            browser.screenshot(pathlib.Path(PICTURES, f"many-{name}.png"))

    def test_many_devices_are_dense_and_every_name_and_value_is_legible(self):
        browser = self.browse()
        browser.wait("return document.querySelector('.device-row .number').innerText.match(/\\d/)", "a value")
        self.picture(browser, "dense")
        cut = browser.run("return [...document.querySelectorAll('.row-name, .device-row .value')].filter((node) => "
                          "node.scrollWidth > node.clientWidth + 1).map((node) => node.innerText)")
        self.assertEqual(cut, [], "texts that are cut")
        columns = browser.run("return new Set([...document.querySelectorAll('.device-row')].map((row) => row.getBoundingClientRect().left)).size")
        self.assertGreaterEqual(columns, 4)
        size = browser.run("return parseFloat(getComputedStyle(document.querySelector('.row-name')).fontSize)")
        self.assertGreaterEqual(size, 12)
        self.assertEqual(browser.complaints(), [])

    def test_a_phone_shows_them_too(self):
        browser = self.browse(PHONE)
        self.picture(browser, "phone")
        self.assertEqual(browser.run(CUT_OFF), [])

    def test_groups_by_bus_host_and_name(self):
        self.server.down = {self.server.devices[0], self.server.devices[205]}
        browser = Browser(*DESKTOP)
        self.addCleanup(browser.close)
        browser.open(self.server.url)
        expected = {"bus": [[f"line{bus:02}", "9 of 10" if bus in (0, 20) else "10 of 10", 10] for bus in range(30)],
                    "host": [["plc1", "199 of 200", 200], ["cell2", "99 of 100", 100]],
                    "name": [["press-axis", "99 of 100", 100], ["axis", "199 of 200", 200]]}
        browser.wait("return document.querySelector('.summary').innerText.includes('298 of 300')", "the states")
        for by, groups in expected.items():
            browser.run(CHOOSE, by)
            browser.wait(f"return document.querySelectorAll('.group-head').length === {len(groups)}", f"groups by {by}")
            self.picture(browser, by)
            self.assertEqual(browser.run(GROUPS), groups)
        title = browser.run("return document.querySelector('[data-device=arguments]'.replace('arguments', CSS.escape(arguments[0]))).title",
                            self.server.devices[205])
        self.assertEqual(title, "Offline: no reply")
        self.assertEqual(browser.text(".bus-lines").split()[0], "line07", "of many buses, those that are not up")
        self.assertIn("29 of 30 up", browser.text("aside"))
        # The choice stays with this browser.
        browser.run("location.reload()")
        browser.wait("return document.querySelectorAll('.group-head').length === 2", "groups by name again")
        self.assertEqual(browser.run("return document.getElementById('group-by').value"), "name")

    def test_dense_can_be_switched_off(self):
        browser = self.browse()
        browser.click("#dense")
        browser.wait("return document.querySelectorAll('.tile').length === arguments[0]", "tiles", DEVICES)
        self.assertEqual(browser.run(ROWS), 0)
        self.assertEqual(browser.complaints(), [])

    def test_only_what_has_changed_is_drawn(self):
        self.server.moving = False
        browser = self.browse()
        browser.run(WATCH)
        start = self.server.states
        wait_for(lambda: self.server.states >= start + 10, "ten more states")
        self.assertEqual(browser.run("return window.changes"), 0, "states without a change")
        self.server.say(alarms(self.server.devices[3], [{
            "name": "over_speed", "code": 1, "source": "device", "severity": "error", "state": "live", "first_utime": 1,
            "last_utime": 1, "count": 1, "action": "slow down"}], ["over_speed"]))
        browser.wait("return document.querySelector('.device-row[data-worst=error]') !== null", "the alarm's row")
        changes = browser.run("return window.changes")
        self.assertTrue(0 < changes < 10, f"one row has changed: {changes}")
        elements = browser.run("return document.querySelectorAll('#main *').length")
        self.assertLess(elements, 12 * DEVICES, "elements a device")


if __name__ == "__main__":
    unittest.main()
