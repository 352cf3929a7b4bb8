"""Builds a test program whose sources under test contain all their mutants."""

import dataclasses
import hashlib
import json
import pathlib
import re
import shlex
import shutil
import subprocess

import mutator

TOP = pathlib.Path(__file__).resolve().parents[2]
HERE = pathlib.Path(__file__).resolve().parent
# Reads beyond the end of a container or of freed memory are errors, as under the sanitizers of tools/test; so are failed
# assertions.
SANITIZER = "-fsanitize=address"
STRICT = ["-w", "-O1", "-UNDEBUG", "-D_GLIBCXX_ASSERTIONS", SANITIZER]


@dataclasses.dataclass
class Mutant:
    number: int
    file: str
    function: str
    was: str
    becomes: str

    @property
    def key(self):
        change = f"{mutator.shortened(self.was)} => {mutator.shortened(self.becomes) or '(dropped)'}"
        return f"{self.file} // {self.function} // {change}" + (f" #{self.ordinal}" if self.ordinal > 1 else "")

    ordinal: int = 1


class Source:
    """A mutated source: its sites, and the file with all of them."""

    def __init__(self, path, command, folder):
        self.path, self.written = path, folder / path.replace("/", "+")
        keep = [a for a in command if re.match(r"-(I|D|isystem|std=)", a)]
        paths = [command[i + 1] for i, a in enumerate(command) if a == "-isystem"]
        arguments = [a for a in keep if a != "-isystem"] + [b for p in paths for b in ("-isystem", p)]
        self.text, self.sites = mutator.find(TOP / path, arguments)
        self.excluded = [s for s in self.sites if s.constant]
        self.sites = [s for s in self.sites if not s.constant]

    def write(self):
        text = mutator.render(self.text, self.sites)
        if not self.written.exists() or self.written.read_text(encoding="utf-8") != text:
            self.written.write_text(text, encoding="utf-8")

    @property
    def memory(self):
        return self.written.with_suffix(".excluded.json")

    def recall(self):
        """Excludes what did not compile in the last run, if the source is the same."""
        if self.memory.exists():
            last = json.loads(self.memory.read_text(encoding="utf-8"))
            if last["source"] == self.digest():
                self.exclude(set(last["numbers"]))

    def remember(self):
        numbers = sorted(number for site in self.excluded for number in site.numbers)
        self.memory.write_text(json.dumps({"source": self.digest(), "numbers": numbers}), encoding="utf-8")

    def digest(self):
        """Of the source with the numbers of its mutants."""
        numbers = sorted(number for site in self.sites + self.excluded for number in site.numbers)
        return hashlib.sha256(f"{numbers}{self.text}".encode()).hexdigest()

    def exclude(self, numbers):
        self.excluded += [s for s in self.sites if set(s.numbers) & numbers]
        self.sites = [s for s in self.sites if not set(s.numbers) & numbers]

    def numbers_at(self, line, column):
        """The mutants of the innermost call of schema.h that contains this place, else all of the line."""
        text = self.written.read_text(encoding="utf-8").split("\n")[line + 1]  # two lines before the original's first one
        found, innermost = set(), None
        for match in re.finditer(r"axlecast_mutation::\w+\(([0-9]+)(?:, ([0-9]+))?", text):
            numbers = {int(n) for n in match.groups() if n}
            found |= numbers
            depth, at = 0, text.index("(", match.start())
            while at < len(text):
                depth += {"(": 1, ")": -1}.get(text[at], 0)
                if depth == 0:
                    break
                at += 1
            if match.start() <= column - 1 <= at:
                innermost = numbers
        return innermost or found


class Unit:
    """What the compiler reads at once: a source, or a group of sources (cmake/unity_groups.py)."""

    def __init__(self, command, file, sources, folder):
        self.sources = sources
        self.object = folder / (sources[0].path.replace("/", "+") + ".o")
        if file.suffix == ".cxx":
            text = file.read_text(encoding="utf-8")
            for source in sources:
                text = text.replace(f'"{TOP / source.path}"', f'"{source.written}"')
            file = folder / (sources[0].path.replace("/", "+") + ".unity.cpp")
            file.write_text(text, encoding="utf-8")
        else:
            file = sources[0].written
        self.command = [*command, *STRICT, str(file)]

    def compile(self, cwd):
        """Excludes the mutants that do not compile, until the rest does."""
        for source in self.sources:
            source.recall()
        cache = ["ccache"] if shutil.which("ccache") else []
        for _ in range(40):
            for source in self.sources:
                source.write()
            run = subprocess.run([*cache, *self.command, "-c", "-o", str(self.object)], cwd=cwd, capture_output=True, text=True)
            if run.returncode == 0:
                for source in self.sources:
                    source.remember()
                return
            if not self.exclude_failing(run.stderr):
                raise SystemExit(f"a mutated source does not compile:\n{run.stderr[:3000]}")
        raise SystemExit(f"{self.sources[0].path}: mutants do not compile after 40 attempts")

    def exclude_failing(self, errors):
        failing = False
        for source in self.sources:
            numbers = set()
            for line, column in re.findall(re.escape(source.written.name) + r":(\d+):(\d+):", errors):
                numbers |= source.numbers_at(int(line), int(column))
            source.exclude(numbers)
            failing = failing or bool(numbers)
        return failing


def commands_of(build):
    return json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))


def command_for(entries, path):
    """(the compiler's command without files, warnings and precompiled headers, the file that it reads)"""
    for entry in entries:
        file = pathlib.Path(entry["file"])
        own = file == TOP / path
        if not own and file.suffix == ".cxx" and file.exists() and "_test.dir" not in entry["command"]:
            own = f'"{TOP / path}"' in file.read_text(encoding="utf-8")
        if own:
            words = shlex.split(entry["command"])
            kept, skip = [], False
            for position, word in enumerate(words):
                if skip:
                    skip = False
                elif word in ("-o", "-include", "-c", "-MF", "-MT"):
                    skip = word != "-c"
                elif word.startswith("-W") or word in ("-MD", "-DNDEBUG", str(file), "ccache"):
                    continue
                else:
                    kept.append(word)
            return kept, file
    raise SystemExit(f"{path}: no command in compile_commands.json")


class Program:
    """The programs of a folder's tests with the mutants of its sources."""

    def __init__(self, build, name, paths, targets):
        self.build, self.folder = build, build / "mutation" / name
        self.folder.mkdir(parents=True, exist_ok=True)
        entries = commands_of(build)
        units = {}
        for path in paths:
            command, file = command_for(entries, path)
            units.setdefault(file, (command, []))[1].append(Source(path, command, self.folder))
        self.sources = [source for _, sources in units.values() for source in sources]
        self.number()
        self.units = [Unit(command, file, sources, self.folder) for file, (command, sources) in units.items()]
        self.targets = targets

    def number(self):
        self.mutants, seen = [], {}
        for source in self.sources:
            for site in source.sites:
                site.numbers = []
                for was, becomes in site.mutants:
                    mutant = Mutant(len(self.mutants) + 1, source.path, site.function, was, becomes)
                    mutant.ordinal = seen[mutant.key] = seen.get(mutant.key, 0) + 1
                    site.numbers.append(mutant.number)
                    self.mutants.append(mutant)

    def build_all(self):
        """Compiles the units and links them before the libraries, whose own objects the linker then does not take."""
        entries = commands_of(self.build)
        for unit in self.units:
            unit.compile(self.build)
        command, _ = command_for(entries, self.sources[0].path)
        runtime = self.folder / "runtime.o"
        subprocess.run([*command, "-w", "-c", str(HERE / "runtime.cpp"), "-o", str(runtime)], cwd=self.build, check=True)
        programs = []
        for target in self.targets:
            programs.append(self.folder / target)
            self.link(target, [*(unit.object for unit in self.units), runtime], programs[-1])
        kept = {number for source in self.sources for site in source.sites for number in site.numbers}
        excluded = sum(len(site.mutants) for source in self.sources for site in source.excluded)
        self.mutants = [mutant for mutant in self.mutants if mutant.number in kept]
        return programs, excluded

    def link(self, target, objects, output):
        listed = subprocess.run(["ninja", "-t", "commands", "-s", f"test/{target}"], cwd=self.build, capture_output=True,
                                text=True, check=True)
        words = shlex.split(listed.stdout.strip().split("\n")[-1].removeprefix(": && ").removesuffix(" && :"))
        at = words.index("-o")
        words[at + 1] = str(output)
        subprocess.run([*words[:at], SANITIZER, *map(str, objects), *words[at:]], cwd=self.build, check=True)
