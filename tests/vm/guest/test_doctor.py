"""`axlecast doctor` on the CAN interfaces and the clock of a machine of its own (the other conditions: tests/e2e)."""

import ctypes
import struct
import subprocess

import can_bus
from can_bus import cansend
from can_machine import TURRET, can_file
from doctor_machine import DoctorMachine
from machine import wait_for
from slcan_adapter import SlcanAdapter

ADJ_MAXERROR, ADJ_STATUS, STA_UNSYNC = 0x4, 0x10, 0x40  # linux/timex.h


def set_clock_status(status):
    """As a program does that keeps the clock: adjtimex(2)."""
    timex = ctypes.create_string_buffer(struct.pack("=I4xqqqqi", ADJ_STATUS | ADJ_MAXERROR, 0, 0, 1000, 0, status), 256)
    if ctypes.CDLL(None).adjtimex(timex) < 0:
        raise OSError("adjtimex")


class Can(DoctorMachine):
    def setUp(self):
        super().setUp()
        can_bus.up("can0", options="restart-ms 100")
        self.addCleanup(can_bus.down, "can0")
        self.config = self.on("can0")

    def on(self, interface, devices=TURRET % ""):
        return self.write(can_file(f"link: {{iface: {interface}, bitrate: 250000}}", devices), f"{interface}.yaml")

    def type(self, line):
        subprocess.run(["sh", "-c", line], check=True)

    def assert_mended_by_its_line(self, name):
        """What --fix does not cover is fixed by the line that is shown."""
        finding = self.found(name, self.config)[0]
        self.assertFalse(finding["safe"])
        self.type(finding["mend"][0])
        self.assert_quiet(name, self.config)

    def test_can_missing(self):
        self.assert_quiet("can_missing", self.config)
        self.assert_found("can_missing", self.on("can9"), "can9 does not exist")
        self.assert_found("can_missing", self.on("lo"), "lo is not a CAN interface")

    def test_can_down(self):
        self.assert_quiet("can_down", self.config)
        can_bus.down("can0")
        self.assert_found("can_down", self.config, "can0 is down")
        self.assert_mended_by_its_line("can_down")

    def test_can_bitrate(self):
        self.assert_quiet("can_bitrate", self.config)
        can_bus.up("can0", 125000)
        self.assert_found("can_bitrate", self.config, "125000 bit/s, the machine file has 250000")
        self.assert_mended_by_its_line("can_bitrate")

    def test_can_mode(self):
        self.assert_quiet("can_mode", self.config)
        for mode, text in (("listen-only", "listen-only"), ("loopback", "receives only its own"),
                           ("presume-ack", "presume-ack")):
            can_bus.up("can0", options=f"restart-ms 100 {mode} on")
            self.addCleanup(can_bus.up, "can0", 250000, f"{mode} off")
            self.assert_found("can_mode", self.config, text)
            self.assert_mended_by_its_line("can_mode")

    def test_can_restart(self):
        self.assert_quiet("can_restart", self.config)
        can_bus.up("can0", options="restart-ms 0")
        self.assert_found("can_restart", self.config, "restart-ms 0")
        self.assert_mended_by_its_line("can_restart")

    def test_can_queue(self):
        self.assert_quiet("can_queue", self.config)
        self.type("ip link set can0 txqueuelen 1")
        self.addCleanup(self.type, "ip link set can0 txqueuelen 10; rm -f /etc/udev/rules.d/99-axlecast.rules")
        self.assert_found("can_queue", self.config, "queues at most 1 frames")
        self.assert_mended("can_queue", self.config)

    def test_can_state(self):
        """QEMU's bus knows no errors: an adapter on a serial line does."""
        adapter = SlcanAdapter("can0")
        self.addCleanup(adapter.pull_out)
        can_bus.up(adapter.name, 250000)
        config = self.on(adapter.name)
        self.assert_quiet("can_state", config)
        adapter.plugged = False
        cansend(adapter.name, "120#01")
        wait_for(lambda: can_bus.details(adapter.name)["state"] == "ERROR-PASSIVE", "an open cable")
        self.assert_found("can_state", config, "error-passive")
        adapter.plugged, adapter.shorted = True, True
        wait_for(lambda: can_bus.details(adapter.name)["state"] == "BUS-OFF", "a short circuit")
        finding = self.assert_found("can_state", config, "bus-off")
        adapter.shorted = False
        self.type(finding["mend"][-1])
        self.assert_quiet("can_state", config)


class Clock(DoctorMachine):
    def test_clock_sync(self):
        config = self.machine()
        set_clock_status(STA_UNSYNC)
        finding = self.assert_found("clock_sync", config, "nothing keeps this host's clock in step")
        self.assertIn("timedatectl set-ntp true", finding["mend"])
        set_clock_status(0)
        self.addCleanup(set_clock_status, STA_UNSYNC)
        self.assert_quiet("clock_sync", config)

    def test_a_good_host_is_told_nothing(self):
        """No check is left out, and the machine's journal is on no disk that forgets."""
        set_clock_status(0)
        self.addCleanup(set_clock_status, STA_UNSYNC)
        code, told = self.doctor(self.machine(rest="bridge: {journal: /var/lib/axlecast/journal.db}"))
        self.assertEqual((code, [finding for finding in told["findings"] if finding["name"] != "lcm_library"]), (0, []))
