"""Compiles commands.pml with spin and gcc, and runs the verifier."""

import pathlib
import re
import shutil
import subprocess
import sys
import time

SOURCES = pathlib.Path(__file__).resolve().parent
MAX_MEMORY_MB = 3000


# How spin prints the assertions of the model, and what each states.
BREACHES = [
    ("(((effects[c]<=1)&&", "an outcome that contradicts the effect"),
    ("(effects[c]<=1)", "a second effect"),
    ("(((journal[c]==3)||", "an effect although the outcome states that nothing was done"),
    ("( !(((journal[c]==0)||", "a second outcome"),
    ("(((journal[0]==0)||", "a run that ends without an outcome"),
]


class Verifier:
    """A search of the model with these parameters. `folder`: for its files. `options`: of the compilation of the verifier."""

    def __init__(self, folder, parameters, options):
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True)
        for source in SOURCES.glob("*.pml"):
            shutil.copy(source, self.folder)
        self._run(["spin", "-a", *(f"-D{parameter}" for parameter in parameters), "commands.pml"])
        # No partial order reduction: the processes of the model share all their variables.
        self._run(["gcc", "-w", "-DNOREDUCE", f"-DMEMLIM={MAX_MEMORY_MB}", *options, "-o", "pan", "pan.c"])

    def _run(self, command):
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"{' '.join(map(str, command))}:\n{done.stdout}{done.stderr}")

    def search(self, *arguments):
        return Result(self.folder, arguments)


class Result:
    """What the verifier has printed. `errors`: counter-examples."""

    def __init__(self, folder, arguments):
        self.folder = folder
        start = time.monotonic()
        self.text = subprocess.run([folder / "pan", "-m1000000", *arguments], cwd=folder, capture_output=True, text=True,
                                   check=False).stdout
        self.seconds = time.monotonic() - start
        self.errors = self._number(r"errors: (\d+)")
        self.states = self._number(r"(\d+) states, stored")
        self.memory_mb = self._number(r"(\d+)\.\d+\s+total actual memory usage")
        incomplete = r"Search not completed|max search depth too small|out of memory|memory limit|hash ?table full"
        self.complete = not re.search(incomplete, self.text)

    def _number(self, pattern):
        found = re.findall(pattern, self.text)
        return int(found[-1]) if found else -1

    def unreached(self):
        """The lines of the model that no run has reached."""
        return re.findall(r"^\t\S*commands\.pml:\d+, state \d+, .*$", self.text, re.MULTILINE)

    def breach(self):
        """What the counter-example breaks; None if the search has not ended by a breach of a property of the model."""
        if "non-progress cycle (at depth" in self.text:
            return "an endless run without a fault"
        return next((name for form, name in BREACHES if f"assertion violated {form}" in self.text), None)

    def counter_example(self):
        """The steps of the counter-example: the process, its command if it has one, and what the model's comment calls the step. The
        last one is the breach. Empty if there is none."""
        if self.breach() is None:
            return []
        replay = subprocess.run([self.folder / "pan", "-r"], cwd=self.folder, capture_output=True, text=True, check=False).stdout
        model = (SOURCES / "commands.pml").read_text(encoding="ascii").splitlines()
        steps = []
        for process, name, line in re.findall(r"^ *\d+:\tproc +(\d+) \((\w+)\).*\[D_STEP(\d+)\]", replay, re.MULTILINE):
            command = f" {(int(process) - 1) // 3}" if name in ("Client", "Bridge", "Driver") else ""
            steps.append(f"{name}{command}: {comment_above(model, int(line) - 1)}")
        return [*steps, f"breach: {self.breach()}"]


def comment_above(lines, index):
    """The first line of the nearest comment that begins above this line."""
    while not lines[index].strip().startswith("/*"):
        index -= 1
    return lines[index].strip().strip("/* -").split(". ")[0]
