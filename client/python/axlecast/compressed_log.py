"""Compressed logs: Zstandard frames (RFC 8878) of the recorder or of the program zstd. A damaged frame does not hide the next ones."""

from __future__ import annotations

import os
import pathlib
import tempfile
from collections.abc import Callable, Iterator
from typing import Any, BinaryIO

ENDING = ".zst"

_MAGIC = 0xFD2FB528
_MAGIC_BYTES = _MAGIC.to_bytes(4, "little")
_SKIPPABLE, _SKIPPABLE_MASK = 0x184D2A50, 0xFFFFFFF0
_SYNC = bytes.fromhex("EDA1DA01")  # a log that is not compressed
_WINDOW = 128 << 20  # bytes: a frame that needs more memory counts as damaged, as for the program zstd
_PIECE = 1 << 20


def is_compressed(file: BinaryIO, path: pathlib.Path) -> bool:
    """Returns whether the content is compressed. The name decides only if the content is neither a log nor Zstandard."""
    head = os.pread(file.fileno(), 4, 0)
    return _begins_frame(head) or (path.name.endswith(ENDING) and head not in (b"", _SYNC))


def decompress(file: BinaryIO, path: pathlib.Path) -> tuple[BinaryIO, list[tuple[int, int]]]:
    """Returns a temporary file without a name that has the content, and (offset, size) in bytes of each damaged place in `file`.

    Raises ModuleNotFoundError without the module zstandard, and OSError if the folder for temporary files ($TMPDIR) is full.
    """
    try:
        import zstandard  # pylint: disable=import-outside-toplevel
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"{path} is compressed: install the package python3-zstandard, or decompress it with `zstd -d`",
                                  name=error.name) from None
    content = tempfile.TemporaryFile(prefix="axlecast-log-", buffering=0)
    try:
        return content, _Decompression(file, lambda data: _write(content, data), zstandard).run()
    except OSError as error:
        content.close()
        raise OSError(error.errno, f"{error.strerror}: {path} cannot be decompressed to {tempfile.gettempdir()}: set TMPDIR to a folder "
                                   "with enough space") from error
    except BaseException:
        content.close()
        raise


def _write(file: BinaryIO, data: bytes) -> None:
    left = memoryview(data)
    while left:
        left = left[file.write(left):]


def _begins_frame(head: bytes) -> bool:
    magic = int.from_bytes(head[:4], "little")
    return len(head) >= 4 and (magic == _MAGIC or magic & _SKIPPABLE_MASK == _SKIPPABLE)


class _Decompression:
    """Gives the content of all frames to `take`."""

    def __init__(self, file: BinaryIO, take: Callable[[bytes], None], zstandard: Any) -> None:
        self._file = file
        self._take = take
        self._error = zstandard.ZstdError
        self._decompressor = zstandard.ZstdDecompressor(max_window_size=_WINDOW)
        self._size = os.fstat(file.fileno()).st_size

    def run(self) -> list[tuple[int, int]]:
        """Returns offset and size of the damaged places."""
        damage = []
        position = 0
        while position < self._size:
            end = self._read_frame(position) if _begins_frame(self._read(position, 4)) else None
            if end is None:
                end = self._find_frame(position + 1)
                damage.append((position, end - position))
            position = end
        return damage

    def _read(self, offset: int, size: int) -> bytes:
        return os.pread(self._file.fileno(), size, offset)

    def _find_frame(self, begin: int) -> int:
        """Returns the offset of the next frame of content, else the size of the file."""
        while begin < self._size:
            piece = self._read(begin, _PIECE)
            found = piece.find(_MAGIC_BYTES)
            if found >= 0:
                return begin + found
            if len(piece) <= len(_MAGIC_BYTES):
                break
            begin += len(piece) - len(_MAGIC_BYTES) + 1
        return self._size

    def _read_frame(self, begin: int) -> int | None:
        """Returns the offset behind the frame; None if it is damaged or incomplete. Its content up to the damage is taken."""
        head = self._read(begin, 8)
        if head[:4] != _MAGIC_BYTES:
            end = begin + 8 + int.from_bytes(head[4:], "little")
            return end if len(head) == 8 and end <= self._size else None
        decompressing = self._decompressor.decompressobj()
        position = begin
        try:
            for piece in self._pieces(begin):
                self._take(decompressing.decompress(piece))
                position += len(piece)
                if decompressing.eof:
                    return position - len(decompressing.unused_data)
        except self._error:
            pass
        return None

    def _pieces(self, begin: int) -> Iterator[bytes]:
        """Returns the header of the frame and then its blocks one by one: the content of a block is lost only with the block itself."""
        position, size, last = begin, _header_size(self._read(begin, 5)), False
        while position < self._size:
            yield self._read(position, size)
            position += size
            if last:
                size = 4  # the checksum
                continue
            block = int.from_bytes(self._read(position, 3), "little")
            last = bool(block & 1)
            size = 3 + (1 if block >> 1 & 3 == 1 else block >> 3)


def _header_size(frame: bytes) -> int:
    """Returns the size of the header of a frame, with its magic, bytes."""
    described = frame[4] if len(frame) > 4 else 0
    single = bool(described & 0x20)
    content = (1 if single else 0, 2, 4, 8)[described >> 6]
    return 5 + (not single) + (0, 1, 2, 4)[described & 3] + content
