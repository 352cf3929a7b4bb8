#!/usr/bin/env python3
"""Reports words that have a plainer one, in comments, in texts for users and in pages of documentation, as file:line: word.
Exits 1 on any. CONTRIBUTING.md states the rules that no program can check."""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Software does not speak, hear, want or stand. The field has its own words for the rest: fix, restart, retry, none, maximum.
# A shaft "stands still": that is the field's word.
WORDS = re.compile(
    r"\b(mend(s|ed|ing)?|anew|afresh|whoever|be rid|so long|so often|is none|none such|as ever|tells?|told|says?|said"
    r"|stands?(?! still)|stood(?! still)|standing(?! still)|hears?|heard|wants?|wanted|go(es)? on|went on|speaks?|spoken"
    r"|that one|such a one|by turns|beforehand|thereof|whereupon)\b", re.IGNORECASE)
CODE = (".h", ".cpp", ".lcm")
HASH = (".py", ".sh", ".cmake", "CMakeLists.txt")
PROSE = (".md", ".1")
# A literal of one lower-case word is a key of JSON or YAML, or a word of the command line: a contract, not prose.
KEY = re.compile(r'"[a-z_]+"')
# What the words of other documents and of users are quoted in.
QUOTED = re.compile(r"`[^`]*`|“[^”]*”")


def prose_of(path, line):
    """The part of a line that a person reads: a comment, a text, or the whole line of a page."""
    if path.endswith(CODE):
        found = re.findall(r'//.*|"(?:\\.|[^"\\])*"', line)
        return " ".join(text for text in found if not KEY.fullmatch(text))
    if path.endswith(HASH):
        return " ".join(re.findall(r"(?:^|\s)#.*|\"\"\".*", line))
    return line


def hits(paths=None):
    """file:line: word, of all files that git knows."""
    if paths is None:
        listed = subprocess.run(["git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard"], check=True,
                                capture_output=True, text=True).stdout.split("\n")
        paths = [path for path in listed if path.endswith((*CODE, *HASH, *PROSE)) and (ROOT / path).exists()]
    found = []
    for path in paths:
        if path == "tests/lint/english.py":  # it lists the words
            continue
        for number, line in enumerate((ROOT / path).read_text(encoding="utf-8").splitlines(), 1):
            prose = QUOTED.sub("", prose_of(path, line))
            found += [f"{path}:{number}: {match[0]}" for match in WORDS.finditer(prose)]
    return found


def main():
    found = hits()
    print("\n".join(found + [f"{len(found)} words that have a plainer one"]))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
