#!/usr/bin/env python3
"""Every `axlecast ...` line in a block of code of the documentation names a command and options that exist.

    tests/docs/examples.py FOLDER AXLECAST"""

import json
import re
import subprocess
import sys
from pathlib import Path

from pages import pages_of

from links import FENCE

COMMAND = re.compile(r"(?:^\s*|\$ |sudo |&& |\| |\$\(|[A-Z_]+=\S* )axlecast(?=\s)([^`]*)")
OPTION = re.compile(r"(?<![\w-])(--?[a-zA-Z][\w-]*)")
END = re.compile(r"\s(?:\||&&|\|\||;|>|<|#)(?:\s|$)|\)\s|;\s")


def lines_of(page):
    """The lines of code, each with its number; a line that ends in a backslash continues in the next."""
    fenced, held, start = False, "", 0
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if FENCE.match(line.lstrip()):
            fenced = not fenced
        elif fenced:
            start = start if held else number
            held += line
            if not line.endswith("\\"):
                yield start, held
                held = ""
            else:
                held = held[:-1] + " "


def walk(tree, words):
    """The command that the words name, the options that it and those above it take, and the words that are left."""
    options = {name for option in tree["options"] for name in option["names"]} | {"--help", "-h"}
    while words:
        below = {command["name"]: command for command in tree["commands"]}
        if words[0] not in below:
            break
        tree = below[words.pop(0)]
        options |= {name for option in tree["options"] for name in option["names"]}
    return tree, options, words


def problem(tree, text):
    words = text.split()
    if not words or words[0] in ("COMMAND", "...") or re.match(r"^[|.0-9(]", words[0]) or words[0].endswith(":"):
        return None  # "axlecast COMMAND", a version, an error message
    if words[0].startswith("-"):
        command, options, _ = walk(tree, [])
    else:
        command, options, rest = walk(tree, list(words))
        if command is tree:
            return f"no such command: {words[0]}"
        if command["commands"] and not command["arguments"] and rest and re.match(r"^[a-z]", rest[0]):
            return f"no such command: {words[0]} {rest[0]}"
    for option in OPTION.findall(re.sub(r"'[^']*'|\"[^\"]*\"", "", text)):
        if option not in options:
            return f"no such option of {command['name']}: {option}"
    return None


def main():
    top = Path(sys.argv[1]).resolve()
    tree = json.loads(subprocess.run([sys.argv[2], "--cli-tree"], capture_output=True, text=True, check=True).stdout)
    pages = pages_of(top)
    seen = bad = 0
    for page in pages:
        for number, line in lines_of(page):
            for match in COMMAND.finditer(line):
                text = END.split(match.group(1), maxsplit=1)[0]
                seen += 1
                if why := problem(tree, text):
                    bad += 1
                    print(f"{page.relative_to(top)}:{number}: {why}")
    print(f"{seen} lines on {len(pages)} pages, {bad} wrong")
    return 1 if bad or not seen else 0


if __name__ == "__main__":
    sys.exit(main())
