"""Writes files into a C++ source: the table that tools/web/page_files.h declares.

Usage: embed_files.py OUTPUT FILE...
"""

import hashlib
import sys
from pathlib import Path

TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".ico": "image/x-icon",
    ".woff2": "font/woff2",
    ".txt": "text/plain; charset=utf-8",
    ".webmanifest": "application/manifest+json",
}


def array(number, content):
    numbers = ",".join(map(str, content))
    return f"constexpr unsigned char kFile{number}[] = {{{numbers}}};\n"


def entry(number, path, content):
    tag = hashlib.sha256(content).hexdigest()[:16]
    text = f"std::string_view(reinterpret_cast<const char*>(kFile{number}), sizeof kFile{number})"
    return f'      PageFile{{"{path.name}", "{TYPES[path.suffix]}", "\\"{tag}\\"", {text}}},\n'


def main(output, *names):
    paths = sorted(map(Path, names), key=lambda path: path.name)
    contents = [path.read_bytes() for path in paths]
    unknown = [str(path) for path in paths if path.suffix not in TYPES or not path.stat().st_size]
    if unknown:
        sys.exit(f"of no known type, or empty: {' '.join(unknown)}")
    arrays = "".join(array(number, content) for number, content in enumerate(contents))
    entries = "".join(entry(number, path, contents[number]) for number, path in enumerate(paths))
    Path(output).write_text(
        f"""#include <array>

#include "tools/web/page_files.h"

namespace axlecast {{
namespace {{

{arrays}
}}  // namespace

std::span<const PageFile> PageFiles() {{
  static const std::array files = {{
{entries}  }};
  return files;
}}

}}  // namespace axlecast
""")


if __name__ == "__main__":
    main(*sys.argv[1:])
