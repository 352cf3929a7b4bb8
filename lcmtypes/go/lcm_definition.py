"""Reads .lcm files: structs with members, constants and comments, and the fingerprints that lcm-gen computes of them."""

from __future__ import annotations

import dataclasses
import functools
import pathlib
import re

#: Bytes of an encoded primitive; of a string the least.
SIZES = {"int8_t": 1, "int16_t": 2, "int32_t": 4, "int64_t": 8, "byte": 1, "float": 4, "double": 8, "boolean": 1, "string": 5}
COUNTS = ("int8_t", "int16_t", "int32_t", "int64_t")  # types of a member that is the length of an array
CONSTANTS = (*COUNTS, "float", "double")

_TOKEN = re.compile(r"(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<word>[A-Za-z_][\w.]*)|(?P<number>[-+]?[\d.][\w.]*(?:(?<=[eE])[-+]\d+)?)"
                    r"|(?P<mark>[{}\[\];,=])|(?P<wrong>\S)", re.DOTALL)


@dataclasses.dataclass
class Constant:
    """A constant: its type, name, value as written, and comment."""

    kind: str
    name: str
    value: str
    comment: list[str]


@dataclasses.dataclass
class Member:
    """A member: its type, name, dimensions as written (numbers, or names of members), and comment."""

    kind: str
    name: str
    dimensions: list[str]
    comment: list[str]

    @property
    def is_primitive(self) -> bool:
        return self.kind in SIZES


@dataclasses.dataclass
class Struct:
    """A type of messages."""

    package: str
    name: str
    comment: list[str]
    members: list[Member]
    constants: list[Constant]


@dataclasses.dataclass
class _Token:
    text: str
    kind: str
    line: int
    column: int
    is_first: bool  # of its line


class DefinitionError(ValueError):
    """A file that is not a definition, or that uses what is not supported."""


def is_number(dimension: str) -> bool:
    """Whether a dimension is a fixed length."""
    return dimension[0].isdigit()


def read(paths: list[pathlib.Path]) -> dict[str, Struct]:
    """Returns the structs of files by name. Raises DefinitionError with file and line."""
    structs: dict[str, Struct] = {}
    for path in paths:
        for struct in _Parser(path).structs():
            if struct.name in structs:
                raise DefinitionError(f"{path}: {struct.name} is defined twice")
            structs[struct.name] = struct
    if len({struct.package for struct in structs.values()}) > 1:
        raise DefinitionError("the files belong to different packages")
    for struct in structs.values():
        for member in struct.members:
            if not member.is_primitive and member.kind not in structs:
                raise DefinitionError(f"{struct.name}.{member.name}: the type {member.kind} is not among the files")
    for name in structs:
        least_size(structs, name)  # refuses one that contains itself without end
    return structs


def _tokens(source: str) -> list[_Token]:
    tokens, last_line = [], 0
    for match in _TOKEN.finditer(source):
        line = source.count("\n", 0, match.start()) + 1
        column = match.start() - (source.rfind("\n", 0, match.start()) + 1)
        tokens.append(_Token(match[0], match.lastgroup, line, column, line != last_line))
        last_line = line + match[0].count("\n")
    return tokens


def _lines(comment: str) -> list[str]:
    """The text of a comment without its marks."""
    if comment.startswith("//"):
        return [comment[2:].strip()]
    return [line.strip().removeprefix("*").strip() for line in comment[2:-2].strip().splitlines()]


class _Parser:
    """One file. Comments above a statement and behind it belong to it, with the deeper lines that follow."""

    def __init__(self, path: pathlib.Path) -> None:
        self._path = path
        self._tokens = _tokens(path.read_text(encoding="utf-8"))
        self._place = 0
        self._above: list[str] = []

    def structs(self) -> list[Struct]:
        package, found = "", []
        while self._peek() is not None:
            word = self._take("word").text
            if word == "package":
                package = self._take("word").text
                self._take(";")
            elif word == "struct":
                found.append(self._struct(package))
            else:
                self._fail(f"'{word}' is not supported; a file has a package and structs")
        return found

    def _struct(self, package: str) -> Struct:
        struct = Struct(package, self._take("word").text, self._comment_above(), [], [])
        self._take("{")
        while not self._skip("}"):
            begin = self._take("word")
            if begin.text == "const":
                struct.constants += self._constants(begin)
            else:
                struct.members += self._members(struct, begin)
        return struct

    def _constants(self, begin: _Token) -> list[Constant]:
        kind = self._take("word").text
        if kind not in CONSTANTS:
            self._fail(f"a constant of the type {kind} is not supported")
        comment, found = self._comment_above(), []
        while True:
            name = self._take("word").text
            self._take("=")
            found.append(Constant(kind, name, self._take("number").text, []))
            if not self._skip(","):
                break
        found[0].comment = self._end(begin, comment)
        return found

    def _members(self, struct: Struct, begin: _Token) -> list[Member]:
        kind = begin.text.removeprefix(struct.package + ".")
        comment, found = self._comment_above(), []
        while True:
            found.append(Member(kind, self._take("word").text, [], []))
            while self._skip("["):
                found[-1].dimensions.append(self._dimension(struct))
                self._take("]")
            if not self._skip(","):
                break
        names = [member.name for member in struct.members + found]
        if len(set(names)) != len(names):
            self._fail(f"{struct.name} has two members of one name")
        found[0].comment = self._end(begin, comment)
        return found

    def _dimension(self, struct: Struct) -> str:
        text = self._take("number", "word").text
        if is_number(text):
            if not text.isdecimal() or int(text) < 1:
                self._fail(f"{text} is no length of an array")
        elif not any(member.name == text and member.kind in COUNTS and not member.dimensions for member in struct.members):
            self._fail(f"the length {text} of an array must be a whole number that is a member before it")
        return text

    # -- tokens and comments

    def _peek(self) -> _Token | None:
        """The next token that is no comment. Comments before it are those above the next statement."""
        while self._place < len(self._tokens) and self._tokens[self._place].kind == "comment":
            self._above += _lines(self._tokens[self._place].text)
            self._place += 1
        return self._tokens[self._place] if self._place < len(self._tokens) else None

    def _take(self, *wanted: str) -> _Token:
        """The next token, which must be one of these kinds or marks."""
        token = self._peek()
        if token is None or (token.kind not in wanted and token.text not in wanted):
            self._fail(f"{' or '.join(wanted)} is missing" + (f" before '{token.text}'" if token else ""))
        self._place += 1
        return token

    def _skip(self, mark: str) -> bool:
        """Takes a mark if it is the next token."""
        token = self._peek()
        if token is None or token.text != mark:
            return False
        self._place += 1
        return True

    def _comment_above(self) -> list[str]:
        comment, self._above = self._above, []
        return comment

    def _end(self, begin: _Token, above: list[str]) -> list[str]:
        """Takes the end of a statement. Returns its comment: what is above it and what is behind it."""
        line, behind = self._take(";").line, []
        while self._place < len(self._tokens):
            token = self._tokens[self._place]
            continues = token.line == line if not token.is_first else bool(behind) and token.line == line + 1 and token.column > begin.column
            if token.kind != "comment" or not continues:
                break
            behind += _lines(token.text)
            line = token.line + token.text.count("\n")
            self._place += 1
        return [*above, "", *behind] if above and behind else above + behind

    def _fail(self, cause: str) -> None:
        line = self._tokens[min(self._place, len(self._tokens) - 1)].line if self._tokens else 1
        raise DefinitionError(f"{self._path}:{line}: {cause}")


# -- sizes and fingerprints


def least_size(structs: dict[str, Struct], kind: str, dimensions: list[str] = (), within: tuple[str, ...] = ()) -> int:
    """Returns the least bytes of an encoded value. Raises DefinitionError if a struct contains itself without end."""
    if any(not is_number(dimension) for dimension in dimensions):
        return 0
    if kind in within:
        raise DefinitionError(f"{kind} contains itself without end")
    size = SIZES[kind] if kind in SIZES else sum(
        least_size(structs, member.kind, member.dimensions, (*within, kind)) for member in structs[kind].members)
    return functools.reduce(lambda product, dimension: product * int(dimension), dimensions, size)


def fingerprint(structs: dict[str, Struct], name: str, parents: tuple[str, ...] = ()) -> int:
    """Returns the 64 bits with which a message of the type begins: the hash of lcm-gen, over names, types and dimensions."""
    if name in parents:
        return 0
    value = _hash(structs[name])
    for member in structs[name].members:
        if not member.is_primitive:
            value += fingerprint(structs, member.kind, (*parents, name))
    value &= _MASK
    return (value << 1 | value >> 63) & _MASK


_MASK = (1 << 64) - 1


def _hash(struct: Struct) -> int:
    """The hash of a struct's own members. Names of nested types do not count, their members do."""
    value = 0x12345678
    for member in struct.members:
        value = _add_text(value, member.name)
        if member.is_primitive:
            value = _add_text(value, member.kind)
        value = _add(value, len(member.dimensions))
        for dimension in member.dimensions:
            value = _add(value, 0 if is_number(dimension) else 1)
            value = _add_text(value, dimension)
    return value


def _add_text(value: int, text: str) -> int:
    return functools.reduce(_add, text.encode(), _add(value, len(text)))


def _add(value: int, byte: int) -> int:
    """One step of the hash. The shift to the right keeps the sign."""
    signed = value - (1 << 64) if value >> 63 else value
    return ((value << 8 ^ signed >> 55) + byte) & _MASK
