"""The metrics that axlecast ship serves, as Prometheus reads them."""

import pathlib
import re
import subprocess
import unittest

from machine import BIN, Machine, one_axis, wait_for
from web_client import WebSocket, request

PORT = 8381
SHIP = """
recorder: {logs: {all: {}}}
ship: {database: host=/nowhere}
web: {names: [press3.plant.example]}
"""
DOCUMENT = pathlib.Path(__file__).resolve().parents[2] / "docs" / "fleet.md"


class ShipMetrics(Machine):
    def setUp(self):
        super().setUp()
        self.config = self.write(one_axis() + SHIP)
        (self.folder / "logs").mkdir()

    def ship(self, *options):
        return self.start("ship", BIN / "axlecast", "ship", self.config, "--folder", self.folder / "logs", "--state", self.folder / "ship",
                          *options)

    def answer(self, path, **options):
        """Status and text of an answer; None while nobody listens."""
        try:
            status, _, body = request(PORT, path, **options)
        except ConnectionRefusedError:
            return None
        return status, body.decode()

    def test_a_shipper_without_a_database_serves_its_metrics(self):
        process = self.ship("--metrics", PORT)
        wait_for(lambda: self.answer("/healthz") or process.poll() is not None, lambda: self.log("ship"))
        self.assertEqual(self.answer("/healthz"), (200, '{"status":"ok"}\n'), self.log("ship"))
        status, metrics = self.answer("/metrics", headers={"Host": f"press3.plant.example:{PORT}"})
        self.assertEqual(status, 200)
        self.assertIn("\naxlecast_ship_database_up 0\n", metrics)
        judged = subprocess.run(["promtool", "check", "metrics"], input=metrics, capture_output=True, text=True, check=False)
        self.assertEqual((judged.returncode, judged.stdout + judged.stderr), (0, ""))
        documented = re.findall(r"^\| `(axlecast_ship_\w+)` \| (\w+)", DOCUMENT.read_text(encoding="utf-8"), re.MULTILINE)
        self.assertEqual(re.findall(r"^# TYPE (\w+) (\w+)$", metrics, re.MULTILINE), documented)

        self.assertEqual(self.answer("/")[0], 404)
        self.assertEqual(self.answer("/metrics", method="POST", body=b"x")[0], 405)
        self.assertEqual(self.answer("/metrics", headers={"Host": "evil.example"})[0], 403)
        socket = WebSocket(PORT)
        self.addCleanup(socket.close)
        self.assertEqual(socket.status, 404)

        process.terminate()
        self.assertEqual(process.wait(60), 0, self.log("ship"))

    def test_status_reports_the_alarms_of_the_shipper(self):
        self.ship()
        wait_for(lambda: "ship: database_away" in self.axlecast("status", self.config)[1], lambda: self.log("ship"), 120)

    def test_an_address_that_cannot_be_served_is_an_error(self):
        for metrics, code, reason in (("press3:8381", 2, "ship.metrics: 'press3:8381'"), ("192.0.2.7:8381", 4, "this host has no such address")):
            process = self.ship("--metrics", metrics)
            self.assertEqual(process.wait(60), code, self.log("ship"))
            self.assertIn(reason, self.log("ship"))


if __name__ == "__main__":
    unittest.main()
