"""What goes wrong on a CAN bus, as the kernel reports it of an adapter at a serial line (slcan_adapter.py)."""

import time
import unittest

import can_bus
from can_bus import Candump, cansend
from can_machine import OFFLINE, WITHIN, CanMachine
from machine import wait_for
from slcan_adapter import SlcanAdapter

# linux/can/error.h: of the identifier of an error frame
ERR_CRTL, ERR_PROT, ERR_ACK, ERR_BUSOFF, ERR_BUSERROR = 0x4, 0x8, 0x20, 0x40, 0x80
# of its data[1]
CRTL_RX_OVERFLOW, CRTL_RX_PASSIVE, CRTL_TX_PASSIVE, CRTL_RX_WARNING = 0x01, 0x10, 0x20, 0x04


class Adapter(unittest.TestCase):
    """The emulated adapter and the kernel's driver for it agree with each other."""

    def setUp(self):
        for interface in ("can0", "can1"):
            can_bus.up(interface)
            self.addCleanup(can_bus.down, interface)
        self.adapter = SlcanAdapter("can0")
        self.name = self.adapter.name
        self.addCleanup(lambda: self.adapter.pull_out())  # the test may have put in another
        can_bus.up(self.name, 250000)
        self.errors = Candump(self.name, errors=True, test=self)

    def state(self):
        return can_bus.details(self.name)["state"]

    def wait_state(self, state):
        wait_for(lambda: self.state() == state, lambda: f"{state}, not {self.state()}")

    def wait_error(self, flags, data1=0):
        """An error frame with these flags, and these in data[1]."""
        def found(line):
            return int(line.id, 16) & flags == flags and int(line.data[2:4], 16) & data1 == data1
        wait_for(lambda: any(found(line) for line in self.errors.errors()),
                 lambda: f"error frame {flags:#x} {data1:#x}, only {self.errors.errors()}")

    def test_a_sound_bus_carries_frames_both_ways(self):
        self.assertEqual(self.adapter.commands[:3], ["C", "S5", "O"])
        far = Candump("can1", test=self)
        cansend(self.name, "120#01", "1FFFFFFF#AABB")
        self.assertEqual([(line.id, line.data) for line in far.wait(2)], [("120", "01"), ("1FFFFFFF", "AABB")])
        cansend("can1", "121#4726", "00000121#01", "122#R")
        self.assertEqual([(line.id, line.data) for line in self.errors.wait(5)[2:]],
                         [("121", "4726"), ("00000121", "01"), ("122", "R")])
        self.assertEqual((self.state(), self.errors.errors()), ("ERROR-ACTIVE", []))

    def test_an_open_cable_makes_it_error_passive_and_never_bus_off(self):
        self.adapter.plugged = False
        cansend(self.name, "120#01")
        self.wait_error(ERR_ACK)
        self.wait_error(ERR_CRTL, CRTL_TX_PASSIVE)
        self.wait_state("ERROR-PASSIVE")
        self.assertEqual(self.adapter.tec, 128)
        far = Candump("can1", test=self)
        self.adapter.plugged = True
        self.assertEqual(far.wait(1)[0].data, "01")
        can_bus.cangen(self.name, "-I", "120", "-n", 40, "-g", 1, "-p", 1000).wait()
        self.wait_state("ERROR-ACTIVE")

    def test_a_short_circuit_leads_to_bus_off_until_the_interface_is_restarted(self):
        self.adapter.shorted = True
        cansend(self.name, "120#01")
        self.wait_error(ERR_BUSOFF)
        self.wait_state("BUS-OFF")
        self.adapter.shorted = False
        can_bus.up(self.name)
        far = Candump("can1", test=self)
        cansend(self.name, "120#02")
        self.assertEqual(far.wait(1)[0].data, "02")
        self.assertEqual(self.state(), "ERROR-ACTIVE")

    def test_a_wrong_bit_rate_is_passive_when_listening_and_bus_off_when_sending(self):
        can_bus.up(self.name, 500000)
        self.assertEqual(self.adapter.commands[-3:], ["C", "S6", "O"])
        cansend("can1", *["120#01"] * 20)
        self.wait_error(ERR_PROT | ERR_BUSERROR)
        self.wait_error(ERR_CRTL, CRTL_RX_PASSIVE)
        self.wait_state("ERROR-PASSIVE")
        self.assertEqual(self.errors.lines("120"), [])
        cansend(self.name, "121#01")
        self.wait_state("BUS-OFF")

    def test_frames_lost_in_the_adapter_are_told(self):
        self.adapter.lost = True
        cansend("can1", "120#01")
        self.wait_error(ERR_CRTL, CRTL_RX_OVERFLOW)

    def test_a_pulled_adapter_takes_its_interface_along(self):
        self.errors.close()
        self.adapter.pull_out()
        wait_for(lambda: "does not exist" in can_bus.ip_link(f"{self.name} up") or
                 "Cannot find device" in can_bus.ip_link(f"{self.name} up"), "the interface to go")
        self.adapter = SlcanAdapter("can0")
        self.assertEqual(self.adapter.name, self.name)


class Driver(CanMachine):
    """Our driver on that adapter, its simulator on the bus behind it."""

    def setUp(self):
        super().setUp()
        self.adapter = SlcanAdapter("can0")
        self.addCleanup(lambda: self.adapter.pull_out())  # the test may have put in another
        self.name = self.adapter.name
        can_bus.up(self.name, 250000)
        self.encoder()
        self.up(self.name)
        self.boot = self.boot_id()

    def test_bus_off_is_reported_and_over_when_the_interface_was_restarted(self):
        self.adapter.shorted = True
        cansend(self.name, "7F0#00")
        began = wait_for(lambda: self.adapter.since.get("b"), "the end of the adapter's patience")
        message = self.reported(began, f"{self.name}: bus-off, and stays so; check bit rate")
        self.alarmed(began, "can_bus_off")
        self.wait_device(OFFLINE)
        self.adapter.shorted = False
        self.type_what_it_says(message["last_error"])
        self.assert_recovered(self.boot)

    def test_an_open_cable_is_reported_and_over_when_it_is_plugged_in(self):
        self.adapter.plugged = False
        began = wait_for(lambda: self.adapter.since.get("e"), "an order that nobody acknowledges")
        self.assertIn("cable", self.reported(began, f"{self.name}: nobody acknowledges")["last_error"])
        self.alarmed(began, "can_unacknowledged")
        self.wait_device(OFFLINE)
        self.adapter.plugged = True
        self.assert_recovered(self.boot)

    def test_a_wrong_bit_rate_on_the_wire_is_reported_and_over_when_it_is_right(self):
        self.adapter.wire_bitrate = 500000
        began = wait_for(lambda: self.adapter.since.get("e"), "errors")
        self.assertIn("250000", self.reported(began, f"{self.name}: .*check bit rate")["last_error"])
        self.wait_device(OFFLINE)
        self.adapter.wire_bitrate = 250000
        can_bus.up(self.name, 250000)
        self.assert_recovered(self.boot)

    def test_frames_lost_in_the_adapter_are_counted(self):
        self.adapter.lost = True
        began = wait_for(lambda: self.adapter.lost_at, "a frame that is lost")
        self.reported(began, f"{self.name}: the controller lost")
        self.alarmed(began, "can_frames_lost")
        self.adapter.lost = False
        self.assert_recovered(self.boot)

    def test_a_pulled_adapter_is_reported_and_its_return_found(self):
        began = time.time_ns()
        self.adapter.pull_out()
        # The kernel itself takes its time to unregister an interface.
        self.reported(began, f"{self.name} does not exist", within=WITHIN + 2)
        self.adapter = SlcanAdapter("can0")
        self.assertEqual(self.adapter.name, self.name)
        can_bus.up(self.name, 250000)
        self.assert_recovered(self.boot)
