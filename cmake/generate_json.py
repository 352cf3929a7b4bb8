#!/usr/bin/env python3
"""Writes message_json.h and message_json.cpp: every type of lcmtypes/ as JSON, under the field names of its .lcm, and the
JSON Schema of that JSON (draft 2020-12), with the comments of the .lcm as descriptions.

usage: generate_json.py HEADER SOURCE INCLUDE_OF_HEADER LCM_FILE...
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

# The head with which every published type begins.
HEAD = [("int64_t", "utime"), ("int64_t", "mono_ns"), ("int64_t", "boot_id"), ("int64_t", "seq")]

MEMBER = re.compile(r"^(\w+)\s+(\w+)((?:\s*\[\s*\w+\s*\])*)$")
REMARK = re.compile(r"^\s*(?!const\b)\w+\s+(\w+)\s*[\w\[\]\s]*;\s*//\s*(.*(?:\n\s*//.*)*)", re.MULTILINE)


class Member:
    """One member of a struct: its type, name, dimensions (numbers, or names of members) and comment."""

    def __init__(self, kind, name, dimensions, remark):
        self.kind, self.name, self.dimensions, self.remark = kind, name, dimensions, remark


def parse(path):
    """The name of a file's one struct and its members in order."""
    source = path.read_text(encoding="utf-8")
    remarks = {name: re.sub(r"\s*\n\s*//\s*", " ", text).strip() for name, text in REMARK.findall(source)}
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", source, flags=re.DOTALL)
    struct = re.search(r"\bstruct\s+(\w+)\s*\{(.*)\}", text, re.DOTALL)
    if not struct:
        sys.exit(f"{path}: no struct")
    members = []
    for statement in struct.group(2).split(";"):
        statement = " ".join(statement.split())
        if not statement or statement.startswith("const "):
            continue
        member = MEMBER.match(statement)
        if not member:
            sys.exit(f"{path}: cannot read the member `{statement}`")
        name = member.group(2)
        members.append(Member(member.group(1), name, re.findall(r"\w+", member.group(3)), remarks.get(name)))
    return struct.group(1), members


def is_boot_id(member):
    return member.kind == "int64_t" and (member.name == "boot_id" or member.name.endswith("_boot_id"))


def value(member):
    """The C++ expression that makes one member's JSON."""
    field = f"message.{member.name}"
    if member.kind == "byte":
        return f"HexField({field})"
    if is_boot_id(member):
        return f"BootIdField({field})"
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
    elif is_boot_id(member):
        schema = {"type": "string", "pattern": "^[0-9a-f]{16}$"}
    else:
        schema = element_schema(member.kind, types)
    for size in reversed(dimensions):
        fixed = {"minItems": int(size), "maxItems": int(size)} if size.isdigit() else {}
        schema = {"type": "array", "items": schema, **fixed}
    return {**schema, "description": member.remark} if member.remark else schema


def struct_schema(struct, types):
    properties = {}
    for member in types[struct]:
        properties[member.name] = member_schema(member, types)
        if nested := NESTED.get((struct, member.name)):
            properties[member.name + "_decoded"] = {"anyOf": [struct_schema(nested, types), {"type": "null"}]}
    return {"title": struct, "type": "object", "properties": properties, "required": list(properties)}


def to_json(struct, members):
    # Appended without a look for the name, which is a new one each time.
    lines = [f"nlohmann::ordered_json ToJson(const {struct}& message) {{", "  nlohmann::ordered_json::object_t json;",
             f"  json.reserve({len(members) + 1});"]
    for member in members:
        lines.append(f'  json.emplace_back("{member.name}", {value(member)});')
        if nested := NESTED.get((struct, member.name)):
            lines.append(f'  json.emplace_back("{member.name}_decoded", DecodedField<{nested}>(message.{member.name}));')
    lines += ["  return json;", "}", ""]
    return lines


def main():
    header, source, include = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    types = [parse(Path(file)) for file in sorted(sys.argv[4:])]
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
             '#include "drivers/runtime/core/inline_bytes.h"', '#include "tools/json/field.h"', "", "namespace axlecast {", "",
             "// One flat object: the message's fields, by name and in order. Boot ids are 16 hex digits, bytes are hex,",
             "// unknown numbers (NaN) null; states, flags and units stay numbers."]
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

    body = ["// Generated by cmake/generate_json.py.", f'#include "{include}"', "", "#include <array>", "#include <string_view>",
            "", '#include "tools/json/field.h"', "", "namespace axlecast {", ""]
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
        headed = str([(member.kind, member.name) for member in members[:4]] == HEAD).lower()
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
    header.write_text("\n".join(head), encoding="utf-8")
    source.write_text("\n".join(body), encoding="utf-8")


if __name__ == "__main__":
    main()
