"""Puts a folder's .cpp files into groups that compile as one translation unit each.

Usage: unity_groups.py FILE...

Prints one line for each file, in the order given: the number of its group. No file follows one in its group that
declares, in an unnamed namespace, a name that it mentions: what is private to a file stays private. That is judged by
the text alone: a name that is mentioned for something else splits a group, which costs time and nothing else.
"""

import re
import sys
from pathlib import Path

GROUP_LINES = 1500
NOT_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|^[ \t]*#[^\n]*', re.DOTALL | re.MULTILINE)
MENTION = re.compile(r"(?<![.\w])(?<!->)[A-Za-z_]\w*")


class Source:
    def __init__(self, path):
        text = path.read_text()
        code = NOT_CODE.sub(" ", text)
        self.lines = text.count("\n")
        self.mentions = set(MENTION.findall(code))
        self.private = private_names(code)

    def disturbs(self, later):
        return bool(self.private & later.mentions)


def private_names(code):
    """The names that the code declares directly in unnamed namespaces."""
    names = set()
    for start in re.finditer(r"\bnamespace\s*\{", code):
        names |= declared(code, start.end())
    return names


def declared(code, at):
    """What is declared between `at`, just after a namespace's opening brace, and its closing one."""
    names = set()
    depth = 0
    statement = ""
    for character in code[at:]:
        if depth == 0 and character in ";{}":
            names.add(name_of(statement))
            statement = ""
        if character == "}":
            depth -= 1
            if depth < 0:
                return names
        elif character == "{":
            depth += 1
        elif depth == 0:
            statement += character
    return names


def name_of(statement):
    """The name that a declaration's text, up to its first brace or semicolon, introduces, or None."""
    statement = re.sub(r"\[\[.*?\]\]|\[[^\]]*\]", " ", statement).split("=")[0]
    for not_private in (r"\s*using\s+[\w:]+::\w+\s*$", r"\s*(?:TYPED_)?TEST\w*\s*\(", r"\s*INSTANTIATE_\w*\s*\("):
        if re.match(not_private, statement):
            return None
    for form in (
        r"^\s*(?:template\s*<.*>\s*)?(?:struct|class|enum(?:\s+class)?|using|concept)\s+(\w+)",
        r"(\w+)\s*\(",
        r"(\w+)\s*$",
    ):
        found = re.search(form, statement, re.DOTALL)
        if found:
            return found.group(1)
    return None


def groups_of(sources):
    """For each source, the number of the first group that it neither disturbs nor makes too long."""
    groups = []
    numbers = []
    for source in sources:
        for number, members in enumerate(groups):
            short = sum(member.lines for member in members) + source.lines <= GROUP_LINES
            if short and not any(member.disturbs(source) for member in members):
                break
        else:
            number = len(groups)
            groups.append([])
        groups[number].append(source)
        numbers.append(number)
    return numbers


if __name__ == "__main__":
    for group in groups_of([Source(Path(path)) for path in sys.argv[1:]]):
        print(group)
