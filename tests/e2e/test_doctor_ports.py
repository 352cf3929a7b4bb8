"""`axlecast doctor`: ports, and what the timing of a bus depends on. A host below a folder has the adapters that this one
lacks."""

import contextlib
import os
import pathlib
import subprocess
import unittest

from doctor_machine import DoctorMachine
from machine import wait_for

SPI = """machine: test
buses:
  ssi-0:
    family: ssi
    link: {spidev: /dev/spidev0.0}
    devices: {gate: {model: twk, bits: 13, turn_bits: 12, unit: deg, publish_hz: 100}}
"""


class Ports(DoctorMachine):
    def setUp(self):
        super().setUp()
        self.config = self.on_port()
        self.there = ("--root", self.root)

    def line(self):
        """A real line of this process, which has its other end."""
        master, slave = os.openpty()
        path = os.ttyname(slave)
        os.close(slave)
        self.addCleanup(os.close, master)
        return path

    def test_port_missing(self):
        self.plug_in()
        self.assert_quiet("port_missing", self.config, *self.there)
        (self.root / "dev/ttyUSB0").unlink()
        self.assert_found("port_missing", self.config, "/dev/ttyUSB0 does not exist", *self.there)
        self.put("dev/ttyUSB0", "")
        self.assert_found("port_missing", self.config, "is not a device", *self.there)

    def test_port_missing_of_spi(self):
        finding = self.assert_found("port_missing", self.write(SPI), "/dev/spidev0.0", *self.there)
        self.assertIn("modprobe spidev", finding["mend"])

    def test_port_permission(self):
        path = self.line()
        config = self.on_port(path)
        os.chmod(path, 0o600)
        self.assert_found("port_permission", config, "mode 0600", before=self.as_nobody())
        os.chmod(path, 0o666)
        self.assert_quiet("port_permission", config, before=self.as_nobody())

    def test_port_permission_of_a_service_is_judged_for_root(self):
        path = self.line()
        config = self.on_port(path)
        self.need_users()
        os.chown(path, 0, 0)
        os.chmod(path, 0o660)
        finding = self.assert_found("port_permission", config, "root:root with mode 0660")
        self.assertIn("99-axlecast.rules", " ".join(finding["mend"]))
        os.chown(path, 0, 20)  # dialout
        self.assert_quiet("port_permission", config)

    def test_port_held(self):
        path = self.line()
        config = self.on_port(path)
        self.assert_quiet("port_held", config)
        with open(path, "rb", buffering=0) as line:
            holder = subprocess.Popen(["sleep", "1000"], stdin=line)
        self.addCleanup(holder.wait)
        self.addCleanup(holder.kill)
        finding = self.assert_found("port_held", config, f"process {holder.pid} (sleep)")
        self.assertIn(f"kill {holder.pid}", finding["mend"][0])

    @staticmethod
    def open_files(pid):
        files = []
        for link in pathlib.Path(f"/proc/{pid}/fd").iterdir():
            with contextlib.suppress(FileNotFoundError):  # closed meanwhile
                files.append(os.readlink(link))
        return files

    def test_port_held_by_the_bus_own_driver_is_right(self):
        path = self.line()
        config = self.on_port(path)
        driver = self.driver(config, "rs485-0")
        wait_for(lambda: path in self.open_files(driver.pid), "the driver on its port")
        self.assert_quiet("port_held", config)

    def test_port_name(self):
        self.plug_in()
        finding = self.assert_found("port_name", self.config, "/dev/ttyUSB0", *self.there)
        lasting = "/dev/serial/by-id/usb-FTDI_C232HM_FT1-if00-port0"
        self.assertIn(lasting, finding["mend"][0])
        self.assert_quiet("port_name", self.on_port(lasting), *self.there)

    def test_port_prober(self):
        self.plug_in()
        self.put("proc/77/comm", "sshd")
        self.assert_quiet("port_prober", self.config, *self.there)
        self.put("proc/77/comm", "ModemManager")
        finding = self.assert_found("port_prober", self.config, "ModemManager", *self.there)
        self.assertIn('ATTRS{idVendor}=="0403", ATTRS{idProduct}=="6014"', finding["mend"][0])

    def test_usb_latency(self):
        timer = self.plug_in(latency_ms=16)
        self.assert_found("usb_latency", self.config, "16 ms", *self.there)
        self.assert_mended("usb_latency", self.config, *self.there)
        self.assertEqual(self.text(timer), "1\n")
        self.assertIn('ATTR{latency_timer}="1"', self.text("etc/udev/rules.d/99-axlecast.rules"))

    def test_adapter_rate(self):
        self.plug_in(release="0900")
        self.assert_quiet("adapter_rate", self.config, *self.there)
        self.plug_in(release="0600")  # FT232R: 2 or 3 Mbaud
        self.assert_found("adapter_rate", self.config, "FT232R", *self.there)

    def test_spi_buffer(self):
        config = self.write(SPI)
        self.put("sys/module/spidev/parameters/bufsiz", 4096)
        self.assert_quiet("spi_buffer", config, *self.there)
        self.put("sys/module/spidev/parameters/bufsiz", 64)
        self.assert_found("spi_buffer", config, "at most 64 bytes", *self.there)

    # -- timing

    def test_realtime_priority(self):
        config = self.on_port(bus="realtime: {priority: 60}")
        self.assert_found("realtime_priority", config, "requests priority 60", before=self.as_nobody("--rtprio=0"))
        self.assert_quiet("realtime_priority", config)  # root may have any

    def test_realtime_memory(self):
        config = self.on_port(bus="realtime: {lock_memory: true}")
        self.assert_found("realtime_memory", config, "64 kB", before=self.as_nobody("--memlock=65536"))
        self.assert_quiet("realtime_memory", config)

    def test_realtime_cpu(self):
        self.put("sys/devices/system/cpu/online", "0-1,4")
        self.assert_quiet("realtime_cpu", self.on_port(bus="realtime: {cpu: 4}"), *self.there)
        self.assert_found("realtime_cpu", self.on_port(bus="realtime: {cpu: 3}"), "processor 3", *self.there)
        self.assert_found("realtime_cpu", self.on_port(bus="realtime: {cpu: 1000}"), "processor 1000")

    def test_cpu_governor(self):
        for cpu in (0, 1):
            self.put(f"sys/devices/system/cpu/cpu{cpu}/cpufreq/scaling_governor", "powersave")
        self.assert_quiet("cpu_governor", self.config, *self.there)  # 500 Hz
        config = self.on_port(bus="poll_hz: 1000")
        self.assert_found("cpu_governor", config, "powersave", *self.there)
        self.assert_mended("cpu_governor", config, *self.there)
        self.assertEqual(self.text("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor"), "performance\n")

    def test_clock_source(self):
        source = "sys/devices/system/clocksource/clocksource0/current_clocksource"
        config = self.on_port(bus="poll_hz: 1000")
        self.put(source, "tsc")
        self.assert_quiet("clock_source", config, *self.there)
        self.put(source, "hpet")
        self.assert_found("clock_source", config, "hpet", *self.there)
        self.assert_quiet("clock_source", self.on_port(), *self.there)


if __name__ == "__main__":
    unittest.main()
