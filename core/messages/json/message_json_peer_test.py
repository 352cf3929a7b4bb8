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


# (struct, field): the field with the names, and the constants: of which struct, with which prefix.
NAMES = {
    ("alarm_entry_t", "source"): ("source_name", "alarm_entry_t", "SOURCE_"),
    ("alarm_entry_t", "severity"): ("severity_name", "alarm_entry_t", "SEVERITY_"),
    ("alarm_entry_t", "state"): ("state_name", "alarm_entry_t", "STATE_"),
    ("bus_health_t", "state"): ("state_name", "bus_health_t", "STATE_"),
    ("bus_health_t", "errors"): ("errors_by_name", "device_info_t", "ERROR_"),
    ("command_body_t", "mode"): ("mode_name", "command_body_t", "MODE_"),
    ("command_status_t", "state"): ("state_name", "command_status_t", "STATE_"),
    ("command_status_t", "finding"): ("finding_name", "command_status_t", "FINDING_"),
    ("command_status_t", "reason_code"): ("reason_name", "command_status_t", "REASON_"),
    ("device_info_t", "state"): ("state_name", "device_info_t", "STATE_"),
    ("device_info_t", "unit"): ("unit_name", "position_t", "UNIT_"),
    ("device_info_t", "errors"): ("errors_by_name", "device_info_t", "ERROR_"),
    ("driver_device_t", "state"): ("state_name", "device_info_t", "STATE_"),
    ("driver_order_t", "kind"): ("kind_name", "driver_order_t", "KIND_"),
    ("driver_status_t", "kind"): ("kind_name", "driver_status_t", "KIND_"),
    ("driver_status_t", "state"): ("state_name", "command_status_t", "STATE_"),
    ("driver_status_t", "reason_code"): ("reason_name", "command_status_t", "REASON_"),
    ("motor_health_t", "flags"): ("flag_names", "motor_health_t", "FLAG_"),
    ("motor_limits_t", "flags"): ("flag_names", "motor_limits_t", "FLAG_"),
    ("motor_health_t", "status_bits"): ("status_names", "motor_health_t", "STATUS_"),
    ("motor_health_t", "trip_factor"): ("trip_factor_names", "motor_health_t", "STATUS_"),
    ("position_block_t", "unit"): ("unit_name", "position_t", "UNIT_"),
    ("position_block_t", "flags"): ("flag_names", "position_t", "FLAG_"),
    ("position_set_t", "state"): ("state_name", "position_set_t", "STATE_"),
    ("position_set_axis_t", "state"): ("state_name", "position_set_axis_t", "STATE_"),
    ("position_set_axis_t", "unit"): ("unit_name", "position_t", "UNIT_"),
    ("position_set_axis_t", "flags"): ("flag_names", "position_t", "FLAG_"),
    ("position_t", "unit"): ("unit_name", "position_t", "UNIT_"),
    ("position_t", "flags"): ("flag_names", "position_t", "FLAG_"),
    ("recorder_health_t", "state"): ("state_name", "recorder_health_t", "STATE_"),
    ("time_quality_t", "base"): ("base_name", "time_quality_t", "BASE_"),
    ("time_quality_t", "grade"): ("grade_name", "time_quality_t", "GRADE_"),
    ("time_quality_t", "source"): ("source_name", "time_quality_t", "SOURCE_"),
    ("time_quality_t", "utc_grade"): ("utc_grade_name", "time_quality_t", "GRADE_"),
    ("time_quality_t", "utc_source"): ("utc_source_name", "time_quality_t", "SOURCE_"),
    ("time_quality_t", "state"): ("state_name", "time_quality_t", "STATE_"),
    ("time_quality_t", "flags"): ("flag_names", "time_quality_t", "FLAG_"),
    ("trip_log_t", "factor_bits"): ("factor_names", "motor_health_t", "STATUS_"),
    ("wire_record_t", "direction"): ("direction_name", "wire_record_t", "DIRECTION_"),
    ("wire_record_t", "flags"): ("flag_names", "wire_record_t", "FLAG_"),
    ("wire_t", "kind"): ("kind_name", "wire_t", "KIND_"),
}
IN_CAPITALS = {("device_info_t", "STATE_"), ("bus_health_t", "STATE_"), ("recorder_health_t", "STATE_")}

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
            if self.pick.randrange(2):
                return self.pick.randrange(32)  # many a number has a name
            return self.pick.randrange(-(1 << (bits - 1)), 1 << (bits - 1))
        if kind in ("float", "double"):
            return self.pick.choice([0.0, -1.5, 0.015625, float("nan"), float("inf")])
        if kind == "string":
            return self.pick.choice(["", "axis1", "na\u00efve \"quoted\""])
        return self.make(kind)


def words_of(package, struct, prefix):
    """LCM's own constants: number to name."""
    given = {getattr(getattr(package, struct), name): name.removeprefix(prefix)
             for name in dir(getattr(package, struct)) if name.startswith(prefix)}
    return given if (struct, prefix) in IN_CAPITALS else {number: name.lower() for number, name in given.items()}


def named(package, struct, field, value, width):
    """The field after this one, and its content."""
    key, of, prefix = NAMES[struct, field]
    words = words_of(package, of, prefix)

    def bits(number):
        number &= (1 << width) - 1
        rest = number & ~sum(words)
        return [words[bit] for bit in sorted(words) if number & bit] + ([hex(rest)] if rest else [])

    if key.endswith("_by_name"):
        return key, {word: value[index] for index, word in words.items()}
    if key.endswith("_names"):
        return key, [bits(number) for number in value] if isinstance(value, (list, tuple)) else bits(value)
    return key, words.get(value)


def expected(message, peer):
    """The message as our JSON should show it."""
    def show(name, value):
        if isinstance(value, bytes):
            return value.hex()
        if isinstance(value, (list, tuple)):
            return [show("", element) for element in value]
        if isinstance(value, float):
            return value if value - value == 0 else None
        if isinstance(value, int):
            return f"{value & (1 << 64) - 1:016x}" if name in ("boot_id", "machine_id", "clock_id") or name.endswith(("_boot_id", "base_id")) else value
        if isinstance(value, str):
            return value
        return expected(value, peer)

    struct = type(message).__name__
    kinds = {name: kind for kind, name, _ in peer.members[struct]}
    fields = {}
    for name in message.__slots__:
        fields[name] = show(name, getattr(message, name))
        if (struct, name) in NAMES:
            key, value = named(peer.package, struct, name, getattr(message, name), int(kinds[name][3:-2]))
            fields[key] = value
    return fields


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
        found, wanted = json.loads(text), expected(message, peer)
        if name in NESTED:
            field, body = NESTED[name]
            decoded = getattr(package, body).decode(getattr(message, field))
            assert found.pop(field + "_decoded") == expected(decoded, peer), f"{name}: {line}"
        assert list(found) == list(wanted), f"{name}: fields {list(found)}, not {list(wanted)}"
        assert found == wanted, f"{name}: {found} is not {wanted}"
    print(f"{len(messages)} messages of {len(types)} types agree")


if __name__ == "__main__":
    main()
