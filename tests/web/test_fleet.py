"""The fleet in the page: a real PostgreSQL with made-up machines, behind a server that shows a live machine besides."""

import json
import re
import time
import unittest

import jsonschema
from fleet_rows import AMPLITUDE, RAW_S, Fleet, value
from machine import BIN, one_axis, wait_for
from page import SOURCE, PageTest
from test_sizes import CUT_OFF, PHONE
from web_client import WebSocket

SCHEMA = json.loads((SOURCE / "docs/web_protocol.schema.json").read_text(encoding="utf-8"))
VALUE = '[data-device="axis1"] .value .number'
# The share of the columns of pixels of the first strip in which something has the colour of its curve.
DRAWN = """const canvas = document.querySelector('.strip canvas');
  const hue = getComputedStyle(document.querySelector('.strip .swatch')).backgroundColor.match(/\\d+/g).slice(0, 3).map(Number);
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  const columns = new Set();
  for (let i = 0; i < data.length; i += 4) {
    if (data[i + 3] > 200 && hue.every((part, channel) => Math.abs(part - data[i + channel]) < 30)) columns.add((i / 4) % canvas.width);
  }
  return columns.size / canvas.width"""


class FleetTest(PageTest):
    def setUp(self):
        super().setUp()
        self.cluster = Fleet().create().start()
        self.addCleanup(self.cluster.__exit__)
        self.cluster.fill()
        self.config = self.write(one_axis(simulate="{speed_rpm: 60}"))

    def live_axis(self):
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")

    def server(self, user="viewer", name="web"):
        """A server that shows the axis and the fleet; the address of its page."""
        return self.serve(self.config, "--fleet", self.cluster.connection(user=user), name=name)

    def socket(self, url):
        socket = WebSocket(int(re.search(r":(\d+)/", url)[1]))
        self.addCleanup(socket.close)
        self.assertEqual(socket.status, 101)
        return socket

    def ask(self, socket, **question):
        """The answer to a question."""
        self.number_of_questions = getattr(self, "number_of_questions", 0) + 1
        socket.ask(id=self.number_of_questions, **question)
        answer, _ = socket.until(lambda frame: frame.get("id") == self.number_of_questions or frame["type"] == "error")
        jsonschema.validate(answer, SCHEMA)
        return answer


class Answers(FleetTest):
    """The protocol: real frames against the schema, and what a bad reader or database costs."""

    def test_machines_devices_and_events(self):
        socket = self.socket(self.server())
        hello = socket.receive()
        jsonschema.validate(hello, SCHEMA)
        self.assertEqual((hello["mode"], hello["fleet"], hello["machine"]), ("live", True, "test"))
        answer = self.ask(socket, type="fleet_machines")
        machines = {machine["machine"]: machine for machine in answer["machines"]}
        self.assertEqual(list(machines), ["press1", "press10", "press2"])
        self.assertFalse(answer["more"])
        well, absent, troubled = machines["press1"], machines["press10"], machines["press2"]
        self.assertEqual((well["worst"], well["alarms"], well["holes"], well["devices"], well["online"]), (None, 0, 0, 3, 3))
        self.assertEqual((troubled["worst"], troubled["alarms"], troubled["holes"], troubled["lost_messages"]), ("warning", 1, 1, 1234))
        self.assertEqual((troubled["devices"], troubled["online"]), (2, 1))
        self.assertGreaterEqual(absent["lag_us"], 3600 * 10**6)
        self.assertEqual(absent["last_utime"], (self.cluster.now - 3600) * 10**6)

        devices = {device["device"]: device for device in self.ask(socket, type="fleet_devices", machine="press1")["devices"]}
        axis, motor = devices["axis1"], devices["conveyor"]
        self.assertEqual((axis["kind"], axis["unit"], axis["valid"], axis["state"]), ("position", "mm", True, "online"))
        self.assertAlmostEqual(axis["value"], value(self.cluster.now - 0.1), delta=0.01)
        self.assertEqual((motor["kind"], motor["unit"], motor["value"]), ("motor", "W", 300))
        lost = self.ask(socket, type="fleet_devices", machine="press2")["devices"][1]
        self.assertEqual((lost["device"], lost["kind"], lost["state"], lost["reason"], lost["value"]), ("gearbox", None, "offline", "no reply", None))

        hour = {"machine": "press2", "from_utime": (self.cluster.now - 3600) * 10**6, "to_utime": self.cluster.now * 10**6}
        alarms = self.ask(socket, type="fleet_alarms", **hour)["alarms"]
        self.assertEqual([(alarm["name"], alarm["state"]) for alarm in alarms],
                         [("over_speed", "cleared"), ("over_speed", "appeared"), ("battery_alarm", "appeared")])
        commands = self.ask(socket, type="fleet_commands", **hour)["commands"]
        self.assertEqual([(command["operation"], command["state"], command["verified"]) for command in commands],
                         [("zero_single_turn", "succeeded", True)])
        self.assertEqual(commands[0]["changes"], [{"key": "single_turn", "before": "131071", "after": "0"}])
        trips = self.ask(socket, type="fleet_trips", **hour)["trips"]
        self.assertEqual([(trip["device"], trip["trip_count"], trip["factors"]) for trip in trips], [("conveyor", 3, ["power upper A"])])
        before = {**hour, "to_utime": hour["from_utime"] + 1}
        for kind in ("alarms", "commands", "trips"):
            self.assertEqual(self.ask(socket, type=f"fleet_{kind}", **before)[kind], [])

    def curve(self, socket, seconds, device="axis1", column="value", end=0, machine="press1"):
        to = self.cluster.now - end
        answer = self.ask(socket, type="fleet_curve", machine=machine, device=device, column=column, from_utime=(to - seconds) * 10**6,
                          to_utime=to * 10**6)
        self.assertEqual(answer["type"], "fleet_curve", answer)
        times = [(answer["t0_utime"] + dt) / 1e6 for dt in answer["dt_us"]]
        self.assertEqual(times, sorted(set(times)))
        self.assertLess(len(times), 2100)
        return answer, list(zip(times, answer["value"]))

    def test_curves_are_samples_seconds_or_minutes(self):
        socket = self.socket(self.server())
        answer, points = self.curve(socket, 30)
        self.assertEqual((answer["step_us"], answer["unit"], len(points)), (0, "mm", 300))
        for t, shown in points:
            self.assertAlmostEqual(shown, value(t), delta=0.001)
        for seconds, step, tolerance in ((1800, 1, 0.5), (3600, 2, 1.0), (86400, 60, 30.0)):
            answer, points = self.curve(socket, seconds)
            self.assertEqual(answer["step_us"], step * 10**6)
            self.assertAlmostEqual(len(points), seconds / step, delta=3)
            for (t, shown), low, high in zip(points, answer["low"], answer["high"]):
                if shown is not None:
                    self.assertAlmostEqual(shown, value(t), delta=tolerance)
                    self.assertTrue(low <= shown + 1e-9 and shown <= high + 1e-9, (low, shown, high))
        self.assertEqual(sum(shown is None for _, shown in points), 1, "the driver was started again")
        # Without samples, seconds; without seconds, minutes.
        self.assertEqual(self.curve(socket, 30, end=RAW_S + 60)[0]["step_us"], 10**6)
        answer, points = self.curve(socket, 600, end=86400)
        self.assertEqual((answer["step_us"], len(points)), (60 * 10**6, 10))
        turns, points = self.curve(socket, 20, column="turns")
        self.assertEqual(turns["unit"], "turn")
        self.assertAlmostEqual(points[0][1], value(points[0][0]) / 100, delta=0.001)
        power, points = self.curve(socket, 60, device="conveyor", column="power_w")
        self.assertEqual((power["step_us"], power["unit"], len(points)), (0, "W", 60))
        power, points = self.curve(socket, 3600, device="conveyor", column="power_w")
        self.assertEqual((power["step_us"], len(points), max(power["high"])), (2 * 10**6, 900, 309))

    def test_what_a_browser_sends_is_never_part_of_a_statement(self):
        socket = self.socket(self.server())
        for name in ("'; DROP TABLE axlecast.machine; --", "press1' OR '1'='1", "$1", "\\", "press1\u0000", "%", "ä" * 60):
            for question in ({"type": "fleet_devices"}, {"type": "fleet_alarms", "from_utime": 1, "to_utime": 2},
                             {"type": "fleet_curve", "device": name, "column": "value", "from_utime": 1, "to_utime": 2}):
                answer = self.ask(socket, machine=name, **question)
                rows = answer.get("devices", answer.get("alarms", answer.get("dt_us")))
                self.assertTrue(rows == [] or answer["type"] == "error", answer)
        self.assertEqual(len(self.ask(socket, type="fleet_machines")["machines"]), 3)

    def test_too_many_questions_are_refused_and_the_rest_is_answered(self):
        socket = self.socket(self.server())
        with self.locked():
            for number in range(1, 21):
                socket.ask(type="fleet_machines", id=number)
            for _ in range(8):
                refusal, _ = socket.until(lambda frame: frame["type"] == "error")
                self.assertIn("more than 12 open questions", refusal["text"])
        answered = [socket.until(lambda frame: frame["type"] == "fleet_machines")[0]["id"] for _ in range(12)]
        self.assertEqual(answered, list(range(1, 13)))

    def locked(self):
        """While it lasts, the database answers no question about machines."""
        test = self

        class Locked:
            def __enter__(self):
                self.process = test.start("psql", "psql", "-X", "-d", test.cluster.connection(), "-c",
                                          "BEGIN; LOCK TABLE axlecast.machine IN ACCESS EXCLUSIVE MODE; SELECT 'locked', pg_sleep(1000)",
                                          "-v", "ON_ERROR_STOP=1")
                test.cluster.wait_for("SELECT count(*) FROM pg_locks WHERE mode = 'AccessExclusiveLock' AND granted "
                                      "AND relation = 'axlecast.machine'::regclass", "1")

            def __exit__(self, *_):
                test.cluster.sql("SELECT pg_terminate_backend(pid) FROM pg_locks WHERE mode = 'AccessExclusiveLock' AND granted "
                                 "AND relation = 'axlecast.machine'::regclass")
                self.process.wait()
        return Locked()

    def test_a_slow_database_delays_no_live_data_and_has_a_limit(self):
        self.live_axis()
        socket = self.socket(self.server())
        socket.until(lambda frame: frame["type"] == "state" and frame["devices"][0]["state"] == "ONLINE")
        with self.locked():
            start = time.monotonic()
            socket.ask(type="fleet_machines", id=1)
            answer, before = socket.until(lambda frame: frame["type"] == "fleet_error")
            waited = time.monotonic() - start
            jsonschema.validate(answer, SCHEMA)
            self.assertIn("timeout", answer["text"])
            states = sum(frame["type"] == "state" for frame in before)
            self.assertGreater(states, 3 * waited, f"states in {waited} s, of four a second")
            self.assertLess(waited, 60)
        self.assertEqual(len(self.ask(socket, type="fleet_machines")["machines"]), 3)

    def test_it_reads_as_the_reader_and_says_what_is_wrong(self):
        url = self.server(user="stranger")
        answer = self.ask(self.socket(url), type="fleet_machines")
        self.assertEqual((answer["type"], answer["away"]), ("fleet_error", True))
        self.assertIn("axlecast_reader", answer["text"])
        # A user that may do everything is the reader too, and no more.
        socket = self.socket(self.server(user="postgres", name="second"))
        self.assertEqual(self.ask(socket, type="fleet_machines")["type"], "fleet_machines")
        self.cluster.sql("REVOKE SELECT ON axlecast.alarm FROM axlecast_reader")
        answer = self.ask(socket, type="fleet_alarms", machine="press1", from_utime=1, to_utime=2)
        self.assertEqual((answer["type"], answer["away"]), ("fleet_error", False))
        self.assertIn("permission denied", answer["text"])
        self.assertEqual(len(self.ask(socket, type="fleet_devices", machine="press1")["devices"]), 3, "the rest is answered")

    def test_a_fleet_alone_needs_no_machine(self):
        folder = self.folder / "empty"
        folder.mkdir()
        process = self.start("web", BIN / "axlecast", "web", "--fleet", self.cluster.connection(user="viewer"), "--port", "0", cwd=folder)
        found = wait_for(lambda: re.search(r"https?://\S+/", self.log("web")) or process.poll() is not None, lambda: self.log("web"))
        socket = self.socket(found.group(0))
        hello = socket.receive()
        self.assertEqual((hello["mode"], hello["fleet"], hello["devices"]), ("fleet", True, []))
        self.assertEqual(len(self.ask(socket, type="fleet_machines")["machines"]), 3)
        browser = self.browse(found.group(0))
        browser.wait("return document.querySelectorAll('[data-machine]').length === 3", "the machines")
        self.assertEqual(browser.text("nav"), "Fleet", "the only view")
        self.assertEqual(browser.complaints(), [])

    def test_without_a_fleet_a_question_is_refused(self):
        socket = self.socket(self.serve(self.config))
        hello = socket.receive()
        self.assertFalse(hello["fleet"])
        self.assertIn("--fleet", self.ask(socket, type="fleet_machines")["text"])


class Page(FleetTest):
    def tearDown(self):
        self.assertEqual(self.browser.complaints(), [])
        super().tearDown()

    def show(self, view="fleet"):
        url = self.server()
        self.browser = self.browse(f"{url}#{view}")
        return self.browser

    def machines(self):
        return self.browser.run("return [...document.querySelectorAll('[data-machine]')].map((row) => row.dataset.machine)")

    def test_machines_are_listed_filtered_and_sorted(self):
        browser = self.show()
        browser.wait("return document.querySelectorAll('[data-machine]').length === 3", "three machines")
        self.picture(browser, "fleet")
        self.assertEqual(self.machines(), ["press1", "press2", "press10"])
        self.assertIn("2 of 3 machines up to date", browser.text(".summary"))
        row = browser.text('[data-machine="press2"]')
        self.assertRegex(row, r"Up to date.*\s1\s+1 of 2\s+1")
        self.assertIn("Absent", browser.text('[data-machine="press10"]'))
        self.assertEqual(browser.run("return document.querySelector('[data-machine=press2] .alarms-of [role=img]').ariaLabel"), "Warning")
        browser.click('[data-sort="alarms"]')
        self.assertEqual(self.machines(), ["press2", "press1", "press10"])
        self.assertEqual(browser.run("return document.querySelector('[aria-sort=descending]').innerText.trim()"), "Alarms")
        browser.run("document.querySelector('[data-sort=lag]').focus()")
        browser.press("\ue007")  # Enter
        browser.wait("return document.querySelector('[data-machine]').dataset.machine === 'press10'", "sorted by a key")
        browser.write("#fleet-filter", "PRESS1")
        browser.wait("return document.querySelectorAll('[data-machine]').length === 2", "filtered")
        self.assertEqual(self.machines(), ["press10", "press1"])
        browser.click("#fleet-troubled")
        browser.wait("return document.querySelectorAll('[data-machine]').length === 1", "only what needs attention")
        self.assertEqual(self.machines(), ["press10"])

    def test_a_machine_its_devices_and_its_past(self):
        browser = self.show()
        browser.wait("return document.querySelector('[data-machine=press1] a')", "the machine")
        browser.click('[data-machine="press1"] a')
        browser.wait("return document.querySelector('.fleet-machine [data-device=axis1] .number')?.innerText.match(/\\d/)", "its devices")
        self.assertIn("3 of 3 online", browser.text(".summary"))
        self.assertIn("mm", browser.text("[data-device=axis1]"))
        self.picture(browser, "fleet-devices")
        browser.click('[data-device="axis1"] a')
        expected = f"−{AMPLITUDE:.3f}"
        browser.wait(f"return document.querySelector('.strip .range dd')?.innerText === '{expected}'", "the curve of an hour: whole swings")
        self.assertIn("#fleet/press1/history/3600/axis1.value", browser.run("return location.hash"))
        self.assertGreater(browser.run(DRAWN), 0.7, "the curve, beside the numbers of its axis")
        self.picture(browser, "fleet-history")
        # Another range, a second curve, and a zoom that asks for samples.
        browser.run("const last = document.querySelector('[data-act=last]'); last.value = '86400'; last.dispatchEvent(new Event('change'))")
        browser.wait("return location.hash.includes('/86400/')", "a day")
        browser.wait("return document.querySelector('.strip-stack').dataset.span === '86400.000'", "a day is shown")
        browser.run("document.querySelector('input[value=\"conveyor.power_w\"]').click()")
        browser.wait("return document.querySelectorAll('.strip').length === 2", "the motor's strip")
        browser.wait("return document.querySelectorAll('.strip')[1].querySelector('.range dd').innerText === '300.0'", "its curve")
        now = self.cluster.now
        self.go(browser, f"fleet/press1/history/{now - 40}-{now - 20}/axis1.value")
        browser.wait("return document.querySelectorAll('.strip').length === 1 && document.querySelector('.strip-stack').dataset.following === 'false'",
                     "a time that was given")
        least = min(value(now - 40 + i / 10) for i in range(200))
        browser.wait(f"return Math.abs(Number(document.querySelector('.strip .range dd').innerText.replace('−', '-')) - {least}) < 0.2",
                     "the samples of 20 s")
        self.picture(browser, "fleet-samples")

    def test_alarms_commands_and_trips_of_a_time(self):
        browser = self.show("fleet/press2/alarms")
        browser.wait("return document.querySelectorAll('[data-alarm]').length === 3", "the alarms of an hour")
        self.assertIn("Check <b>it</b>", browser.text("[data-alarm]"), "text from the database is never markup")
        self.assertIn("gone", browser.text("[data-alarm]"))
        self.picture(browser, "fleet-alarms")
        browser.click('[data-tab="commands"]')
        browser.wait("return document.querySelector('[data-command]')?.innerText.includes('Done, read back')", "the command")
        browser.click('[data-tab="trips"]')
        browser.wait("return document.querySelectorAll('.trip-panel').length === 7", "the trip's curves")
        self.picture(browser, "fleet-trip")
        old = f"{self.cluster.now - 9000}-{self.cluster.now - 8000}"
        self.go(browser, f"fleet/press2/alarms/{old}")
        browser.wait("return document.querySelector('.fleet-part .empty')?.checkVisibility() && !document.querySelector('[data-alarm]')", "no alarm then")

    def test_a_phone_shows_every_view_whole(self):
        browser = self.show()
        browser.size(*PHONE)
        for view, there in (("fleet", "[data-machine]"), ("fleet/press1", ".fleet-machine [data-device]"), ("fleet/press1/history", ".strip"),
                            ("fleet/press2/alarms", ".fleet-machine [data-alarm]"), ("fleet/press2/commands", ".fleet-machine [data-command]"),
                            ("fleet/press2/trips", ".fleet-machine .trip-panel")):
            self.go(browser, view)
            browser.wait("return document.querySelector(arguments[0])", view, there)
            self.picture(browser, view.replace("/", "-") + "-phone")
            self.assertEqual(browser.run(CUT_OFF), [], view)

    def test_a_database_that_is_killed_is_said_and_the_live_page_goes_on(self):
        self.live_axis()
        browser = self.show()
        browser.wait("return document.querySelectorAll('[data-machine]').length === 3", "three machines")
        self.cluster.kill()
        browser.wait("return document.querySelector('.fleet-away')?.innerText.includes('Database away: ')", "it is away")
        self.assertIn("Check that the server runs", browser.text(".fleet-away"))
        self.assertEqual(len(self.machines()), 3, "the last answer stays")
        self.picture(browser, "fleet-away")
        self.assertEqual(browser.run("return document.querySelector('.freshness').dataset.fresh"), "true")
        self.go(browser, "machine")
        shown = browser.wait("return document.querySelector(arguments[0])?.innerText.match(/\\d/)?.input", "the live value", VALUE)
        browser.wait("return document.querySelector(arguments[0]).innerText !== arguments[1]", "it moves on", VALUE, shown)
        self.go(browser, "fleet")
        self.cluster.start()
        browser.wait("return document.querySelector('.fleet-away').hidden", "it answers again", limit=120)


if __name__ == "__main__":
    unittest.main()
