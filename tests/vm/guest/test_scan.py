"""`axlecast scan` on real CAN interfaces and on /dev/spidev: what it finds, the file that it writes, and that no frame goes
out. QEMU's bus knows no bit rate: the first that is tried finds. tests/e2e looks among wrong ones."""

import json
import subprocess

import can_bus
from can_bus import Candump, cangen
from can_machine import CanMachine
from machine import BIN, Machine, wait_for
from spi_bus import machine_file, stand_as

DONE, BAD = 0, 1


def scan(test, port, *options, expect=DONE):
    run = subprocess.run([BIN / "axlecast", "scan", port, "--json", "--write", test.folder / "found.yaml", "--force", *options],
                         capture_output=True, text=True, stdin=subprocess.DEVNULL)
    test.assertEqual(run.returncode, expect, run.stdout + run.stderr)
    test.errors = run.stderr
    return json.loads(run.stdout) if run.stdout else None


class Can(CanMachine):
    def encoder_speaks(self):
        """SAA manual 5.4.1: 120# 47 26, each 100 ms."""
        encoder = cangen("can1", "-I", "120", "-L", 8, "-D", "4726000000000000", "-g", 100)
        self.addCleanup(encoder.wait)
        self.addCleanup(encoder.kill)

    def found(self, *options):
        witness = Candump("can1", test=self)
        found, = scan(self, "can0", *options)["found"]
        self.assertEqual((found["family"], found["keys"]["node"]), ("saa_can", "0x20"))
        self.assertEqual([line for line in witness.lines() if line.id != "120"], [])
        return found

    def test_an_interface_that_is_down_listens_only_and_is_down_again(self):
        can_bus.down("can0")
        self.encoder_speaks()
        found = self.found("--sole-master")
        self.assertFalse(can_bus.details("can0").get("ctrlmode", []))
        self.assertEqual(can_bus.details("can0")["state"], "STOPPED")
        can_bus.up("can0", found["link"]["bitrate"])
        self.data = self.watch(self.folder / "found.yaml")
        self.driver(self.folder / "found.yaml", "bus1", "saa-can")
        self.wait_online(self.data, "axis1")

    def test_one_that_is_up_stays_as_it_is(self):
        self.encoder_speaks()
        before = can_bus.details("can0")
        self.assertEqual(self.found()["link"]["bitrate"], 250000)
        self.assertEqual(can_bus.details("can0")["bittiming"], before["bittiming"])
        self.assertEqual(can_bus.details("can0")["state"], before["state"])

    def test_one_that_is_down_is_not_touched_without_a_word(self):
        can_bus.down("can0")
        scan(self, "can0", expect=BAD)
        self.assertIn("--sole-master", self.errors)
        self.assertEqual(can_bus.details("can0")["state"], "STOPPED")

    def test_one_that_a_driver_has_is_left_alone(self):
        self.encoder_speaks()
        self.up()
        scan(self, "can0", expect=BAD)


class Spi(Machine):
    def test_a_biss_encoder_is_found_and_its_file_runs(self):
        nodes = self.write(machine_file("spi-0", "biss", "{axis: {model: saa, bits: 16}}", simulate="{axis: {speed_rpm: 20}}"))
        self.start("simulator", BIN / "axlecast", "simulate", nodes)
        socket_path = self.run_dir / "test/spi-0.spi"
        wait_for(socket_path.exists, lambda: f"{socket_path}; {self.log('simulator')}")
        stand_as(self, "spidev0.0", socket_path)
        found, = scan(self, "/dev/spidev0.0", "--sole-master")["found"]
        self.assertEqual((found["family"], found["confidence"], found["keys"]["bits"]), ("biss", "sure", 16))
        self.data = self.watch(self.folder / "found.yaml")
        self.driver(self.folder / "found.yaml", "bus1", "biss")
        self.wait_online(self.data, "axis1")
