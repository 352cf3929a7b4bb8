#!/usr/bin/env python3
"""A man page from a page of docs/: doc_page.py MARKDOWN NAME[,NAME...] SECTION WHAT VERSION CHANGELOG OUT

lowdown does the work. Links between the pages of docs/ become plain words: a terminal cannot follow them.
"""

import pathlib
import re
import subprocess
import sys

from cli_pages import changelog_date


def cells(row):
    return [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", row.strip()[1:-1])]


def listed(table):
    """A table as a list, because a terminal is narrow: what the first column names, then the other ones."""
    heading = cells(table[0])
    items = []
    for row in table[2:]:
        name, *middle, last = cells(row)
        told = [f"{title}: {cell}" if title else cell for title, cell in zip(heading[1:], middle) if cell]
        items.append(f"- {name}{' (' + '; '.join(told) + ')' if told else ''}: {last}\n")
    return items


def without_tables(lines):
    table = []
    for line in [*lines, ""]:
        if line.startswith("|"):
            table.append(line)
            continue
        if table:
            yield from ["", *listed(table)]
            table = []
        yield line


def prepared(markdown, names, what):
    """The page under the headings of a manual: its title becomes NAME, the text before the first heading DESCRIPTION."""
    text = markdown.split("\n", 1)[1]
    text = re.sub(r"\[([^\]]+)\]\((?!https?:)[^)]*\)", r"\1", text)
    lines, code = [], False
    for line in text.splitlines():
        code ^= line.startswith("```")
        heading = re.match(r"#(#+) (.*)", line)
        lines.append(f"{heading[1]} {heading[2].replace('`', '')}" if heading and not code else line)
    return f"# NAME\n\n{', '.join(names)} - {what}\n\n# DESCRIPTION\n" + "\n".join(without_tables(lines)) + "\n"


def main():
    source, names, section, what, version, changelog, out = sys.argv[1:]
    names = names.split(",")
    page = subprocess.run(
        ["lowdown", "-s", "-tman", "-M", f"title={names[0].upper()}", "-M", f"section={section}",
         "-M", f"source=axlecast {version}", "-M", "volume=axlecast", "-M", f"date={changelog_date(changelog)}"],
        input=prepared(pathlib.Path(source).read_text(), names, what), text=True, check=True,
        stdout=subprocess.PIPE).stdout
    page = page.replace(r"\fC", r"\fB")  # the code font, which no terminal has
    page = re.sub(r"(\n\.S[HS]\n.*\n)\.[LP]P\n", r"\1", page)
    folder = pathlib.Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{names[0]}.{section}").write_text(page)
    for alias in names[1:]:
        (folder / f"{alias}.{section}").write_text(f".so man{section}/{names[0]}.{section}\n")


if __name__ == "__main__":
    main()
