#!/usr/bin/env python3
"""Checks the rules of docs/architecture.md that a compiler does not see: every external world is reached from one
place, the runtime names no device, a family does no I/O and includes no other one. Prints each breach as file:line: rule;
exits 1 on any."""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]

# An external world: the pattern that reaches it, and the only files that may.
WORLDS = [
    ("LCM", r"#include [<\"]lcm/lcm[.-]", r"drivers/io/lcm_port\.cpp|client/example/.*|bench/.*"),
    ("LCM's datagrams", r"IP_ADD_MEMBERSHIP|\brecvmmsg", r"drivers/io/(multicast_probe|multicast_port)\.cpp|bench/.*"),
    ("serial line", r"termios|termbits|\bTIOC[A-Z]+", r"drivers/io/(tty|adapter|pty|pty_mark|line_guard|terminal_keys)(_test)?\.(cpp|h)|bench/.*"),
    ("clock", r"clock_gettime|std::chrono|\bgettimeofday|\bclock_nanosleep|std::this_thread::sleep",
     r"drivers/io/system_clock\.cpp|client/example/.*|bench/.*"),
    ("SPI", r"linux/spi", r"drivers/io/spi_port\.cpp|tests/vm/cuse_spidev\.cpp"),
    ("CAN", r"#include <linux/can", r"drivers/io/can_(socket|netlink|error)\.cpp"),
    ("Modbus", r"#include <modbus", r"drivers/io/modbus_port\.cpp"),
    ("MQTT", r"#include <(mosquitto|mqtt_protocol)\.h", r"drivers/io/mqtt_link\.cpp"),
    ("GPIO", r"gpiod\.h", r"drivers/io/gpio_line(_test)?\.cpp"),
    ("process", r"sys/(prctl|resource|mman)\.h|\bsched_set[a-z]+\(",
     r"drivers/io/(process(_test)?|host_system|mapped_region)\.cpp|tools/axlecast/(child|simulation_server)\.cpp|bench/.*"),
    ("SQLite", r"sqlite3\.h", r"bridge/store/database\.cpp"),
    ("HTTP and WebSockets", r"libwebsockets\.h", r"drivers/io/web_server\.cpp"),
    ("systemd", r"systemd/", r"drivers/io/supervision\.cpp"),
]
MAX_LINES = 800
MAX_TEST_LINES = 800


def tracked_sources():
    listing = subprocess.run(["git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard", "*.h", "*.cpp"],
                             check=True, capture_output=True, text=True).stdout
    return sorted(path for path in listing.split() if (ROOT / path).exists())


def families():
    return [path.parent.name for path in (ROOT / "drivers").glob("*/family.cpp")]


def breaches(path, text, family_names):
    lines = text.splitlines()
    limit = MAX_TEST_LINES if path.endswith("_test.cpp") else MAX_LINES
    if len(lines) > limit:
        yield 1, f"{len(lines)} lines, at most {limit}: is this still one concept?"
    family_neutral = re.match(r"(drivers/(runtime|io)|bridge|client|tools)/", path) and not path.endswith("_test.cpp")
    own = next((name for name in family_names if path.startswith(f"drivers/{name}/")), None)
    for number, line in enumerate(lines, 1):
        for world, pattern, allowed in WORLDS:
            if re.search(pattern, line) and not re.fullmatch(allowed, path):
                yield number, f"{world} is reached from here; only {allowed} may"
        code = line.split("//")[0]
        if family_neutral:
            for name in family_names:
                if re.search(rf"\b{name}\b|\bTFormat|\b{name}_family", code) and '"' not in code:
                    yield number, f"names the family {name}"
            if re.search(rf"#include \"drivers/({'|'.join(family_names)})/", code):
                yield number, "includes a family"
        if own and re.search(r"#include \"drivers/io/", code) and not path.endswith("_test.cpp"):
            yield number, "a family does no I/O"
        other = re.match(rf"#include \"drivers/({'|'.join(family_names)})/", code)
        if own and other and other[1] != own:
            yield number, f"includes another family, {other[1]}"


def main():
    names = families()
    found = 0
    for path in tracked_sources():
        for line, rule in breaches(path, (ROOT / path).read_text(encoding="utf-8"), names):
            print(f"{path}:{line}: {rule}")
            found += 1
    print(f"{found} breaches in {len(tracked_sources())} files; families: {', '.join(names)}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
