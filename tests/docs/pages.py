"""The pages of the documentation: every .md file of the source, without what builds and tests leave behind."""

import os
from pathlib import Path

NOT_SOURCE = {"build", "node_modules", ".git"}


def pages_of(top):
    """The pages under `top`, sorted. Tests that run at the same time make and delete folders in build/, which are not entered."""
    pages = []
    for folder, folders, files in os.walk(top):
        folders[:] = [name for name in folders if name not in NOT_SOURCE]
        pages += [Path(folder) / file for file in files if file.endswith(".md")]
    return sorted(pages)
