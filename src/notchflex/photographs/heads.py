"""Heads of image files: segments of JPEG, directories of TIFF."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

PNG = b"\x89PNG\r\n\x1a\n"
"""The first bytes of a PNG."""

_LITTLE, _BIG = b"II*\0", b"MM\0*"
# Bytes of a value, by the type of an entry.
_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 13: 4}
_MOST_ENTRIES = 500
_IMAGE = 0xDA


class Entry(NamedTuple):
    """An entry of a directory.

    Attributes:
        tag: What it tells.
        kind: The type of its values.
        value: Their bytes.
    """

    tag: int
    kind: int
    value: bytes


class Tiff(NamedTuple):
    """A TIFF file, or an EXIF block, which is laid out as one.

    Attributes:
        data: Its bytes.
        order: Their order in numbers.
    """

    data: bytes
    order: Literal["little", "big"]

    @property
    def entries(self) -> Iterator[Entry]:
        """Entries of the first directory."""
        return self.entries_at(self.number(self.data[4:8]))

    def entries_at(self, start: int) -> Iterator[Entry]:
        """Yield the entries of a directory; none where it lies outside the file."""
        if not 8 <= start <= len(self.data) - 2:
            return
        for number in range(min(self.number(self.data[start : start + 2]), _MOST_ENTRIES)):
            entry = self.data[start + 2 + 12 * number : start + 14 + 12 * number]
            if len(entry) < 12:
                return
            tag, kind = self.number(entry[:2]), self.number(entry[2:4])
            size = _SIZES.get(kind, 1) * self.number(entry[4:8])
            value = entry[8 : 8 + size]
            if size > 4:
                where = self.number(entry[8:12])
                value = self.data[where : where + size]
            if len(value) == size:
                yield Entry(tag, kind, value)

    def number(self, word: bytes) -> int:
        """Return the number that some bytes stand for."""
        return int.from_bytes(word, self.order)


def tiff_of(data: bytes) -> Tiff | None:
    """Return bytes as a TIFF; None if they are another file."""
    if data[:4] == _LITTLE:
        return Tiff(data, "little")
    return Tiff(data, "big") if data[:4] == _BIG else None


def jpeg_segments(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield marker and content of the segments of a JPEG before its image; none of other files."""
    if data[:2] != b"\xff\xd8":
        return
    at = 2
    while at + 4 <= len(data) and data[at] == 0xFF and data[at + 1] != _IMAGE:
        if data[at + 1] == 0xFF:  # fills up
            at += 1
            continue
        length = max(int.from_bytes(data[at + 2 : at + 4], "big"), 2)
        yield data[at + 1], data[at + 4 : at + 2 + length]
        at += 2 + length
