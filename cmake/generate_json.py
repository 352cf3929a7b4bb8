#!/usr/bin/env python3
"""Writes message_json.h, message_json.cpp and message_json_names.h: every type of lcmtypes/ as JSON, under the field names of its .lcm, and the
JSON Schema of that JSON (draft 2020-12), with the comments of the .lcm as descriptions. Also published_types.h: the types that
have the head of all published types.

A number whose comment names constants (`STATE_*`, `position_t FLAG_*`) is followed by its names:

    int8_t  unit;        // position_t UNIT_*       "unit":4,"unit_name":"mm"
    int32_t flags;       // FLAG_*                  "flags":1,"flag_names":["valid"]
    int64_t errors[16];  // by ERROR_*              "errors":[0,2,...],"errors_by_name":{"timeout":0,"short":2,...}

usage: generate_json.py HEADER SOURCE NAMES PUBLISHED_TYPES INCLUDE_OF_HEADER LCM_FILE...
"""
import json
import re
import sys
from pathlib import Path

PRIMITIVES = {"int8_t", "int16_t", "int32_t", "int64_t", "float", "double", "string", "boolean", "byte"}

# An encoded message within a message: shown a second time, decoded, under <field>_decoded.
NESTED = {
    ("command_t", "body"): "command_body_t",
    ("driver_command_t", "order"): "driver_order_t",
    ("permit_t", "permit"): "permit_body_t",
}

# Constants that are bits of a number; those of another prefix are its values.
BITS = {"FLAG", "STATUS"}
# Names in capitals, as every table and page shows the states of devices, buses and recorders.
CAPITALS = {("device_info_t", "STATE"), ("bus_health_t", "STATE"), ("recorder_health_t", "STATE")}

# The head with which every published type begins.
HEAD = [("int64_t", name) for name in ("utime", "mono_ns", "boot_id", "seq", "machine_id", "clock_id")]

CONSTANTS = re.compile(r"^const \w+ (.*)$")
REFERENCE = re.compile(r"(\bby )?(?:\b(\w+_t) )?\b([A-Z]+)_\*")
MEMBER = re.compile(r"^(\w+)\s+(\w+)((?:\s*\[\s*\w+\s*\])*)$")
REMARK = re.compile(r"^\s*(?!const\b)\w+\s+(\w+)\s*[\w\[\]\s]*;\s*//\s*(.*(?:\n\s*//.*)*)", re.MULTILINE)


class Names:
    """What a member's comment states about its numbers: struct and prefix of the constants, and their place."""

    def __init__(self, struct, prefix, is_index):
        self.struct, self.prefix, self.is_index = struct, prefix, is_index
        self.is_bits = prefix in BITS
        words = struct.removesuffix("_t").split("_") + prefix.split("_")
        self.table = "k" + "".join(word.capitalize() for word in words) + "Names"
        self.words = []  # (number, name), filled when all constants are known

    def key(self, member):
        """The name of the field with the names."""
        if self.is_index:
            return member + "_by_name"
        stem = re.sub(r"_code$|_bits$", "", member)
        return re.sub(r"s$", "", stem) + "_names" if self.is_bits and not stem.endswith("status") else \
            stem + ("_names" if self.is_bits else "_name")


class Member:
    """One member of a struct: its type, name, dimensions (numbers, or names of members), comment, and the names of its
    numbers (none: null)."""

    def __init__(self, kind, name, dimensions, remark, names):
        self.kind, self.name, self.dimensions, self.remark, self.names = kind, name, dimensions, remark, names


def names_of(struct, kind, remark):
    reference = REFERENCE.search(remark or "") if kind.startswith("int") else None
    return Names(reference.group(2) or struct, reference.group(3), bool(reference.group(1))) if reference else None


def parse(path, constants):
    """The name of a file's one struct and its members in order; its constants go to `constants`."""
    source = path.read_text(encoding="utf-8")
    remarks = {name: re.sub(r"\s*\n\s*//\s*", " ", text).strip() for name, text in REMARK.findall(source)}
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", source, flags=re.DOTALL)
    struct = re.search(r"\bstruct\s+(\w+)\s*\{(.*)\}", text, re.DOTALL)
    if not struct:
        sys.exit(f"{path}: no struct")
    members = []
    for statement in struct.group(2).split(";"):
        statement = " ".join(statement.split())
        if not statement:
            continue
        if constant := CONSTANTS.match(statement):
            for assignment in constant.group(1).split(","):
                prefix, word, number = re.match(r"\s*([A-Z]+)_(\w+) = (\w+)\s*$", assignment).groups()
                capitals = (struct.group(1), prefix) in CAPITALS
                constants.setdefault((struct.group(1), prefix), []).append(
                    (int(number, 0), word if capitals else word.lower()))
            continue
        member = MEMBER.match(statement)
        if not member:
            sys.exit(f"{path}: cannot read the member `{statement}`")
        name = member.group(2)
        members.append(Member(member.group(1), name, re.findall(r"\w+", member.group(3)), remarks.get(name),
                              names_of(struct.group(1), member.group(1), remarks.get(name))))
    return struct.group(1), members


def find_names(types, constants):
    """Gives each member the words of its constants."""
    for struct, members in types:
        for member in members:
            if member.names is None:
                continue
            member.names.words = constants.get((member.names.struct, member.names.prefix))
            if not member.names.words:
                sys.exit(f"{struct}.{member.name}: {member.names.struct} has no constants {member.names.prefix}_*")


def is_id(member):
    return member.kind == "int64_t" and (
        member.name in ("boot_id", "machine_id", "clock_id") or member.name.endswith(("_boot_id", "base_id")))


def value(member):
    """The C++ expression that makes one member's JSON."""
    field = f"message.{member.name}"
    if member.kind == "byte":
        return f"HexField({field})"
    if is_id(member):
        return f"IdField({field})"
    return f"Field({field})"


def element_schema(kind, types):
    """Of one value of a type."""
    if kind in types:
        return struct_schema(kind, types)
    if kind == "string":
        return {"type": "string"}
    return {"type": ["number", "null"]} if kind in ("float", "double") else {"type": "integer"}


def member_schema(member, types):
    """What `value` makes of a member."""
    dimensions = list(member.dimensions)
    if member.kind == "byte":
        dimensions.pop()
        schema = {"type": "string", "pattern": "^([0-9a-f]{2})*$"}
    elif is_id(member):
        schema = {"type": "string", "pattern": "^[0-9a-f]{16}$"}
    else:
        schema = element_schema(member.kind, types)
    for size in reversed(dimensions):
        fixed = {"minItems": int(size), "maxItems": int(size)} if size.isdigit() else {}
        schema = {"type": "array", "items": schema, **fixed}
    return {**schema, "description": member.remark} if member.remark else schema


def names_schema(member):
    """What the names of a member's numbers look like."""
    words = [word for _, word in member.names.words]
    if member.names.is_index:
        properties = {word: {"type": "integer"} for word in words}
        return {"type": "object", "properties": properties, "required": words, "additionalProperties": False}
    if member.names.is_bits:
        schema = {"type": "array", "items": {"anyOf": [{"enum": words}, {"type": "string", "pattern": "^0x[0-9a-f]+$"}]},
                  "uniqueItems": True}
    else:
        schema = {"enum": [*words, None]}
    for size in reversed(member.dimensions):
        fixed = {"minItems": int(size), "maxItems": int(size)} if size.isdigit() else {}
        schema = {"type": "array", "items": schema, **fixed}
    return schema


def struct_schema(struct, types):
    properties = {}
    for member in types[struct]:
        properties[member.name] = member_schema(member, types)
        if member.names:
            properties[member.names.key(member.name)] = names_schema(member)
        if nested := NESTED.get((struct, member.name)):
            properties[member.name + "_decoded"] = {"anyOf": [struct_schema(nested, types), {"type": "null"}]}
    return {"title": struct, "type": "object", "properties": properties, "required": list(properties)}


def to_json(struct, members):
    # Appended without a look for the name, which is a new one each time.
    lines = [f"nlohmann::ordered_json ToJson(const {struct}& message) {{", "  nlohmann::ordered_json::object_t json;",
             f"  json.reserve({len(members) + sum(member.names is not None for member in members) + 1});"]
    for member in members:
        lines.append(f'  json.emplace_back("{member.name}", {value(member)});')
        if names := member.names:
            make = "CountsByName" if names.is_index else "BitNamesField" if names.is_bits else "NameField"
            number = f"message.{member.name}"
            if names.is_bits and not member.dimensions:
                number = f"static_cast<std::u{member.kind}>({number})"  # so that the highest bit stays one bit
            lines.append(f'  json.emplace_back("{names.key(member.name)}", {make}({number}, {names.table}));')
        if nested := NESTED.get((struct, member.name)):
            lines.append(f'  json.emplace_back("{member.name}_decoded", DecodedField<{nested}>(message.{member.name}));')
    lines += ["  return json;", "}", ""]
    return lines


def name_tables(types):
    """The constants that members name, each table once."""
    tables = {member.names.table: member.names.words for _, members in types for member in members if member.names}
    for table, words in sorted(tables.items()):
        yield f"inline constexpr NumberName {table}[] = {{"
        yield from (f'    {{{number}, "{word}"}},' for number, word in words)
        yield "};"


def has_head(members):
    return [(member.kind, member.name) for member in members[:len(HEAD)]] == HEAD


def published_types(types):
    """The text of published_types.h."""
    published = {name: members for name, members in types if has_head(members)}
    named = [name for name, members in published.items()
             if any((member.kind, member.name) == ("string", "machine") for member in members)]
    return "\n".join(["// Generated by cmake/generate_json.py.", "#pragma once", "",
                      *(f"#include <axlecast/{name}.hpp>" for name in published), "", "namespace axlecast {", "",
                      "template <typename... Messages>", "struct TypeList {};", "",
                      "// The types that begin with the head of all published types.",
                      f"using PublishedTypes = TypeList<{', '.join(published)}>;",
                      "// Those of them that contain the name of the machine.",
                      f"using NamedTypes = TypeList<{', '.join(named)}>;", "", "}  // namespace axlecast", ""])


def main():
    header, source, tables, published, folder = *(Path(word) for word in sys.argv[1:5]), sys.argv[5]
    constants = {}
    types = [parse(Path(file), constants) for file in sorted(sys.argv[6:])]
    find_names(types, constants)
    names = {name for name, _ in types}
    for name, members in types:
        for member in members:
            if member.kind not in PRIMITIVES and member.kind not in names:
                sys.exit(f"{name}.{member.name}: unknown type {member.kind}")
    for struct, name in NESTED:
        if not any(member.kind == "byte" and member.name == name for member in dict(types).get(struct, [])):
            sys.exit(f"{struct}.{name} is not a member of bytes")

    head = ["// Generated by cmake/generate_json.py.", "#pragma once", ""]
    head += [f"#include <axlecast/{name}.hpp>" for name, _ in types]
    head += ["#include <nlohmann/json.hpp>", "#include <optional>", "#include <string>", "#include <string_view>", "",
             '#include "core/base/inline_bytes.h"', '#include "core/messages/json/field.h"', "", "namespace axlecast {", "",
             "// One flat object: the message's fields, by name and in order. Boot ids are 16 hex digits, bytes are hex,",
             "// unknown numbers (NaN) null; a state, a unit or flags are followed by their names."]
    head += [f"[[nodiscard]] nlohmann::ordered_json ToJson(const {name}& message);" for name, _ in types]
    head += ["", "// A type of message.", "struct MessageType {", "  std::int64_t fingerprint;", "  std::string_view name;",
             "  // JSON Schema (draft 2020-12) of the type's JSON.", "  std::string_view schema;",
             "  bool has_head;  // it begins as every published type",
             "  std::optional<nlohmann::ordered_json> (*decode)(Bytes message);", "};", "",
             "// The type that the message's fingerprint names, whatever follows; null when it is none of ours.",
             "[[nodiscard]] const MessageType* FindMessageType(Bytes message);",
             "", "// Any message of ours, told by its fingerprint; its type's name goes to `type`. Nothing when it is none of",
             "// ours or malformed.",
             "[[nodiscard]] std::optional<nlohmann::ordered_json> DecodeToJson(Bytes message, std::string* type);", "",
             "// The head of such a message, at little cost: the rest of it is not looked at. Nothing for types without one.",
             "[[nodiscard]] std::optional<MessageHead> HeadOf(Bytes message);", "",
             "}  // namespace axlecast", ""]

    body = ["// Generated by cmake/generate_json.py.", f'#include "{folder}/{header.name}"', "", "#include <array>", "#include <string_view>",
            "", '#include "core/messages/json/field.h"', f'#include "{folder}/{tables.name}"', "", "namespace axlecast {", ""]
    for name, members in types:
        body += to_json(name, members)
    body += ["namespace {", ""]
    for name, _ in types:
        schema = json.dumps(struct_schema(name, dict(types)), ensure_ascii=False)
        # A compiler need not take longer literals than 64 KiB; the longest is far below.
        body += [f'constexpr std::string_view kSchemaOf_{name} = R"schema({schema})schema";']
    body += ["", "const std::array<MessageType, %d>& MessageTypes() {" % len(types),
             "  static const std::array<MessageType, %d> types = {{" % len(types)]
    for name, members in types:
        headed = str(has_head(members)).lower()
        body += [f'      {{{name}::getHash(), "{name}", kSchemaOf_{name}, {headed}, DecodeField<{name}>}},']
    body += ["  }};", "  return types;", "}", "", "}  // namespace", "",
             "const MessageType* FindMessageType(Bytes message) {",
             "  const std::optional<std::int64_t> fingerprint = Fingerprint(message);",
             "  if (!fingerprint) return nullptr;",
             "  for (const MessageType& candidate : MessageTypes()) {",
             "    if (candidate.fingerprint == *fingerprint) return &candidate;",
             "  }",
             "  return nullptr;",
             "}", "",
             "std::optional<nlohmann::ordered_json> DecodeToJson(Bytes message, std::string* type) {",
             "  const MessageType* const found = FindMessageType(message);",
             "  if (found == nullptr) return std::nullopt;",
             "  *type = found->name;",
             "  return found->decode(message);",
             "}", "",
             "std::optional<MessageHead> HeadOf(Bytes message) {",
             "  const MessageType* const type = FindMessageType(message);",
             "  return type != nullptr && type->has_head ? ReadHead(message) : std::nullopt;",
             "}", "", "}  // namespace axlecast", ""]
    tables.write_text("\n".join(["// Generated by cmake/generate_json.py.", "#pragma once", "",
                                 '#include "core/messages/enum_names.h"', "", "namespace axlecast {", "",
                                 *name_tables(types), "", "}  // namespace axlecast", ""]), encoding="utf-8")
    published.write_text(published_types(types), encoding="utf-8")
    header.write_text("\n".join(head), encoding="utf-8")
    source.write_text("\n".join(body), encoding="utf-8")


if __name__ == "__main__":
    main()
