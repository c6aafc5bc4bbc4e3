"""Texts in the EXIF of a photograph: its description and the comment of its user."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

_DESCRIPTION, _EXIF_PART, _COMMENT = 0x010E, 0x8769, 0x9286
_SIZES = {
    1: 1,
    2: 1,
    3: 2,
    4: 4,
    5: 8,
    6: 1,
    7: 1,
    8: 2,
    9: 4,
    10: 8,
    13: 4,
}  # bytes by type of entry
_CODES = {b"ASCII\0\0\0": "latin-1", b"UNICODE\0": "utf-16", b"\0\0\0\0\0\0\0\0": "utf-8"}
_MOST_ENTRIES = 500


class _Order(NamedTuple):
    data: bytes
    little: bool

    def number(self, at: int, size: int) -> int:
        word = self.data[at : at + size]
        return int.from_bytes(word, "little" if self.little else "big")


def exif_texts(photograph: bytes) -> list[str]:
    """Return the texts in the EXIF of a JPEG, PNG or TIFF file, UserComment first.

    Nothing is raised for files that are damaged or have no EXIF: there are then no texts.
    """
    block = _block(photograph)
    if block[:4] not in (b"II*\0", b"MM\0*"):
        return []
    order = _Order(block, block[:2] == b"II")
    comments: list[str] = []
    descriptions: list[str] = []
    for tag, value in _entries(order, order.number(4, 4)):
        if tag == _DESCRIPTION:
            descriptions.append(value.decode("utf-8", "replace"))
        elif tag == _EXIF_PART:
            start = _Order(value, order.little).number(0, 4)
            for inner, comment in _entries(order, start):
                if inner == _COMMENT:
                    comments.append(_comment(comment, order.little))
    texts = (text.replace("\0", " ").strip() for text in comments + descriptions)
    return [text for text in texts if text]


def _comment(value: bytes, little: bool) -> str:
    code = _CODES.get(value[:8])
    text = value[8:] if code else value
    if code == "utf-16":
        code = "utf-16-le" if little else "utf-16-be"
    return text.decode(code or "utf-8", "replace")


def _entries(order: _Order, start: int) -> Iterator[tuple[int, bytes]]:
    """Yield tags and bytes of a directory; none where it lies outside the block."""
    if not 8 <= start <= len(order.data) - 2:
        return
    for number in range(min(order.number(start, 2), _MOST_ENTRIES)):
        at = start + 2 + 12 * number
        if at + 12 > len(order.data):
            return
        size = _SIZES.get(order.number(at + 2, 2), 1) * order.number(at + 4, 4)
        where = at + 8 if size <= 4 else order.number(at + 8, 4)
        if where + size <= len(order.data):
            yield order.number(at, 2), order.data[where : where + size]


def _block(data: bytes) -> bytes:
    """Return the EXIF block, laid out as a TIFF file; empty if there is none."""
    if data[:4] in (b"II*\0", b"MM\0*"):
        return data
    if data[:8] == b"\x89PNG\r\n\x1a\n":
        at = 8
        while at + 8 <= len(data):
            length = int.from_bytes(data[at : at + 4], "big")
            if data[at + 4 : at + 8] == b"eXIf":
                return data[at + 8 : at + 8 + length]
            at += 12 + length
    elif data[:2] == b"\xff\xd8":
        at = 2
        while at + 4 <= len(data) and data[at] == 0xFF and data[at + 1] != 0xDA:
            length = int.from_bytes(data[at + 2 : at + 4], "big")
            if data[at + 1] == 0xE1 and data[at + 4 : at + 10] == b"Exif\0\0":
                return data[at + 10 : at + 2 + length]
            at += 2 + max(length, 2)
    return b""
