"""The bytes of a log file at the size that it had when it was opened. Reads any place in constant memory."""

from __future__ import annotations

import errno
import os
import pathlib
import stat
from typing import BinaryIO

from axlecast import compressed_log

WINDOW = 1 << 20  # bytes that are read at once
_GLANCE = 4 << 10  # bytes that are read at another place


class LogFile:
    """The content of a log, decompressed if it is compressed. A context manager: afterwards the file is closed."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """If `path` does not exist and `path`.zst does, that file is read.

        Raises OSError if the file cannot be read, or if the folder for temporary files has no space for the content of a compressed log,
        and ModuleNotFoundError if the log is compressed and the module zstandard is missing.
        """
        self.path = _found(pathlib.Path(path))
        self.truncated = False  #: the file has become smaller than `size`: the missing bytes are read as zeros
        self.damage: list[tuple[int, int]] = []  #: offset and size, bytes, of what could not be decompressed
        self._file = _open(self.path)
        try:
            if compressed_log.is_compressed(self._file, self.path):
                content, self.damage = compressed_log.decompress(self._file, self.path)
                self._file.close()
                self._file = content
            self.size = os.fstat(self._file.fileno()).st_size  #: bytes
        except BaseException:
            self._file.close()
            raise

    def close(self) -> None:
        """Closes the file: nothing can be read any more."""
        self._file.close()

    def read(self, offset: int, size: int) -> bytes:
        """Returns `size` bytes from `offset` on, which must be in the file. Raises OSError if the disk fails."""
        data = _read(self._file, offset, size)
        if len(data) < size:
            self.truncated = True
            data += bytes(size - len(data))
        return data


def _read(file: BinaryIO, offset: int, size: int) -> bytes:
    """Returns less than `size` bytes only at the end of the file."""
    data = os.pread(file.fileno(), size, offset)
    while 0 < len(data) < size and (more := os.pread(file.fileno(), size - len(data), offset + len(data))):
        data += more
    return data


def _found(path: pathlib.Path) -> pathlib.Path:
    compressed = path.with_name(path.name + compressed_log.ENDING)
    return compressed if not os.path.lexists(path) and compressed.exists() else path


def _open(path: pathlib.Path) -> BinaryIO:
    # Without O_NONBLOCK, a FIFO would wait for a writer.
    file = open(path, "rb", buffering=0, opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))
    if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        return file
    file.close()
    raise OSError(errno.EINVAL, "is no regular file", str(path))


class Windows:
    """A piece of a log that is kept in memory, and the one before it: a reader looks ahead of the event that it reads."""

    def __init__(self, file: LogFile) -> None:
        self._file = file
        self._begin = self._before_begin = 0
        self._bytes = self._before = b""

    def at(self, offset: int, size: int) -> tuple[bytes, int]:
        """Returns a piece with at least `size` bytes from `offset` on, which must be in the file, and the offset of its first byte."""
        if not self._begin <= offset <= self._begin + len(self._bytes) - size:
            self._begin, self._before_begin = self._before_begin, self._begin
            self._bytes, self._before = self._before, self._bytes
            if not self._begin <= offset <= self._begin + len(self._bytes) - size:
                self._load(offset, size)
        return self._bytes, self._begin

    def _load(self, offset: int, size: int) -> None:
        """Reads much only where reading continues: a damaged length leads anywhere."""
        continues = self._before_begin <= offset <= self._before_begin + len(self._before)
        self._begin = offset
        self._bytes = self._file.read(offset, min(max(size, WINDOW if continues else _GLANCE), self._file.size - offset))
