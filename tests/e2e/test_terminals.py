"""A driver leaves every terminal alone that is not its line, also one that got the number of a killed simulator's."""

import os
import pty
import select
import termios
import unittest

from machine import Machine, one_axis, wait_for


class Terminals(Machine):
    def take_number(self, path):
        """A terminal with this name: the kernel gives the lowest free number, so that the tries are few."""
        def once():
            ends = []
            try:
                while len(ends) < 20:
                    ends.append(pty.openpty())
                    if os.ttyname(ends[-1][1]) == path:
                        return ends.pop()
                return None
            finally:
                for main, terminal in ends:
                    os.close(main)
                    os.close(terminal)
        main, terminal = wait_for(once, f"a terminal that is {path}")
        self.addCleanup(os.close, main)
        self.addCleanup(os.close, terminal)
        return main, terminal

    def refusal(self, text):
        """The driver's reason, as its bus reports it."""
        return text in (self.data.last("BUS/rs485-0") or {}).get("last_error", "")

    def test_a_terminal_with_the_number_of_a_killed_simulator(self):
        config = self.write(one_axis())
        self.data = self.watch(config)
        simulator = self.simulator(config, "rs485-0")
        self.driver(config, "rs485-0")
        self.wait_online(self.data)
        number = os.readlink(next(self.run_dir.glob("**/rs485-0.pty")))
        self.kill(simulator)
        main, terminal = self.take_number(number)
        before = termios.tcgetattr(terminal)
        wait_for(lambda: self.refusal("that no simulator of ours made") or termios.tcgetattr(terminal) != before,
                 lambda: f"the driver's reason, not {self.data.last('BUS/rs485-0')}")
        self.assertEqual(termios.tcgetattr(terminal), before, "nobody set it up")
        self.assertEqual(select.select([main], [], [], 0)[0], [], "nobody wrote into it")
        self.simulator(config, "rs485-0")
        mark = self.data.mark()
        wait_for(lambda: any(m["state"] == 1 for m in self.data.of("DEVICE/axis1", since=mark)), "online again")

    def test_a_pty_of_another_program_is_taken_by_a_statement_alone(self):
        main, terminal = pty.openpty()
        self.addCleanup(os.close, main)
        self.addCleanup(os.close, terminal)
        before = termios.tcgetattr(terminal)
        text = f"""machine: test
buses:
  rs485-0:
    family: tformat
    link: {{port: {os.ttyname(terminal)}PTY}}
    devices: {{axis1: {{model: ts5669n127, unit: deg, publish_hz: 200}}}}
"""
        config = self.write(text.replace("PTY", ""))
        self.data = self.watch(config)
        driver = self.driver(config, "rs485-0")
        wait_for(lambda: self.refusal("`pty: true`"), lambda: f"the reason, not {self.data.last('BUS/rs485-0')}")
        self.assertEqual(termios.tcgetattr(terminal), before)
        self.kill(driver)
        self.driver(self.write(text.replace("PTY", ", pty: true"), "allowed.yaml"), "rs485-0")
        wait_for(lambda: select.select([main], [], [], 0)[0], "a request of the driver")


if __name__ == "__main__":
    unittest.main(verbosity=2)
