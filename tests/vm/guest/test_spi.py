"""SPI: the device that appears as /dev/spidev, and the drivers on it."""

import errno
import socket
import struct
import threading

from machine import BIN, Machine, wait_for
from spi_bus import (RD_BITS, RD_MODE, RD_MODE32, RD_SPEED, WR_BITS, WR_MODE, WR_MODE32, WR_SPEED, Spidev, machine_file,
                     stand_as)

VALID = 0x1


class Peer:
    """A simulator's end of drivers/hal/simulated_spi.h that writes down every transfer, (mode, bits per word, Hz,
    bytes out), and answers each byte's complement."""

    def __init__(self, path):
        self.transfers = []
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.listener.bind(str(path))
        self.listener.listen()
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        while True:
            try:
                host, _ = self.listener.accept()
            except OSError:
                return
            with host:
                host.send(b"axlecast-spi-1")
                while packet := host.recv(512):
                    mode, bits, hz = struct.unpack(">BBI", packet[:6])
                    self.transfers.append((mode, bits, hz, packet[6:]))
                    host.send(bytes(byte ^ 0xFF for byte in packet[6:]))

    def close(self):
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()


class Bridge(Machine):
    """The program that appears as /dev/spidev passes everything on unchanged and refuses what spidev refuses."""

    def setUp(self):
        super().setUp()
        self.peer = Peer(self.folder / "bus.spi")
        self.addCleanup(self.peer.close)
        stand_as(self, "spidev9.1", self.folder / "bus.spi")
        self.device = Spidev("/dev/spidev9.1")
        self.addCleanup(self.device.close)

    def refused(self, error, call, *arguments):
        with self.assertRaises(OSError) as caught:
            call(*arguments)
        self.assertEqual(caught.exception.errno, error)

    def test_mode_clock_and_word_are_kept_and_read_back(self):
        self.assertEqual(self.device.read(RD_MODE, 1), 0)
        for mode in (1, 2, 3):
            self.device.write(WR_MODE, mode, 1)
            self.assertEqual((self.device.read(RD_MODE, 1), self.device.read(RD_MODE32, 4)), (mode, mode))
        self.device.write(WR_MODE32, 2, 4)
        self.device.write(WR_SPEED, 1_500_000, 4)
        self.device.write(WR_BITS, 8, 1)
        self.assertEqual((self.device.read(RD_MODE, 1), self.device.read(RD_SPEED, 4), self.device.read(RD_BITS, 1)),
                         (2, 1_500_000, 8))
        self.device.transfer((bytes(4), 0, 0))
        self.assertEqual(self.peer.transfers, [(2, 8, 1_500_000, bytes(4))])

    def test_transfers_pass_unchanged_both_ways(self):
        sent = bytes(range(200))
        total, (received,) = self.device.transfer((sent, 250_000, 8))
        self.assertEqual((total, received), (200, bytes(255 - byte for byte in sent)))
        total, received = self.device.transfer((b"\x01", 1000, 8), (3, 2000, 0), (b"\x02\x03", 3000, 8))
        self.assertEqual((total, received), (6, [b"\xfe", b"\xff\xff\xff", b"\xfd\xfc"]))
        self.assertEqual(self.peer.transfers, [(0, 8, 250_000, sent), (0, 8, 1000, b"\x01"), (0, 8, 2000, bytes(3)),
                                               (0, 8, 3000, b"\x02\x03")])

    def test_what_a_controller_cannot_do_is_refused(self):
        self.refused(errno.EINVAL, self.device.write, WR_MODE32, 1 << 4, 4)  # SPI_3WIRE
        self.refused(errno.EINVAL, self.device.write, WR_BITS, 25, 1)
        self.refused(errno.EINVAL, self.device.write, WR_SPEED, 0, 4)
        self.refused(errno.EINVAL, self.device.transfer, (bytes(4), 0, 25))
        self.refused(errno.EMSGSIZE, self.device.transfer, (bytes(4097), 0, 8))
        self.refused(errno.ENOTTY, self.device.read, 0x80016B0F, 1)
        self.assertEqual(self.peer.transfers, [])

    def test_without_a_simulator_a_transfer_fails_until_there_is_one(self):
        stand_as(self, "spidev9.2", self.folder / "late.spi")
        device = Spidev("/dev/spidev9.2")
        self.addCleanup(device.close)
        self.refused(errno.EIO, device.transfer, (b"\x01", 0, 0))
        peer = Peer(self.folder / "late.spi")
        self.addCleanup(peer.close)
        self.assertEqual(device.transfer((b"\x01", 0, 0)), (1, [b"\xfe"]))


class Encoder(Machine):
    """A family's driver on /dev/spidev, and behind it the family's simulator, which counts whatever is not as the maker
    wants it: clock, mode, number of clocks, pauses."""

    COMPLAINTS = ("wrong_mode", "slow_clocks", "fast_clocks", "short_pauses", "few_clocks", "late_data", "unanswered")

    def up(self, family, devices, simulate, link="{spidev: /dev/spidev0.0}", keys="poll_hz: 20"):
        """Simulator, /dev/spidev0.0, driver."""
        self.nodes = self.write(machine_file("spi-0", family, devices, simulate=simulate, keys=keys), "nodes.yaml")
        self.config = self.write(machine_file("spi-0", family, devices, link=link, keys=keys))
        self.start("simulator", BIN / "axlecast", "simulate", self.nodes)
        socket_path = self.run_dir / "test/spi-0.spi"
        wait_for(socket_path.exists, lambda: f"{socket_path}; {self.log('simulator')}")
        self.spidev = stand_as(self, "spidev0.0", socket_path)
        self.data = self.watch(self.config)
        self.driver(self.config, "spi-0", family)
        self.wait_online(self.data, "axis")

    def position(self):
        position = self.data.last("POSITION/axis")
        return position if position and position["flags"] & VALID else None

    def wait_counts(self, counts, turns=0):
        wait_for(lambda: (lambda p: p and (p["raw_counts"], p["raw_turns"]) == (counts, turns))(self.position()),
                 lambda: f"{counts} in turn {turns}, not {self.data.last('POSITION/axis')}; "
                         f"{self.log('driver-spi-0')[-2000:]}")

    def encoder(self):
        return self.simulated(self.nodes, "spi-0")["devices"]["axis"]

    def assert_content(self):
        encoder = self.encoder()
        self.assertEqual({key: encoder[key] for key in self.COMPLAINTS if encoder.get(key)}, {}, encoder)

    def test_ssi_as_the_manual_has_it(self):
        """SAA manual 5.5: 12 bits, 495 = 43.5058 degrees."""
        self.up("ssi", "{axis: {model: saa58p24, bits: 12, unit: deg}}", "{axis: {start_deg: 43.52}}")
        self.wait_counts(495)
        self.assertAlmostEqual(self.position()["value"], 43.5058, delta=0.0001)
        self.assert_content()

    def test_ssi_of_several_turns_in_gray_code_read_twice(self):
        self.up("ssi", "{axis: {model: twk, bits: 13, turn_bits: 12, repeat: one_zero, unit: deg}}",
                "{axis: {start_deg: 90.01, start_turns: 1000}}", keys="cable_m: 100\n    poll_hz: 20")
        self.wait_counts(2048, 1000)
        self.assert_content()

    def test_biss_as_the_manual_has_it(self):
        """SAA manual 5.6: 16 bits, 35555 = 195.3094 degrees, CRC6."""
        self.up("biss", "{axis: {model: saa, bits: 16, unit: deg}}", "{axis: {start_deg: 195.312}}")
        self.wait_counts(35555)
        self.assertAlmostEqual(self.position()["value"], 195.3094, delta=0.0001)
        self.assert_content()
        self.set_simulated(self.nodes, "spi-0", "axis", error="on")
        wait_for(lambda: not self.position(), "a position that is not valid")

    def test_an_open_data_line_and_a_device_that_goes_are_reported_and_pass(self):
        self.up("biss", "{axis: {model: saa, bits: 16, unit: deg}}", "{axis: {start_deg: 195.312}}")
        self.wait_counts(35555)
        self.set_simulated(self.nodes, "spi-0", "axis", wiring="open")
        self.wait_state(self.data, 3, "axis")
        self.set_simulated(self.nodes, "spi-0", "axis", wiring="good")
        self.wait_state(self.data, 1, "axis")

        self.kill(self.spidev)
        self.wait_state(self.data, 3, "axis")
        wait_for(lambda: "/dev/spidev0.0 does not exist" in self.data.last("BUS/spi-0")["last_error"],
                 lambda: f"what to do, not {self.data.last('BUS/spi-0')}")
        stand_as(self, "spidev0.0", self.run_dir / "test/spi-0.spi")
        self.wait_state(self.data, 1, "axis")
        self.wait_counts(35555)

    def test_a_second_driver_is_refused(self):
        self.up("ssi", "{axis: {model: saa58p24, bits: 12, unit: deg}}", "{axis: {start_deg: 43.52}}")
        other = machine_file("spi-1", "ssi", "{other: {model: saa58p24, bits: 12, unit: deg}}",
                             link="{spidev: /dev/spidev0.0}").replace("machine: test", "machine: other")
        config = self.write(other, "other.yaml")
        second = self.driver(config, "spi-1", "ssi")
        self.assertEqual(second.wait(60), 1)
        self.assertRegex(self.log("driver-spi-1"), r"another process holds it: .* \(axlecast-ssi, process \d+\); this driver ends")
        self.wait_counts(495)
