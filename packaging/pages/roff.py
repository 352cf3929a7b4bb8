"""A man page, written line by line in the classic macros.

Pages of docs/ go through lowdown (doc_page.py). The pages of the command line do not: their source is not Markdown. Their
texts would have to be escaped for Markdown first, which takes more rules than escaping for roff, to write the same macros.
"""

import re


def escaped(text):
    text = text.replace("\\", r"\e").replace("-", r"\-")
    return re.sub(r"^(?=[.'])", r"\\&", text, flags=re.MULTILINE)


class Page:
    def __init__(self, name, section, what, release, date):
        self._lines = [f'.TH {name.upper()} {section} "{date}" "{release}" "axlecast"', ".SH NAME",
                       rf"{escaped(name)} \- {escaped(what)}"]

    def section(self, title):
        self._lines.append(f".SH {title}")

    def subsection(self, title):
        self._lines.append(f".SS {escaped(title)}")

    def paragraph(self, text):
        if not self._lines[-1].startswith((".SH", ".SS")):
            self._lines.append(".PP")
        self._lines.append(escaped(text))

    def item(self, heading, text):
        """`heading` is roff already."""
        self._lines += [".TP", heading, escaped(text)]

    def verbatim(self, lines):
        self._lines += [".nf", *(escaped(line) for line in lines), ".fi"]

    def raw(self, text):
        self._lines.append(text)

    def text(self):
        return "\n".join(self._lines) + "\n"
