"""One message of every type, each field with a value of its own, written with lcm-gen's Python: not with our code.

    messages.py VERSION     writes messages-VERSION.log, as lcm-logger would (channel = name of the type), and
                            messages-VERSION.json with the values of the fields and the fingerprints of the types

Run it once for each release that adds a type, and never again for a version that was released: every later version must
read that log (test_compatibility.py)."""

import json
import os
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "e2e"))
os.environ.setdefault("AXLECAST_SOURCE", str(HERE.parents[1]))

import lcm_log  # noqa: E402 (needs the path)

BEGIN = 1_790_000_000_000_000  # us, UNIX time of the first
INTEGER_BYTES = {"int8_t": 1, "byte": 1, "int16_t": 2, "int32_t": 4, "int64_t": 8}


FIELD = re.compile(r"^\s*([\w.]+)\s+(\w+)((?:\[\w+\])*)\s*;", re.MULTILINE)


def definitions():
    """The types of lcmtypes/, by name."""
    package = lcm_log.generated_types()
    names = sorted(path.stem for path in pathlib.Path(os.environ["AXLECAST_SOURCE"], "lcmtypes").glob("*.lcm"))
    return {name: getattr(package, name) for name in names}


def fields(name):
    """(type, name, dimensions) of each field, as the definition states them."""
    text = pathlib.Path(os.environ["AXLECAST_SOURCE"], "lcmtypes", f"{name}.lcm").read_text().split("{", 1)[1]
    sizes = dict(re.findall(r"(\w+) = (\d+)", text))
    for kind, field, dimensions in FIELD.findall(re.sub(r"//.*", "", text)):
        yield kind, field, [int(sizes.get(each, each)) if sizes.get(each, each).isdigit() else each
                            for each in re.findall(r"\w+", dimensions)]


class Filler:
    """Gives each field a value of its own that fits its type."""

    def __init__(self, types):
        self.types = types
        self.count = 0

    def scalar(self, kind):
        self.count += 1
        if kind in INTEGER_BYTES:
            bits = 8 * INTEGER_BYTES[kind]
            return (self.count * 2_654_435_761) % 2 ** (bits - 1)
        if kind in ("float", "double"):
            return self.count + 0.5
        if kind == "boolean":
            return self.count % 2 == 1
        if kind == "string":
            return f"text {self.count} äµ"
        return self.message(self.types[kind.removeprefix("axlecast.")])

    def array_size(self):
        """Of an array whose size is a field of the message."""
        return 2

    def field(self, kind, dimensions, sizes):
        if not dimensions:
            return self.scalar(kind)
        size = sizes.get(dimensions[0], dimensions[0])
        if kind == "byte" and len(dimensions) == 1:
            return bytes(self.scalar(kind) for _ in range(size))
        return [self.field(kind, dimensions[1:], sizes) for _ in range(size)]

    def message(self, definition):
        message = definition()
        rows = list(fields(definition.__name__))
        sizes = {size: self.array_size() for _, _, dimensions in rows for size in dimensions if isinstance(size, str)}
        for kind, name, dimensions in rows:
            setattr(message, name, sizes[name] if name in sizes else self.field(kind, dimensions, sizes))
        return message


def plain(value, definitions_by_name):
    """A message as dictionaries and lists, for a comparison with JSON."""
    if type(value).__name__ in definitions_by_name:
        return {name: plain(getattr(value, name), definitions_by_name) for name in value.__slots__}
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, (list, tuple)):
        return [plain(each, definitions_by_name) for each in value]
    return value


def messages():
    types = definitions()
    filler = Filler(types)
    return {name: filler.message(definition) for name, definition in types.items()}


def write(version):
    log, values = HERE / f"messages-{version}.log", HERE / f"messages-{version}.json"
    if log.exists():
        sys.exit(f"{log} exists: a released log stays as it is")
    every, types = messages(), definitions()
    lcm_log.write(log, [(1000 * index, name, message.encode()) for index, (name, message) in enumerate(every.items())], BEGIN)
    content = {name: {"fingerprint": types[name]._get_packed_fingerprint().hex(), "fields": plain(message, types)}
               for name, message in every.items()}
    values.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    write(sys.argv[1])
