"""`axlecast doctor`: its command line, its documentation, and that no check is without a test that creates its
condition. The conditions are in test_doctor_*.py, and in tests/vm/guest/test_doctor.py those of CAN and the clock."""

import ast
import json
import os
import pathlib
import pty
import re
import subprocess
import unittest

from doctor_machine import DoctorMachine
from machine import BIN

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])


def test_names():
    names = []
    for file in [*SOURCE.glob("tests/e2e/test_doctor_*.py"), SOURCE / "tests/vm/guest/test_doctor.py"]:
        names += [node.name for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.FunctionDef)]
    return names


class Doctor(DoctorMachine):
    def checks(self):
        code, out, err = self.axlecast("doctor", "--list", "--json")
        self.assertEqual(code, 0, err)
        return json.loads(out)["checks"]

    def test_every_check_has_a_test_that_creates_its_condition(self):
        names = [check["name"] for check in self.checks()]
        self.assertGreater(len(names), 30)
        self.assertEqual([name for name in names if f"test_{name}" not in test_names()], [])

    def test_every_check_is_documented_with_its_effect(self):
        page = (SOURCE / "docs/doctor.md").read_text()
        rows = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", page, re.MULTILINE))
        checks = {check["name"]: f"{check['severity']} | {check['looks_at']} | {check['effect']}" for check in self.checks()}
        self.assertEqual(list(rows), list(checks))
        for name, text in checks.items():
            self.assertTrue(rows[name].startswith(text + " | ") and rows[name] != text + " | ", (name, rows[name], text))

    def test_the_list_for_people_has_a_line_for_each(self):
        code, out, _ = self.axlecast("doctor", "--list")
        self.assertEqual((code, [line.split()[0] for line in out.splitlines()]),
                         (0, [check["name"] for check in self.checks()]))

    def test_a_simulated_machine_on_a_good_host_is_told_nothing(self):
        """But of what is this host's own: its clock, its network's buffers, which a container cannot change, and its liblcm,
        which no release mends."""
        code, out, err = self.axlecast("doctor", self.machine(), "--skip", "clock_sync,journal_file_system,journal_space,lcm_library")
        facts = ["udpm://239.255.76.67:7667?ttl=0 uses lo", "udpm://239.255.76.67:7668?ttl=0 uses lo"]
        self.assertEqual((code, out.splitlines()[:2]), (0, facts), err)
        self.assertEqual([line[:13] for line in out.splitlines()[2:]], ["UNIX time is "], out)

    def test_what_is_found_is_told_with_effect_and_line(self):
        subprocess.run(["ip", "route", "del", "224.0.0.0/4", "dev", "lo"], check=True)
        code, out, _ = self.axlecast("doctor", self.machine(), "--only", "multicast_route,port_missing")
        self.assertEqual(code, 1)
        self.assertIn("error multicast_route: there is no route", out)
        self.assertIn("No process of the machine starts", out)
        self.assertIn("\n    ip route replace 224.0.0.0/4 dev lo\n", out)
        self.assertTrue(out.endswith("\n1 error\n"), out)

    def test_fix_asks_and_a_no_changes_nothing(self):
        subprocess.run(["ip", "route", "del", "224.0.0.0/4", "dev", "lo"], check=True)
        words = [BIN / "axlecast", "doctor", self.machine(), "--only", "multicast_route", "--fix"]
        for answer, code in (("n\n", 1), ("y\n", 0)):
            master, line = pty.openpty()
            os.write(master, answer.encode())
            done = subprocess.run(words, stdin=line, capture_output=True, text=True, timeout=60, check=False)
            os.close(line)
            os.close(master)
            self.assertEqual(done.returncode, code, done.stdout + done.stderr)
            self.assertIn("Do it?", done.stderr)
        self.assertIn("done: ip route replace 224.0.0.0/4 dev lo\n", done.stdout)

    def test_fix_without_a_terminal_wants_yes(self):
        subprocess.run(["ip", "route", "del", "224.0.0.0/4", "dev", "lo"], check=True)
        code, _, err = self.axlecast("doctor", self.machine(), "--only", "multicast_route", "--fix")
        self.assertEqual(code, 2)
        self.assertIn("--yes", err)

    def test_a_line_that_fails_is_told_and_the_finding_stays(self):
        self.need_users()
        self.put("proc/sys/net/core/rmem_max", 1).chmod(0o444)
        (self.root / "etc").write_text("no folder")
        config = self.machine(rest='lcm: {url: "udpm://239.255.76.67:7667?recv_buf_size=2097152"}')
        done = subprocess.run([self.program, "doctor", config, "--only", "receive_buffer_max", "--root", self.root,
                               "--fix", "--yes"], capture_output=True, text=True, timeout=60, check=False,
                              preexec_fn=lambda: os.setuid(65534))
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn("not done: ", done.stderr)
        self.assertIn("receive_buffer_max", done.stdout)

    def test_checks_may_be_named_before_the_file(self):
        code, told = self.doctor("--only", "key_missing,port_missing", "--skip", "key_missing", self.on_port("/dev/none"))
        self.assertEqual((code, [finding["name"] for finding in told["findings"]]), (1, ["port_missing"]))

    def test_a_misspelt_check_is_refused(self):
        code, _, err = self.axlecast("doctor", "--only", "multicast_rout")
        self.assertEqual(code, 2)
        self.assertIn("did you mean 'multicast_route'?", err)

    def test_a_file_with_mistakes_is_refused_with_them(self):
        code, _, err = self.axlecast("doctor", self.write("machine: test\nbuses: {a: {family: nonsense}}\n"))
        self.assertEqual(code, 1)
        self.assertIn("nonsense", err)

    def test_without_a_file_the_host_alone_is_looked_at(self):
        done = subprocess.run([BIN / "axlecast", "doctor", "--json", "--only", "multicast_route,key_missing,log_space"],
                              cwd=self.folder, capture_output=True, text=True, timeout=60, check=False)
        told = json.loads(done.stdout)
        self.assertEqual((done.returncode, told["file"], told["findings"]), (0, None, []))


if __name__ == "__main__":
    unittest.main()
