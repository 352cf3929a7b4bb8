"""The bridge's memory and its guard, end to end: what happens when the journal cannot be written, what outlives a power
failure, another encoder in an old one's place, and a flood of forged messages."""

import json
import subprocess
import unittest

from machine import BIN, LIMIT, Machine, one_axis, wait_for

DONE, REJECTED, NOT_VERIFIED = 0, 3, 7
REFERENCED = 0x8
PASSWORD = "Gm3!right-one"


class Bridge(Machine):
    def lines(self, *words):
        """The output of a command that only reads the journal."""
        code, out, err = self.axlecast(*words, "--config", self.config, "--json")
        self.assertEqual(code, 0, err)
        return [json.loads(line) for line in out.splitlines()]

    def position(self, device="axis1"):
        return self.data.last(f"POSITION/{device}")


class JournalMachine(Bridge):
    """An encoder and a motor; the state directory is a file system of 1 MiB of its own."""

    def mount(self, *options):
        subprocess.run(["mount", *options, self.state], check=True)

    def run_machine(self):
        self.state = self.folder / "state"
        self.state.mkdir()
        # The namespace is ours; where the folder's own mount can be made private, nothing of it is seen outside.
        target = subprocess.run(["findmnt", "-n", "-o", "TARGET", "-T", self.state], capture_output=True, text=True)
        subprocess.run(["mount", "--make-private", target.stdout.strip()], stderr=subprocess.DEVNULL)
        self.mount("-t", "tmpfs", "-o", "size=1m", "state")
        self.addCleanup(subprocess.run, ["umount", "-l", self.state])
        password = self.folder / "password"
        password.touch(mode=0o600)
        password.write_text(PASSWORD + "\n")
        self.config = self.write(one_axis("{start_deg: 100}", "eeprom_writable: [10]") + f"""  rs485-1:
    family: tsubaki_sc
    pacing: per_unit
    simulate:
      timing: {{reading: W, pace: unpaced}}
      gm1: {{password: "{PASSWORD}", voltage_v: 230, load_w: 150}}
    devices:
      gm1: {{address: 1, passwords: {{main: {{file: {password}}}}}, password: main, motor_control: start_stop, permit: not_required}}
""")
        self.data = self.watch(self.config)
        self.simulator(self.config, "rs485-0")
        self.simulator(self.config, "rs485-1")
        self.driver(self.config, "rs485-0")
        self.driver(self.config, "rs485-1", family="tsubaki-sc")
        self.running_bridge = self.bridge(self.config)
        self.wait_online(self.data)
        self.wait_online(self.data, "gm1")
        self.byte = 0

    def write_byte(self):
        self.byte += 1
        return self.outcome("eeprom", "write", "axis1", "10", f"{self.byte:02X}", "--yes")

    def writes(self):
        return self.simulated(self.config, "rs485-0")["devices"]["axis1"]["eeprom_writes"]

    def fill(self):
        with open(self.state / "filler", "ab", buffering=0) as filler:
            try:
                while True:
                    filler.write(bytes(4096))
            except OSError:
                pass

    def check_refused(self, cause):
        """Changes are refused and not done; reads, a stop, and the positions continue."""
        wait_for(lambda: "journal_fails" in self.alarms(self.data, "bridge"), "ALARM/bridge journal_fails")
        before = self.writes()
        code, outcome = self.write_byte()
        self.assertEqual((code, outcome["reason"], outcome["temporary"]), (REJECTED, "journal", True), outcome)
        self.assertRegex(outcome["text"], cause)
        self.assertEqual(self.writes(), before)
        self.assertEqual(self.outcome("zero", "axis1", "--yes")[1]["reason"], "journal")
        code, outcome = self.outcome("eeprom", "read", "axis1", "10")
        self.assertEqual(code, DONE, outcome)
        code, outcome = self.outcome("do", "gm1", "stop_motor", "--yes")
        self.assertIn(code, (DONE, NOT_VERIFIED), outcome)
        mark = self.data.mark()
        wait_for(lambda: len(self.data.of("POSITION/axis1", since=mark)) > 50, "positions")
        self.assertEqual(self.data.last("DEVICE/axis1")["state"], 1)

    def check_works_again(self):
        wait_for(lambda: "journal_fails" not in self.alarms(self.data, "bridge"), "no more alarm")
        code, outcome = self.write_byte()
        self.assertEqual(code, DONE, (outcome, self.log("bridge")[-2000:]))


class Journal(JournalMachine):
    """The journal cannot be written."""

    def test_a_full_disk_refuses_changes_only_and_recovers(self):
        self.run_machine()
        self.assertEqual(self.write_byte()[0], DONE)
        self.fill()
        # What SQLite's WAL has room for still passes.
        wait_for(lambda: self.fill() or self.write_byte()[0] == REJECTED, "a refusal")
        self.check_refused("full|disk|space")
        done = self.writes()
        (self.state / "filler").unlink()
        self.check_works_again()
        self.assertEqual(self.writes(), done + 1)

    def test_a_journal_that_cannot_be_written_refuses_changes_only_and_recovers(self):
        self.run_machine()
        code, first = self.write_byte()
        self.assertEqual(code, DONE, first)
        self.running_bridge.terminate()
        self.running_bridge.wait(20)
        self.mount("-o", "remount,ro")
        self.bridge(self.config)
        self.check_refused("Read-only file system")
        code, outcome = self.outcome("outcome", first["id"])
        self.assertEqual((code, outcome["outcome"]), (DONE, "succeeded"), "what the file holds is still answered")
        self.mount("-o", "remount,rw")
        self.check_works_again()


class StalledDisk(JournalMachine):
    """fsync and fdatasync do not return while a file exists."""

    def mount(self, *options):
        pass  # no file system of its own

    def bridge(self, config, **options):
        self.stalls = self.folder / "stalls"
        library = BIN.parent / "campaign" / "axlecast_stalled_disk.so"
        return super().bridge(config, env={"LD_PRELOAD": str(library), "AXLECAST_DISK_STALLS": str(self.stalls)})

    def test_a_disk_that_does_not_answer_holds_up_neither_stops_nor_reads(self):
        self.run_machine()
        self.assertEqual(self.write_byte()[0], DONE)
        self.stalls.touch()
        # All of this happens while the disk does not answer. The first write finds it out.
        code, outcome = self.write_byte()
        self.assertEqual((code, outcome["reason"]), (REJECTED, "journal"), outcome)
        self.check_refused("its disk has not answered for")
        done = self.writes()
        self.stalls.unlink()
        self.check_works_again()
        self.assertEqual(self.writes(), done + 1, "what was refused is not done later")


class Second(Bridge):
    """A second bridge with the same journal, and a second driver on the same line."""

    def test_a_second_bridge_does_not_get_the_journal_and_says_who_has_it(self):
        journal = self.folder / "journal.db"
        text = one_axis("{start_deg: 100}").replace("unsigned_commands: allow", f"unsigned_commands: allow, journal: {journal}")
        self.assertIn("journal:", text)
        first = self.bridge(self.write(text))
        wait_for(lambda: "serving commands" in self.log("bridge"), "the first bridge serves")
        other = self.write("lcm: {prefix: other/}\n" + text, "other.yaml")
        second = self.bridge(other, name="second")
        self.assertEqual(second.wait(LIMIT), 1)
        self.assertRegex(self.log("second"), rf"journal of another bridge, which runs: .*process {first.pid};")
        self.kill(first)
        self.bridge(other, name="third")
        wait_for(lambda: "serving commands" in self.log("third"), "a killed bridge's lock has gone with it")

    def test_a_second_driver_publishes_nothing_and_ends_with_the_reason(self):
        config = self.write(one_axis("{start_deg: 100}"))
        self.data = self.watch(config)
        self.simulator(config, "rs485-0")
        first = self.driver(config, "rs485-0")
        self.wait_online(self.data)
        boots = {self.position()["boot_id"]}
        second = self.driver(config, "rs485-0", name="second")
        self.assertEqual(second.wait(LIMIT), 1)
        self.assertIn(f"process {first.pid}); this driver ends and leaves bus rs485-0 to it", self.log("second"))
        mark = self.data.mark()
        wait_for(lambda: self.data.of("POSITION/axis1", since=mark)[20:], "positions of the first")
        self.assertEqual({m["boot_id"] for m in self.data.since(0) if "boot_id" in m and m["channel"].endswith("axis1")},
                         boots)


class Away(Bridge):
    """What the bridge remembers while everything is off."""

    def start_all(self, family):
        self.running = [self.simulator(self.config, "rs485-0"), self.driver(self.config, "rs485-0", family=family),
                        self.bridge(self.config)]
        mark = self.data.mark()
        wait_for(lambda: any(m["state"] == 1 for m in self.data.of("DEVICE/axis1", since=mark)), "axis1 online")
        wait_for(lambda: self.log("bridge").count("serving commands") >= self.starts, "the bridge serves")

    def run_machine(self, text, family):
        self.starts, self.family = 1, family
        self.config = self.write(text)
        self.data = self.watch(self.config)
        self.start_all(family)
        wait_for(self.position, "a position")

    def lose_power(self, old, new):
        """kill -9 of everything, and an encoder that is another, or elsewhere, when it comes back."""
        for process in self.running:
            self.kill(process)
        for place in self.run_dir.glob("**/rs485-0.*"):
            place.unlink()
        self.write(self.config.read_text().replace(old, new))
        self.starts += 1
        self.start_all(self.family)

    def datum(self):
        return self.lines("datum", "show", "axis1")[0]["datum"]

    def events(self, kind):
        return [line for line in self.lines("history", "--events", "--limit", "0") if line.get("event") == kind]

    def home(self, value):
        code, outcome = self.outcome("home", "axis1", "--value", value, "--yes")
        self.assertIn(code, (DONE, NOT_VERIFIED), outcome)
        return self.datum()

    def test_a_datum_outlives_a_power_failure_and_undo_goes_back(self):
        self.run_machine(one_axis("{start_deg: 100}"), "tformat")
        first = self.home(12.5)
        second = self.home(200)
        self.assertNotEqual(first["counts"], second["counts"])
        self.lose_power("start_deg: 100", "start_deg: 130")
        self.assertEqual(self.datum(), second)
        wait_for(lambda: self.position()["flags"] & REFERENCED and abs(self.position()["value"] - 230) < 0.1,
                 lambda: f"230 deg, referenced: {self.position()}")
        moved = wait_for(lambda: self.events("moved_while_away"), "the event")
        self.assertRegex(moved[-1]["text"], r"moved by 0\.0833 turns")
        code, outcome = self.outcome("do", "axis1", "undo_datum", "--yes")
        self.assertIn(code, (DONE, NOT_VERIFIED), outcome)
        self.assertEqual(self.datum()["counts"], first["counts"])
        wait_for(lambda: abs(self.position()["value"] - 42.5) < 0.1, lambda: f"42.5 deg: {self.position()}")

    def test_another_encoder_does_not_get_the_datum_of_the_old_one(self):
        self.run_machine("""machine: test
bridge: {unsigned_commands: allow}
buses:
  rs485-0:
    family: saa_can
    link: {bitrate: 500000}
    simulate:
      axis1: {start_deg: 100, serial: 4711}
    devices:
      axis1: {model: cia406, node: 0x05, bits: 13, turn_bits: 12, period_ms: 10, unit: deg, limits: {speed_rpm: 1000}, permit: not_required}
""", "saa-can")
        datum = self.home(12.5)
        wait_for(lambda: self.position()["flags"] & REFERENCED, "referenced")
        self.lose_power("serial: 4711", "serial: 4712")
        wait_for(lambda: "encoder_exchanged" in self.alarms(self.data, "bridge"), lambda: self.alarms(self.data, "bridge"))
        mark = self.data.mark()
        fresh = wait_for(lambda: self.data.of("POSITION/axis1", since=mark)[20:], "positions")
        self.assertEqual([m for m in fresh if m["flags"] & REFERENCED], [])
        self.assertEqual(self.datum()["counts"], datum["counts"])  # kept: the old one may come back
        exchanged = wait_for(lambda: self.events("encoder_exchanged"), "the event")
        self.assertRegex(exchanged[-1]["text"], "4712")
        code, outcome = self.outcome("do", "axis1", "accept_exchange", "--yes")
        self.assertIn(code, (DONE, NOT_VERIFIED), outcome)
        wait_for(lambda: "encoder_exchanged" not in self.alarms(self.data, "bridge"), "the alarm gone")
        self.assertIsNone(self.datum())


if __name__ == "__main__":
    unittest.main(verbosity=2)
