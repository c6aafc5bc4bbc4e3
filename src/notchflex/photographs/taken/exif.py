"""Texts in the EXIF of a photograph: its description and the comment of its user."""

from __future__ import annotations

from typing import Literal

from notchflex.photographs.heads import PNG, jpeg_segments, tiff_of

_DESCRIPTION, _EXIF_PART, _COMMENT = 0x010E, 0x8769, 0x9286
_CODES = {b"ASCII\0\0\0": "latin-1", b"UNICODE\0": "utf-16", b"\0\0\0\0\0\0\0\0": "utf-8"}
_EXIF, _APPLICATION = b"Exif\0\0", 0xE1


def exif_texts(photograph: bytes) -> list[str]:
    """Return the texts in the EXIF of a JPEG, PNG or TIFF file, UserComment first.

    Nothing is raised for files that are damaged or have no EXIF: there are then no texts.
    """
    block = tiff_of(_block(photograph))
    if block is None:
        return []
    comments: list[str] = []
    descriptions: list[str] = []
    for tag, _, value in block.entries:
        if tag == _DESCRIPTION:
            descriptions.append(value.decode("utf-8", "replace"))
        elif tag == _EXIF_PART:
            inner = block.entries_at(block.number(value[:4]))
            comments += [_comment(one.value, block.order) for one in inner if one.tag == _COMMENT]
    texts = (text.replace("\0", " ").strip() for text in comments + descriptions)
    return [text for text in texts if text]


def _comment(value: bytes, order: Literal["little", "big"]) -> str:
    code = _CODES.get(value[:8])
    text = value[8:] if code else value
    if code == "utf-16":
        code = "utf-16-le" if order == "little" else "utf-16-be"
    return text.decode(code or "utf-8", "replace")


def _block(data: bytes) -> bytes:
    """Return the EXIF block, laid out as a TIFF file; empty if there is none."""
    if tiff_of(data) is not None:
        return data
    if data.startswith(PNG):
        at = len(PNG)
        while at + 8 <= len(data):
            length = int.from_bytes(data[at : at + 4], "big")
            if data[at + 4 : at + 8] == b"eXIf":
                return data[at + 8 : at + 8 + length]
            at += 12 + length
    application = (content for marker, content in jpeg_segments(data) if marker == _APPLICATION)
    return next((one.removeprefix(_EXIF) for one in application if one.startswith(_EXIF)), b"")
