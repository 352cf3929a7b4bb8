"""`axlecast replay`, received by stock lcm-logger and by the wire protocol itself; its keys on a real terminal."""

import fcntl
import hashlib
import json
import os
import pathlib
import pty
import signal
import struct
import subprocess
import termios
import unittest

import lcm_log
from lcm_ear import LcmEar
from machine import BIN, LIMIT, Machine, one_axis, wait_for

DATA_URL = "udpm://239.255.76.67:7667?ttl=0"


def content(messages):
    """A hash of channels and data, in order."""
    digest = hashlib.sha256()
    for channel, data in messages:
        digest.update(struct.pack(">II", len(channel), len(data)) + channel.encode() + data)
    return digest.hexdigest()


def ramp(count, step_us=1000, size=lambda i: i % 900):
    """Events of three channels; every one of another content."""
    return [(i * step_us, f"TEST/{i % 3}", struct.pack(">I", i) + bytes((i + k) & 255 for k in range(size(i))))
            for i in range(count)]


def heard_of(events):
    return [(channel, data) for _, channel, data in events]


class Replay(Machine):
    def setUp(self):
        super().setUp()
        self.ear = LcmEar()

    def write_log(self, events, name="test.log"):
        return lcm_log.write(self.folder / name, events)

    def replay(self, *words):
        """Runs it to its end: exit code, summary, standard error."""
        code, out, err = self.axlecast("replay", *words, "--url", DATA_URL, "--json")
        return code, json.loads(out) if out else None, err

    def heard(self, count):
        """What was received, when the number of messages is reached; and no more come."""
        wait_for(lambda: len(self.ear.messages) >= count, lambda: f"{count} messages, {len(self.ear.messages)} came")
        return self.ear.messages


class Content(Replay):
    def test_stock_logger_records_what_the_log_holds(self):
        """lcm-logger loses messages when they pile up, which a busy machine makes them do: it gets several chances to
        hear all. Whatever it hears is in order and unchanged."""
        events = ramp(400, 3000) + [(1_300_000, "LARGE", os.urandom(100_000)), (1_400_000, "LAST", b"")]
        log = self.write_log(events)
        for attempt in range(5):
            stock = self.folder / f"stock{attempt}.log"
            logger = self.start("lcm-logger", "lcm-logger", "-q", f"--lcm-url={DATA_URL}", stock)
            wait_for(lambda: len(self.listening()) >= 2, "lcm-logger in the group")
            code, summary, err = self.replay(log)
            self.assertEqual((code, summary["played"]), (0, len(events)), err)
            wait_for(lambda: "LAST" in self.ear.channels() and not any(self.listening()), "all to be heard")
            self.ear.messages.clear()
            logger.send_signal(signal.SIGINT)
            logger.wait(20)
            recorded = [message for message in lcm_log.events(stock) if message[0] != "LCM_SELF_TEST"]
            rest = iter(heard_of(events))
            strange = [(channel, len(data)) for channel, data in recorded if (channel, data) not in rest]
            self.assertEqual(strange, [], "in order, unchanged")
            if content(recorded) == content(heard_of(events)):
                return
        self.fail("lcm-logger never heard all of it")

    def listening(self):
        """Of each socket that listens on the port, how many bytes it has not read."""
        rows = [line.split() for line in pathlib.Path("/proc/net/udp").read_text().splitlines()[1:]]
        return [int(row[4].split(":")[1], 16) for row in rows if row[1].endswith(f":{7667:04X}")]

    def test_full_speed_loses_and_changes_nothing(self):
        events = ramp(20_000, 1000, lambda i: i % 200)
        code, summary, err = self.replay(self.write_log(events), "--speed", 0)
        self.assertEqual(code, 0, err)
        self.assertEqual(content(self.heard(len(events))), content(heard_of(events)))
        self.assertEqual((summary["played"], summary["unsent"], summary["ended"]), (len(events), 0, "end"))
        self.assertLess(summary["seconds"], 15, "a log of 20 s")

    def test_speed_is_kept(self):
        code, summary, err = self.replay(self.write_log(ramp(2001)), "--speed", 4)
        self.assertEqual(code, 0, err)
        self.assertGreaterEqual(summary["seconds"], 0.499)
        self.assertLess(summary["seconds"], 2, "the time that it took to record")

    def test_logs_are_merged_by_time(self):
        one = self.write_log([(0, "A", b"0"), (40_000, "A", b"4"), (40_000, "A", b"5")], "one.log")
        other = self.write_log([(10_000, "B", b"1"), (20_000, "B", b"2"), (40_000, "B", b"6")], "other.log")
        code, _, err = self.replay(one, other)
        self.assertEqual(code, 0, err)
        self.assertEqual(b"".join(data for _, data in self.heard(6)), b"012456")

    def test_part_of_a_log_under_other_names(self):
        log = self.write_log([(i * 1_000_000, f"POSITION/axis{i % 2}", bytes([i])) for i in range(20)])
        code, summary, err = self.replay(log, "--speed", 0, "--from", "4", "--until=-2", "--channel", "1$",
                                         "--rename", "axis([01])=joint$1", "--prefix", "old/")
        self.assertEqual(code, 0, err)
        self.assertEqual(self.heard(6), [("old/POSITION/joint1", bytes([i])) for i in range(5, 17, 2)])
        self.assertEqual(summary["played"], 6)
        self.ear.messages.clear()
        code, _, _ = self.replay(log, "--speed", 0, "--start-event", 18, "--channel", "1$", "--invert")
        self.assertEqual((code, self.heard(1)), (0, [("POSITION/axis0", bytes([18]))]))

    def test_damage_is_skipped_and_told(self):
        events = ramp(60)
        log = self.write_log(events)
        whole = log.read_bytes()
        at = whole.index(lcm_log.record(1_790_000_000_000_000 + 30_000, "TEST/0", events[30][2], 30))
        log.write_bytes(whole[:at] + b"\xff" * 10 + whole[at + 10:] + b"\xed\xa1")
        code, summary, err = self.replay(log, "--speed", 0)
        self.assertEqual(code, 3, err)
        self.assertEqual(self.heard(59), heard_of(events[:30] + events[31:]))
        self.assertEqual((summary["damaged_regions"], summary["played"]), (2, 59))
        self.assertIn("2 damaged regions", err)

    def test_a_log_that_is_cut_ends_its_replay(self):
        events = ramp(20_000)
        log = self.write_log(events)
        replay = self.start("replay", BIN / "axlecast", "replay", log, "--json", "--url", DATA_URL)
        self.heard(10)
        os.truncate(log, 0)
        self.assertEqual(replay.wait(LIMIT), 3, self.log("replay"))
        self.assertIn("was made shorter while it was read", self.log("replay"))
        self.assertIn('"ended":"lost"', self.log("replay"))
        heard = list(self.ear.messages)
        self.assertLess(len(heard), len(events))
        self.assertEqual(heard, heard_of(events)[:len(heard)])

    def test_loop_ends_by_sigterm_with_exit_code_0(self):
        log = self.write_log(ramp(10))
        replay = subprocess.Popen([BIN / "axlecast", "replay", log, "--loop", "--json", "--url", DATA_URL],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.processes.append(replay)
        heard = self.heard(45)[:45]
        replay.terminate()
        out, err = replay.communicate(timeout=LIMIT)
        self.assertEqual(replay.returncode, 0, err)
        summary = json.loads(out)
        self.assertGreaterEqual(summary["rounds"], 4)
        self.assertEqual(summary["ended"], "stopped")
        self.assertEqual(heard, (heard_of(ramp(10)) * 5)[:45])


class Refusal(Replay):
    def test_bad_words_are_refused_with_their_cause(self):
        log = self.write_log(ramp(3))
        for words, cause in ((("--channel", "(x"), "is no regular expression"), (("--rename", "["), "is not OLD=NEW"),
                             (("--rename", "[=x"), "is no regular expression"), (("--from", "noon"), "is not a time"),
                             (("--speed", "-1"), "--speed"), (("--allow-commands",), "--yes-allow-commands"),
                             (("--yes-allow-live",), "--allow-live"), (("--invert",), "--channel")):
            code, summary, err = self.replay(log, *words)
            self.assertEqual((code, summary), (2, None), words)
            self.assertIn(cause, err)
        self.assertEqual(self.ear.messages, [])

    def test_what_cannot_be_played_is_told(self):
        log = self.write_log(ramp(3))
        empty = self.folder / "empty.log"
        empty.touch()
        for words, cause in (((self.folder / "none.log",), "No such file"), (("/etc/passwd",), "no event of LCM's format"),
                             ((empty,), "no event"), ((log, "--from", 100), "its selected part, contains no event"),
                             ((log, "--channel", "none"), "of the selected channels"), ((self.folder,), str(self.folder))):
            code, _, err = self.replay(*words)
            self.assertEqual(code, 1, words)
            self.assertIn(cause, err)
        self.assertEqual(self.ear.messages, [])

    def test_commands_and_permits_are_held_back_unless_allowed_twice(self):
        commands = LcmEar(port=7668)
        names = ["COMMAND", "COMMAND_STATUS", "PERMIT/axis1", "DRIVER_COMMAND/rs485-0", "DRIVER_STATUS/rs485-0"]
        log = self.write_log([(i, name, b"x") for i, name in enumerate(["POSITION/axis1", *names])])
        code, summary, err = self.replay(log)
        self.assertEqual((code, summary["held_back"], summary["played"]), (0, 5, 1), err)
        self.assertIn("held back: 5", err)
        self.assertEqual(self.heard(1), [("POSITION/axis1", b"x")])
        code, summary, err = self.replay(log, "--allow-commands", "--yes-allow-commands")
        self.assertEqual((code, summary["held_back"], summary["played"]), (0, 0, 6), err)
        wait_for(lambda: len(commands.messages) >= 5, "commands on their port")
        self.assertEqual(commands.channels(), names)
        self.assertEqual([channel for channel, _ in self.heard(2)], ["POSITION/axis1"] * 2)
        code, _, _ = self.replay(log, "--rename", "POSITION/axis1=COMMAND", "--channel", "POSITION")
        self.assertEqual(code, 1)

    def test_a_live_machine_is_not_played_to_unless_allowed_twice(self):
        config = self.write(one_axis())
        watch = self.watch(config)
        self.simulator(config, "rs485-0")
        self.driver(config, "rs485-0")
        self.wait_online(watch)
        log = self.write_log(ramp(3))
        code, summary, err = self.replay(log)
        self.assertEqual((code, summary), (1, None), err)
        for heard in ("refused: a machine is live", "BUS/rs485-0", "POSITION/axis1", "--yes-allow-live"):
            self.assertIn(heard, err)
        self.assertNotIn("TEST/0", self.ear.channels())
        code, summary, err = self.replay(log, "--allow-live", "--yes-allow-live")
        self.assertEqual((code, summary["played"]), (0, 3), err)
        wait_for(lambda: self.ear.channels().count("TEST/0") == 1, "the log beside the machine")


class Keys(Replay):
    """On a terminal of its own, as a shell starts it."""

    def begin(self, log, *words):
        self.master, slave = pty.openpty()
        self.addCleanup(os.close, self.master)
        self.before = termios.tcgetattr(slave)

        def take_terminal():
            os.setsid()
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)
        # /dev/tty is the terminal of the session's leader.
        process = subprocess.Popen([BIN / "axlecast", "replay", log, "--url", DATA_URL, *map(str, words)], stdin=slave,
                                   stdout=slave, stderr=slave, preexec_fn=take_terminal)
        self.processes.append(process)
        self.slave = slave
        self.addCleanup(os.close, slave)
        self.screen = b""
        wait_for(lambda: self.sees(b"space pause") and not self.echoes(), lambda: self.screen)
        return process

    def sees(self, text):
        os.set_blocking(self.master, False)
        try:
            self.screen += os.read(self.master, 65536)
        except BlockingIOError:
            pass
        return text in self.screen

    def shows(self, text):
        """Waits for `text`: what a process wrote last can reach the master of a pty after the process has ended."""
        wait_for(lambda: self.sees(text), lambda: self.screen)

    def echoes(self):
        return bool(termios.tcgetattr(self.slave)[3] & termios.ECHO)

    def press(self, keys):
        os.write(self.master, keys)

    def ended(self, process, code):
        wait_for(lambda: self.sees(b"\0") or process.poll() is not None, lambda: self.screen)
        self.assertEqual(process.returncode, code, self.screen)
        self.assertEqual(termios.tcgetattr(self.slave), self.before, "the terminal as it was")

    def test_space_steps_arrows_and_quit(self):
        log = self.write_log([(i * 1_000_000, "TEST", bytes([i])) for i in range(100)])
        replay = self.begin(log, "--paused")
        wait_for(lambda: self.sees(b"paused"), lambda: self.screen)
        seen = lambda: [data[0] for _, data in self.ear.messages]
        for keys, expected in ((b"s", [0]), (b".", [0, 1]), (b"\x1b[A", None), (b"s", [0, 1, 11]),
                               (b"\x1b[C\x1b[C", None), (b"s", [0, 1, 11, 13]), (b"\x1b[B\x1b[D", None),
                               (b"s", [0, 1, 11, 13, 2])):
            self.press(keys)
            if expected:
                wait_for(lambda: seen() == expected, lambda: f"{expected}, came {seen()}")
        self.press(b"++++++++++ ")  # 1,024 times as fast: 97 s
        self.ended(replay, 0)
        self.assertEqual(seen()[5:], list(range(3, 100)))
        self.shows(b"x1024")

    def test_quit_leaves_the_rest_unplayed(self):
        replay = self.begin(self.write_log([(0, "A", b""), (1_000_000_000, "B", b"")]))
        self.heard(1)
        self.press(b"q")
        self.ended(replay, 0)
        self.shows(b"then stopped")

    def test_a_log_that_is_cut_ends_its_replay_and_restores_the_terminal(self):
        log = self.write_log(ramp(20_000))
        replay = self.begin(log, "--paused")
        wait_for(lambda: self.sees(b"paused"), lambda: self.screen)
        os.truncate(log, 0)
        self.press(b"\x1b[C ")  # looks for a place in what was cut off
        self.ended(replay, 3)
        self.shows(b"was made shorter while it was read")

    def test_the_terminal_is_restored_however_it_ends(self):
        log = self.write_log([(0, "A", b""), (1_000_000_000, "B", b"")])
        for number, code in ((signal.SIGTERM, 0), (signal.SIGINT, 0), (signal.SIGQUIT, -signal.SIGQUIT),
                             (signal.SIGHUP, -signal.SIGHUP), (signal.SIGABRT, -signal.SIGABRT)):
            replay = self.begin(log)
            replay.send_signal(number)
            self.ended(replay, code)

    def test_the_terminal_is_the_shells_while_it_is_stopped(self):
        replay = self.begin(self.write_log([(0, "A", b""), (1_000_000_000, "B", b"")]))
        state = lambda: pathlib.Path(f"/proc/{replay.pid}/stat").read_text().split()[2]
        for _ in range(2):
            # The kernel stops no process group without a shell above it: the signal is what Ctrl-Z sends.
            replay.send_signal(signal.SIGTSTP)
            wait_for(lambda: self.echoes() or state() == "T", "it to stop or to give the terminal back")
            self.assertTrue(self.echoes())
            replay.send_signal(signal.SIGCONT)
            wait_for(lambda: not self.echoes(), "the keys again")
        self.press(b"q")
        self.ended(replay, 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
