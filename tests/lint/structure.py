#!/usr/bin/env python3
"""Checks the rules of docs/architecture.md that a compiler does not see: a room includes only the rooms below it, every
external world is reached from one place, nothing but a family names a family, and no two types of one program have one name (a
program with two such types may run the functions of one on objects of the other). Prints each breach as file:line: rule; exits 1
on any."""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]

# An external world: the pattern that reaches it, and the only files that may.
WORLDS = [
    ("LCM", r"#include [<\"]lcm/lcm[.-]", r"platform/net/(lcm_port|group_sender_test)\.cpp|tests/differential/.*|client/example/.*|bench/.*"),
    ("LCM's datagrams", r"IP_ADD_MEMBERSHIP|\brecvmmsg", r"platform/net/(multicast_port|group_socket)\.cpp|bench/.*"),
    ("serial line", r"termios|termbits|\bTIOC[A-Z]+",
     r"(drivers/hal/(serial_port|adapter|pty|line_guard)(_test)?|platform/os/terminal(_test)?)\.(cpp|h)|bench/.*"),
    ("clock", r"clock_gettime|std::chrono|\bgettimeofday|\bclock_nanosleep|std::this_thread::sleep",
     r"platform/os/system_clock\.cpp|tests/time_guests/clock_(agent|oracle)\.cpp|client/example/.*|bench/.*"),
    ("SPI", r"linux/spi", r"drivers/hal/spi_port\.cpp|tests/vm/cuse_spidev\.cpp"),
    ("CAN", r"#include <linux/can", r"drivers/hal/can_(socket|netlink)\.cpp"),
    ("Modbus", r"#include <modbus", r"drivers/hal/modbus_port\.cpp"),
    ("MQTT", r"#include <(mosquitto|mqtt_protocol)\.h", r"platform/net/mqtt_link\.cpp"),
    ("GPIO", r"gpiod\.h", r"drivers/hal/pulse_lines(_test)?\.cpp"),
    ("process", r"sys/(prctl|resource|mman)\.h|\bsched_set[a-z]+\(",
     r"platform/os/(process(_test)?|mapped_file)\.cpp|tools/doctor/host/host\.cpp"
     r"|tools/axlecast/run/(process_supervisor|simulation_server)\.cpp|tests/time_guests/clock_page\.h"
     r"|tests/disk/limited_files\.h|bench/.*"),
    ("PostgreSQL", r"libpq-fe\.h", r"platform/db/.*"),
    ("SQLite", r"sqlite3\.h", r"bridge/store/database\.cpp"),
    ("HTTP and WebSockets", r"libwebsockets\.h", r"platform/net/web_server\.cpp"),
    ("systemd", r"systemd/", r"platform/os/process\.cpp"),
]
# What every tool may include.
BESIDE_TOOLS = ("core", "platform", "client", "bridge/store", "drivers/hal", "drivers/kit")
LIBRARIES_OF_TOOLS = tuple(f"tools/{name}" for name in (
    "convert", "doctor", "fleet", "foxglove", "log", "metrics", "monitor", "mqtt", "recorder", "redecode", "replay", "scan", "service", "web"))
# The folders of tools/axlecast, and which of the others each may include.
SUBCOMMANDS = [
    ("common", ()),
    ("live", ("common",)),
    ("decode", ("common",)),
    ("logs", ("common",)),
    ("command", ("common", "live")),
    ("run", ("common", "live", "logs")),
    ("fleet", ("common", "logs", "run")),
    ("device_data", ("common", "live", "command")),
    ("setup", ("common", "live", "logs", "command", "run", "fleet", "device_data")),
]
# A room, and what it may include beside itself. The first that begins a file's path counts.
ROOMS = [
    ("core/base", ()),
    ("core/device", ("core/base",)),
    ("core/messages", ("core/base", "core/device")),
    ("core/command", ("core/base", "core/device", "core/messages")),
    ("core/time", ("core/base", "core/device", "core/messages")),
    ("core/config", ("core/base", "core/device", "core/messages", "core/command")),
    ("core/alarm", ("core/base", "core/device", "core/messages", "core/command", "core/config")),
    ("platform/os", ("core",)),
    ("platform/net", ("core", "platform/os")),
    ("platform/db", ("core", "platform/os")),
    ("drivers/protocol", ("core",)),
    ("drivers/kit", ("core", "drivers/protocol")),
    ("drivers/hal", ("core", "platform", "drivers/protocol")),
    ("drivers/runtime/bus", ("core",)),
    ("drivers/runtime/axis", ("core",)),
    ("drivers/runtime/command", ("core", "drivers/kit", "drivers/runtime/axis")),
    ("drivers/runtime", ("core", "platform", "drivers/hal", "drivers/kit")),
    ("drivers/saa/", ("core", "drivers/kit")),  # facts of one manual that several families have in common
    ("drivers/cia406/", ("core", "drivers/kit", "drivers/protocol")),  # CANopen encoders: a model of the family saa_can
    ("drivers/saa_can/", ("core", "drivers/kit", "drivers/protocol", "drivers/saa/", "drivers/cia406/")),
    ("drivers/", ("core", "drivers/kit", "drivers/protocol", "drivers/saa/")),
    ("bridge/store", ("core", "platform")),
    ("bridge/access", ("core", "platform")),
    ("bridge/state", ("core", "platform", "bridge/store")),
    ("bridge/dispatch", ("core", "platform", "bridge/store", "bridge/access", "bridge/state")),
    ("bridge", ("core", "platform")),
    ("client", ("core", "platform")),
    ("tools/scan", ("tools", "core", "platform", "drivers/hal", "drivers/runtime")),
    ("tools/redecode", ("tools", "core", "platform", "drivers/runtime")),
    *[(f"tools/axlecast/{name}", (*BESIDE_TOOLS, *LIBRARIES_OF_TOOLS, *(f"tools/axlecast/{lower}" for lower in below)))
      for name, below in SUBCOMMANDS],
    ("tools/axlecast", (*BESIDE_TOOLS, "tools")),
    ("tools", (*BESIDE_TOOLS, *LIBRARIES_OF_TOOLS)),
]
MAX_LINES = 800
NAMESPACE = re.compile(r"(?:inline )?namespace ?([\w:]*) ?{$")
TYPE = re.compile(r"(?:class|struct|enum|enum class) (?:\w+\(.*\) )?(\w+)(?: final)?(?: : .*)? ?{")


def tracked_sources():
    listing = subprocess.run(["git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard", "*.h", "*.cpp"],
                             check=True, capture_output=True, text=True).stdout
    return sorted(path for path in listing.split() if (ROOT / path).exists())


def families():
    return [path.parent.name for path in (ROOT / "drivers").glob("*/family.cpp")]


def is_test(path):
    """Tests, their fixtures and fuzzers: the units of other rooms that they need are theirs to choose."""
    return path.startswith("tests/") or re.search(r"(_test|_fuzz|_fixture|_test_support)\.(cpp|h)$|/test_[a-z_]+\.h$", path)


def room_breach(path, included):
    """The rule that an #include of a file of ours breaks, or None."""
    room = next(((name, below) for name, below in ROOMS if path.startswith(name)), None)
    if room is None or is_test(path):
        return None
    own = room[0] if room[0] != "drivers/" else "/".join(path.split("/")[:2])
    if any(included.startswith(name) for name in (own, *room[1])):
        return None
    return f"{own} includes {included}; it may include {', '.join(room[1]) or 'no other room'}"


def breaches(path, text, family_names):
    lines = text.splitlines()
    if len(lines) > MAX_LINES:
        yield 1, f"{len(lines)} lines, at most {MAX_LINES}: is this still one concept?"
    own_family = next((name for name in family_names if path.startswith(f"drivers/{name}/")), None)
    names_no_family = own_family is None and not is_test(path) and re.match(r"(core|platform|drivers|bridge|client|tools)/", path)
    for number, line in enumerate(lines, 1):
        for world, pattern, allowed in WORLDS:
            if re.search(pattern, line) and not re.fullmatch(allowed, path):
                yield number, f"{world} is reached from here; only {allowed} may"
        code = line.split("//")[0]
        if names_no_family and '"' not in code:
            for name in family_names:
                if re.search(rf"\b{name}\b|\bTFormat|\b{name}_family", code):
                    yield number, f"names the family {name}"
        include = re.match(r"#include \"([^\"]+)\"", code)
        if include and (ROOT / include[1]).exists():
            rule = room_breach(path, include[1])
            if rule:
                yield number, rule


def types_of(text):
    """The line and the full name of each type that is defined in a namespace with a name."""
    namespaces = []
    for number, line in enumerate(text.splitlines(), 1):
        if (namespace := NAMESPACE.match(line)):
            namespaces.append(namespace[1])
        elif line.startswith("}  // namespace"):
            namespaces.pop()
        elif (defined := TYPE.match(line)) and all(namespaces):
            yield number, "::".join((*namespaces, defined[1]))


def defined_twice(sources):
    """Breaches as (path, line, rule): types with the name of another one. No program has both the client library and drivers."""
    first = {}
    for path, text in sources.items():
        if is_test(path) or path.startswith("bench/"):
            continue
        for line, name in types_of(text):
            before = first.setdefault(name, path)
            if before != path and {before.split("/")[0], path.split("/")[0]} != {"client", "drivers"}:
                yield path, line, f"{name} is defined in {before}, too"


def main():
    names = families()
    found = 0
    sources = {path: (ROOT / path).read_text(encoding="utf-8") for path in tracked_sources()}
    found_in_files = [(path, *breach) for path, text in sources.items() for breach in breaches(path, text, names)]
    for path, line, rule in (*found_in_files, *defined_twice(sources)):
        print(f"{path}:{line}: {rule}")
        found += 1
    print(f"{found} breaches in {len(sources)} files; families: {', '.join(names)}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
