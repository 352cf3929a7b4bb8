#!/usr/bin/env python3
"""Messages that LCM's own Python code encodes must come out of DecodeToJson with every field as Python has it.

usage: message_json_peer_test.py MESSAGE_JSON_PROGRAM LCM_GEN LCM_FILE...
"""
import importlib
import json
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

NESTED = {"command_t": ("body", "command_body_t"), "driver_command_t": ("order", "driver_order_t"),
          "permit_t": ("permit", "permit_body_t")}


MEMBER = re.compile(r"^(\w+)\s+(\w+)\s*((?:\[\w+\]\s*)*)$")


def members(definition):
    """(type, name, dimensions) of each member of a .lcm file; a dimension is a number or a member's name."""
    text = re.sub(r"//.*", "", Path(definition).read_text(encoding="utf-8"))
    found = []
    for statement in text[text.index("{") + 1:text.rindex("}")].split(";"):
        member = MEMBER.match(statement.strip())
        if member and not statement.strip().startswith("const"):
            dims = re.findall(r"\w+", member.group(3))
            found.append((member.group(1), member.group(2), [int(d) if d.isdigit() else d for d in dims]))
    return found


class Peer:
    """LCM's Python classes of our types, filled at random."""

    def __init__(self, package, definitions):
        self.package = package
        self.members = {Path(file).stem: members(file) for file in definitions}
        self.pick = random.Random(1)

    def make(self, type_name):
        message = getattr(self.package, type_name)()
        fields = self.members[type_name]
        assert [name for _, name, _ in fields] == list(message.__slots__), type_name
        sizes = {d for _, _, dims in fields for d in dims if isinstance(d, str)}
        for name in sizes:
            setattr(message, name, self.pick.randrange(4))
        for kind, name, dims in fields:
            if name not in sizes:
                setattr(message, name, self.value(message, kind, dims))
        return message

    def value(self, message, kind, dims):
        if dims:
            count = getattr(message, dims[0]) if isinstance(dims[0], str) else dims[0]
            if kind == "byte":
                return bytes(self.pick.randrange(256) for _ in range(count))
            return [self.value(message, kind, dims[1:]) for _ in range(count)]
        if kind.startswith("int"):
            bits = int(kind[3:-2])
            return self.pick.randrange(-(1 << (bits - 1)), 1 << (bits - 1))
        if kind in ("float", "double"):
            return self.pick.choice([0.0, -1.5, 0.015625, float("nan"), float("inf")])
        if kind == "string":
            return self.pick.choice(["", "axis1", "na\u00efve \"quoted\""])
        return self.make(kind)


def expected(message):
    """The message as our JSON should show it."""
    def show(name, value):
        if isinstance(value, bytes):
            return value.hex()
        if isinstance(value, (list, tuple)):
            return [show("", element) for element in value]
        if isinstance(value, float):
            return value if value - value == 0 else None
        if isinstance(value, int):
            return f"{value & (1 << 64) - 1:016x}" if name == "boot_id" or name.endswith("_boot_id") else value
        if isinstance(value, str):
            return value
        return expected(value)

    return {name: show(name, getattr(message, name)) for name in message.__slots__}


def main():
    program, lcm_gen, definitions = sys.argv[1], sys.argv[2], sys.argv[3:]
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([lcm_gen, "-p", "--ppath", folder, *definitions], check=True)
        sys.path.insert(0, folder)
        types = [Path(file).stem for file in definitions]
        package = SimpleNamespace(
            **{name: getattr(importlib.import_module("axlecast." + name), name) for name in types})
        peer = Peer(package, definitions)
        messages = []
        for name in types:
            for _ in range(20):
                message = peer.make(name)
                if name in NESTED:
                    field, body = NESTED[name]
                    encoded = peer.make(body).encode()
                    setattr(message, field, encoded)
                    setattr(message, field + "_size", len(encoded))
                messages.append((name, message))
        lines = "".join(message.encode().hex() + "\n" for _, message in messages)
        output = subprocess.run([program], input=lines, capture_output=True, check=True, text=True).stdout.splitlines()

    assert len(output) == len(messages), f"{len(output)} lines for {len(messages)} messages"
    for (name, message), line in zip(messages, output):
        told, _, text = line.partition(" ")
        assert told == name, f"{name} was taken for {told}"
        found, wanted = json.loads(text), expected(message)
        if name in NESTED:
            field, body = NESTED[name]
            decoded = getattr(package, body).decode(getattr(message, field))
            assert found.pop(field + "_decoded") == expected(decoded), f"{name}: {line}"
        assert list(found) == list(wanted), f"{name}: fields {list(found)}, not {list(wanted)}"
        assert found == wanted, f"{name}: {found} is not {wanted}"
    print(f"{len(messages)} messages of {len(types)} types agree")


if __name__ == "__main__":
    main()
