"""Random messages of every type, encoded by the Python types of lcm-gen. The definitions state what each member may be."""

import pathlib
import random
import struct
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "lcmtypes/go"))
import lcm_definition  # noqa: E402 pylint: disable=wrong-import-position

BITS = {"int8_t": 8, "int16_t": 16, "int32_t": 32, "int64_t": 64}
MOST = 4  # elements of an array
DEEPEST = 3  # messages within messages
FLOATS = [0.0, -0.0, 1.5, float("inf"), float("-inf"), float("nan")]
CHARACTERS = "abcxyz09_ \0µ²€𝄞"


class Maker:
    """Random messages of the types in one folder of definitions."""

    def __init__(self, folder, module, seed):
        self.structs = lcm_definition.read(sorted(folder.glob("*.lcm")))
        self._module = module
        self._chance = random.Random(seed)

    def encoded(self, name):
        return self._message(name, 0).encode()

    def _message(self, name, depth):
        message = getattr(self._module, name)()
        members = self.structs[name].members
        lengths = {dimension for member in members for dimension in member.dimensions}
        for member in members:
            if member.name in lengths:
                value = 0 if depth == DEEPEST else self._chance.randrange(MOST + 1)
            else:
                value = self._array(message, member, member.dimensions, depth)
            setattr(message, member.name, value)
        return message

    def _array(self, message, member, dimensions, depth):
        if not dimensions:
            return self._value(member.kind, depth)
        first = dimensions[0]
        count = int(first) if lcm_definition.is_number(first) else getattr(message, first)
        if member.kind == "byte" and len(dimensions) == 1:
            return self._chance.randbytes(count)
        return [self._array(message, member, dimensions[1:], depth) for _ in range(count)]

    def _value(self, kind, depth):
        chance = self._chance
        if kind in BITS:
            return chance.getrandbits(BITS[kind]) - (1 << BITS[kind] - 1)
        if kind == "byte":
            return chance.randrange(256)
        if kind == "float":
            return chance.choice(FLOATS) if chance.random() < 0.2 else struct.unpack(">f", struct.pack(">f", chance.gauss(0, 1e6)))[0]
        if kind == "double":
            return chance.choice(FLOATS) if chance.random() < 0.2 else chance.gauss(0, 1e9)
        if kind == "boolean":
            return chance.random() < 0.5
        if kind == "string":
            return "".join(chance.choices(CHARACTERS, k=chance.randrange(20)))
        return self._message(kind, depth + 1)


def frames(messages):
    """Bytes that tests/consumers/go/frames.go reads."""
    return b"".join(struct.pack(">I", len(message)) + message for message in messages)


def split(data):
    """The frames of bytes that it has written."""
    found, place = [], 0
    while place < len(data):
        size, = struct.unpack_from(">I", data, place)
        found.append(data[place + 4:place + 4 + size])
        place += 4 + size
    return found
