#!/usr/bin/env python3
"""Every link of the documentation leads somewhere: files exist, and so do the headings that are named.

    tests/docs/links.py FOLDER"""

import re
import sys
from pathlib import Path

from pages import pages_of

LINK = re.compile(r"(?<!!)\[[^\]\[]*(?:\[[^\]]*\][^\]\[]*)*\]\(([^)\s]+)\)")
PICTURE = re.compile(r"!\[[^\]]*\]\(([^)\s]+)\)")
FENCE = re.compile(r"^(```|~~~)")
HEADING = re.compile(r"^#{1,6}\s+(.*?)\s*#*$")


def prose(text):
    """The text without code: neither blocks nor `spans` hold links."""
    lines, fenced = [], False
    for line in text.splitlines():
        if FENCE.match(line.lstrip()):
            fenced = not fenced
            line = ""
        lines.append("" if fenced else re.sub(r"`[^`]*`", lambda span: "x" * len(span.group()), line))
    return "\n".join(lines)


def anchors(path):
    """The anchors that a heading gets: lower case, spaces to hyphens, other signs left out, repeated ones numbered."""
    found, fenced = {}, False
    for line in path.read_text().splitlines():
        if FENCE.match(line.lstrip()):
            fenced = not fenced
        heading = None if fenced else HEADING.match(line)
        if not heading:
            continue
        title = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.group(1))
        anchor = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
        count = found.get(anchor, 0)
        found[anchor] = count + 1
        if count:
            found[f"{anchor}-{count}"] = 1
    return found


def problem(page, link, top):
    if re.match(r"^[a-z]+:", link):
        return None  # another host's: not asked, the tests need no network
    name, _, anchor = link.partition("#")
    target = (page.parent / name).resolve() if name else page
    if not target.exists():
        return "no such file"
    if top not in target.parents and target != top:
        return "leads out of the project"
    if anchor and target.suffix == ".md" and anchor not in anchors(target):
        return "no such heading"
    return None


def main():
    top = Path(sys.argv[1]).resolve()
    pages = pages_of(top)
    links = bad = 0
    for page in pages:
        text = page.read_text()
        for number, line in enumerate(prose(text).splitlines(), 1):
            for link in LINK.findall(line) + PICTURE.findall(line):
                links += 1
                if why := problem(page, link, top):
                    bad += 1
                    print(f"{page.relative_to(top)}:{number}: {link}: {why}")
    print(f"{links} links on {len(pages)} pages, {bad} dead")
    return 1 if bad or not links else 0


if __name__ == "__main__":
    sys.exit(main())
