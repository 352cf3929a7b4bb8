#!/usr/bin/env python3
"""The picture of the rooms in docs/architecture.md is that of the build: each folder with a library, and an arrow to each
room that its library is linked with. Arrows that follow from others are left out.

    tests/docs/rooms.py build/gcc/rooms.txt FOLDER             compares
    tests/docs/rooms.py build/gcc/rooms.txt FOLDER --write     writes the picture into docs/architecture.md"""

import pathlib
import re
import sys

BEGIN, END = "<!-- rooms: written by tests/docs/rooms.py -->", "<!-- end of rooms -->"
# Folders that are one room of the picture, by the beginning of their path; the first that fits counts.
ROOMS = ("core", "platform", "drivers/hal", "drivers/protocol", "drivers/kit", "drivers/runtime", "drivers/saa/",
         "drivers/FAMILY", "bridge", "client", "tools/axlecast", "tools")


def room_of(folder):
    for room in ROOMS:
        if (folder + "/").startswith(room.rstrip("/") + "/"):
            return room.rstrip("/")
    return "drivers/FAMILY" if folder.startswith("drivers/") else None


def edges_between_rooms(text):
    folders, depends = {}, {}
    for line in text.splitlines():
        folder, target, names = (line.split(" ") + [""])[:3]
        folders[target], depends[target] = folder, names.split(",")
    found = set()
    for target, names in depends.items():
        one = room_of(folders[target])
        for name in names:
            other = room_of(folders[name]) if name in folders else None
            if one and other and one != other:
                found.add((one, other))
    return found


def reachable(edges, start, without):
    seen, waiting = set(), [start]
    while waiting:
        at = waiting.pop()
        for one, other in edges:
            if one == at and (one, other) != without and other not in seen:
                seen.add(other)
                waiting.append(other)
    return seen


def picture(text):
    edges = edges_between_rooms(text)
    shown = sorted((one, other) for one, other in edges if other not in reachable(edges, one, (one, other)))
    name = lambda room: re.sub(r"\W", "_", room)
    rooms = sorted({room for edge in edges for room in edge}, key=lambda room: (-len(reachable(edges, room, None)), room))
    lines = ["```mermaid", "flowchart TD", *(f'  {name(room)}["{room}"]' for room in rooms),
             *(f"  {name(one)} --> {name(other)}" for one, other in shown), "```"]
    return "\n".join(lines)


def main(rooms, folder, write=False):
    page = pathlib.Path(folder, "docs/architecture.md")
    text = page.read_text()
    before, rest = text.split(BEGIN)
    shown, after = rest.split(END)
    true = f"\n{picture(pathlib.Path(rooms).read_text())}\n"
    if write:
        page.write_text(before + BEGIN + true + END + after)
    elif shown != true:
        print(f"{page}: the picture of the rooms is not that of the build. Write it with {sys.argv[0]} {rooms} {folder} --write")
        return 1
    return 0


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4) or sys.argv[3:] not in ([], ["--write"]):
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], sys.argv[2], bool(sys.argv[3:])))
