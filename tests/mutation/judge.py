"""Runs the tests against each mutant: which cases reach it, and whether one of them fails."""

import concurrent.futures
import math
import os
import pathlib
import resource
import subprocess
import tempfile

TOP = pathlib.Path(__file__).resolve().parents[2]
IN_NAMESPACE = ("platform_multicast_test",)  # these programs need a network of their own
# Cases of more than a second, which repeat what others do thousands or millions of times. They would take most of the time.
SLOW = {
    "runtime_axis_test": "AxisTest.*WalkOfMillions*",
    "bridge_dispatch_test": "DispatcherTest.ManyLaterCommandsDoNot*:DispatcherStallTest.WhatWaitsIsBounded",
    "family_saa_serial_test": "SaaStreamDamage.A*:SaaStreamDamage.UpTo*:SaaStreamParser.KeepsItsPromisesOnEveryLookAlike",
}
PROCESSES = 2
SANITIZER = "detect_leaks=0:hard_rss_limit_mb=2000:allocator_may_return_null=1"
FILE = 1 << 28
WAITING = 30  # s


def limited(seconds):
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE, resource.RLIM_INFINITY))  # the tests have limits of their own
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def run(program, arguments, seconds, **variables):
    """The exit status, None after the time limit, and the output. `seconds`: of the processor. A host that is busy with other work
    kills no mutant; a mutant that waits for ever is killed after much longer."""
    seconds = math.ceil(seconds)
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)  # a test becomes another user
        environment = {**os.environ, **variables, "ASAN_OPTIONS": SANITIZER, "TEST_TMPDIR": folder + "/", "TMPDIR": folder}
        with tempfile.TemporaryFile() as output:
            process = subprocess.Popen([*program, *arguments], env=environment, cwd=folder, stdin=subprocess.DEVNULL, stdout=output,
                                       stderr=subprocess.STDOUT, preexec_fn=lambda: limited(seconds), start_new_session=True)
            try:
                status = process.wait(WAITING + 20 * seconds)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, 9)
                process.wait()
                status = None
            output.seek(0)
            return status, output.read().decode(errors="replace")


def parts(cases, ms):
    """The quick cases first, which kill most mutants; then parts of about one second."""
    part, begun = [], 0
    for case in cases:
        if part and (len(part) == 20 if begun == 0 else sum(ms[c] for c in part) > 1000):
            yield part
            part, begun = [], begun + 1
        part.append(case)
    if part:
        yield part


class Cases:
    """The cases of a test program: how long each takes, and which mutants it reaches."""

    def __init__(self, program):
        self.program, self.ms, self.reached_by = [str(program)], {}, {}
        if program.name in IN_NAMESPACE:
            self.program.insert(0, str(TOP / "tests" / "e2e" / "in_namespace.sh"))
        path = pathlib.Path(f"{program}.reached")
        status, output = run(self.program, ["--gtest_brief=1"], 600, AXLECAST_MUTANTS_REACHED=str(path),
                             GTEST_FILTER="-" + SLOW.get(program.name, ""))
        if status != 0:
            raise SystemExit(f"{program} fails without a mutant:\n{output[-3000:]}")
        for line in path.read_text(encoding="utf-8").splitlines():
            name, ms, *numbers = line.split(" ")
            if not name.endswith("*"):
                self.ms[name] = int(ms)
            for number in numbers:
                self.reached_by.setdefault(int(number), set()).add(name)
        if not self.ms:
            raise SystemExit(f"{program} has no cases")

    def of(self, number):
        """The cases that reach a mutant, in the order of the program."""
        names = self.reached_by.get(number, set())
        suites = {name[:-1] for name in names if name.endswith("*")}
        return [case for case in self.ms if "" in suites or case in names or case[:case.index(".") + 1] in suites]

    def kill(self, number):
        """True if a case fails, crashes or does not end in time."""
        cases = self.of(number)
        if not cases:
            return False
        for part in parts(sorted(cases, key=self.ms.get), self.ms):
            seconds = 2 + 10 * sum(self.ms[case] for case in part) / 1000
            status, _ = run(self.program, ["--gtest_brief=1", "--gtest_fail_fast"], seconds, AXLECAST_MUTANT=str(number),
                            GTEST_FILTER=":".join(part))
            if status != 0:
                return True
        return False


def survivors(programs, mutants):
    """Yields the mutants that no case of the programs kills."""
    tested = [Cases(program) for program in programs]

    def survives(mutant):
        return not any(cases.kill(mutant.number) for cases in tested)

    with concurrent.futures.ThreadPoolExecutor(PROCESSES) as pool:
        for mutant, alive in zip(mutants, pool.map(survives, mutants)):
            if alive:
                yield mutant
