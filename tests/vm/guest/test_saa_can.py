"""The driver of SAA encoders on a real CAN controller. Opposite: its simulator, or candump, cansend and cangen, which
know nothing of us."""

import json
import signal
import subprocess
import time

import can_bus
from can_bus import Candump, cangen, cansend
from can_machine import DOWN, OFFLINE, TURRET, UP, CanMachine
from machine import BIN, wait_for


class Readings(CanMachine):
    def test_the_simulator_on_the_other_controller_is_read(self):
        self.encoder()
        self.up()
        position = self.wait_position(9799)  # 215.32 / 360 * 2^14 = 9799.4
        self.assertAlmostEqual(position["value"], 215.31, delta=0.0001)

    def test_a_position_has_the_time_at_which_the_kernel_got_its_frame(self):
        """The driver is stopped for a while: what waited has the time of its arrival nevertheless."""
        device = TURRET % ", latency_us: 0, period_ms: 20, set_period: true, publish_hz: 100"
        self.encoder(device, "{turret: {speed_rpm: 6}}")
        self.up(device=device)
        dump = Candump("can0", test=self)
        dump.wait(5, "120")
        mark = self.data.mark()
        self.process.send_signal(signal.SIGSTOP)
        dump.wait(30, "120")
        self.process.send_signal(signal.SIGCONT)
        dump.wait(45, "120")
        wait_for(lambda: len(self.positions(mark)) > 30, "the positions that waited")
        # A frame of two bytes takes 44 bits, 53 with stuff bits: 0.2 ms. Slow enough that no two frames are alike.
        arrivals = {int(line.data[2:4] + line.data[:2], 16): line.time for line in dump.lines("120")}
        compared = [(p["utime"] / 1e6, arrivals[p["raw_counts"]]) for p in self.positions(mark)
                    if p["raw_counts"] in arrivals]
        self.assertGreater(len(compared), 30)
        for sampled, arrived in compared:
            self.assertLess(abs(arrived - sampled), 0.002, compared)

    def test_somebody_elses_frames_are_read_and_ours_are_as_the_manual_has_them(self):
        """SAA manual 5.4.1: 120# 47 26 = 9799 = 215.3100 degrees; start 01 NN, zero 20 NN."""
        witness = Candump("can1", test=self)
        # Slow enough that no whole turn fits between two readings: else nobody knows that the shaft stands still.
        self.up(device=TURRET % ", period_ms: 50, limits: {speed_rpm: 100}", online=False)
        self.assertEqual(witness.wait(1, "220")[0].data, "0120000000000000")
        encoder = cangen("can1", "-I", "120", "-L", 2, "-D", "4726", "-g", 50)
        self.addCleanup(encoder.kill)
        self.assertAlmostEqual(self.wait_position(9799)["value"], 215.31, delta=0.0001)

        self.bridge(self.config)
        zero = wait_for(lambda: self.order_zero(witness), "an order that is carried out")
        encoder.kill()
        cansend("can1", "120#2000")
        again = cangen("can1", "-I", "120", "-L", 2, "-D", "0000", "-g", 50)
        self.addCleanup(again.kill)
        out, err = zero.communicate(timeout=60)
        self.assertEqual((zero.returncode, json.loads(out)["verified"]), (0, 1), out + err)
        self.wait_position(0)
        self.assertEqual([p for p in self.positions() if p["raw_counts"] not in (9799, 0)], [],
                         "the reply as a position")
        self.assertEqual({line.data[:4] for line in witness.lines("220")}, {"0120", "2020"})

    def order_zero(self, witness):
        """A command that has reached the encoder; nothing if the driver refused it: the shaft must stand still
        first."""
        zero = subprocess.Popen([BIN / "axlecast", "do", "turret", "zero", "--yes", "--config", self.config, "--json"],
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

        def heard():
            return any(line.data.startswith("2020") for line in witness.lines("220"))
        wait_for(lambda: heard() or zero.poll() is not None, "20 NN on the bus, or a refusal")
        if heard():
            return zero
        print(zero.communicate()[0].strip())
        return None

    def test_single_readings_are_asked_for_one_by_one(self):
        device = TURRET % ", mode: single, timeout_us: 500000"
        self.encoder(device)
        witness = Candump("can1", test=self)
        self.up(device=device, keys="poll_hz: 5")
        self.wait_position(9799)
        commands = {line.data[:4] for line in witness.lines("220")}
        self.assertEqual(commands - {"0120"}, {"8020"})


class Interface(CanMachine):
    def test_an_interface_at_another_rate_is_refused_until_it_is_set(self):
        self.encoder()
        self.up()
        boot_id = self.boot_id()
        began = time.time_ns()
        can_bus.up("can0", 500000)
        message = self.reported(began, "can0 .* 500000 bit/s")
        self.assertEqual(message["state"], DOWN)
        line = self.type_what_it_says(message["last_error"])
        self.assertEqual(line, "ip link set can0 down; ip link set can0 up type can bitrate 250000 restart-ms 100")
        self.assertEqual(can_bus.details("can0")["bittiming"]["bitrate"], 250000)
        self.assert_recovered(boot_id)

    def test_an_interface_that_goes_down_is_reported_and_comes_back(self):
        self.encoder()
        self.up()
        boot_id = self.boot_id()
        began = time.time_ns()
        can_bus.down("can0")
        message = self.reported(began, "can0 is down")
        self.assertEqual(message["state"], DOWN)
        self.alarmed(began, "link_down")
        self.wait_device(OFFLINE)
        line = self.type_what_it_says(message["last_error"])
        self.assertEqual(line, "ip link set can0 up type can bitrate 250000 restart-ms 100")
        self.assert_recovered(boot_id)

    def test_a_second_driver_on_the_interface_is_refused(self):
        self.encoder()
        self.up()
        other = self.write(self.config.read_text().replace("machine: test", "machine: other"), "other.yaml")
        second = self.driver(other, "can-0", "saa-can", name="second")
        self.assertEqual(second.wait(60), 1)
        self.assertRegex(self.log("second"), r"another process holds it: .* \(axlecast-saa-ca, process \d+\); this driver ends")
        self.wait_more_positions()

    def test_an_encoder_that_falls_silent_is_reported_and_comes_back(self):
        self.encoder()
        self.up()
        boot_id = self.boot_id()
        self.set_simulated(self.nodes, "can-0", "turret", power="off")
        self.wait_device(OFFLINE)
        self.set_simulated(self.nodes, "can-0", "turret", power="on")
        self.assert_recovered(boot_id)


class Load(CanMachine):
    """The emulated controllers carry some 1000 frames a second, whatever their bit rate, and lose what comes faster:
    what candump gets is what came."""

    def test_nothing_is_lost_beside_others_at_90_percent_load(self):
        """20 kbit/s, frames of 8 bytes of at least 111 bits: 180 a second fill the bus."""
        for interface in ("can0", "can1"):
            can_bus.up(interface, 20000)
        self.encoder(bitrate=20000)
        self.up(bitrate=20000)
        dump = Candump("can0", test=self)
        mark = self.data.mark()
        load = cangen("can1", "-I", "3F0", "-L", 8, "-g", 4.5, "-p", 1000, "-n", 500)
        self.assertEqual(load.wait(), 0)
        frames = dump.lines("3F0")
        print(f"beside {len(frames) * 111 / 20000 / (frames[-1].time - frames[0].time):.0%} load")
        read = self.positions(mark)
        first, last = (position["utime"] / 1e6 for position in (read[0], read[-1]))
        came = [line for line in dump.lines("120") if first - 0.05 < line.time < last + 0.05]  # one each 0.1 s
        self.assertEqual((len(read), [p["missed"] for p in read if p["missed"]]), (len(came), []))
        self.assertGreater(len(read), 10)
        bus = self.data.last("BUS/can-0")
        self.assertEqual((bus["rx_dropped"], bus["state"]), (0, UP), bus)

    def test_at_full_load_the_driver_gets_every_frame_that_candump_gets(self):
        """1 Mbit/s, all frames the driver's own, as fast as the controllers can."""
        for interface in ("can0", "can1"):
            can_bus.up(interface, 1000000)
        self.up(bitrate=1000000, device=TURRET % ", period_ms: 1, start: false", online=False)
        wait_for(lambda: (self.data.last("BUS/can-0") or {}).get("state") == UP, "an open bus")
        dump = Candump("can0", test=self)
        load = cangen("can1", "-I", "120", "-L", 2, "-D", "4726", "-g", 0, "-p", 1000, "-n", 5000)
        self.assertEqual(load.wait(), 0)

        def counts():
            return len(dump.lines("120")), self.data.last("BUS/can-0")["exchanges"]
        wait_for(lambda: (lambda got, read: got > 100 and got == read)(*counts()),
                 lambda: f"as many readings as frames: {counts()}, {self.data.last('BUS/can-0')}")
        frames = dump.lines("120")
        print(f"{len(frames)} frames, {len(frames) / (frames[-1].time - frames[0].time):.0f} a second")
