"""Texts in the EXIF of a photograph: its description and the comment of its user."""

from __future__ import annotations

from notchflex.photographs.heads import head_of

_DESCRIPTION, _COMMENT = 0x010E, 0x9286
_CODES = {b"ASCII\0\0\0": "latin-1", b"UNICODE\0": "utf-16", b"\0\0\0\0\0\0\0\0": "utf-8"}


def exif_texts(photograph: bytes) -> list[str]:
    """Return the texts in the EXIF of a JPEG, PNG or TIFF file, UserComment first.

    Nothing is raised for files that are damaged or have no EXIF: there are then no texts.
    """
    head = head_of(photograph, exif=True)
    if head is None:
        return []
    comment, description = (_bytes(head.tags.get(tag)) for tag in (_COMMENT, _DESCRIPTION))
    texts = _comment(comment, head.order), description.decode("utf-8", "replace")
    return [text for one in texts if (text := one.replace("\0", " ").strip())]


def _bytes(value: object) -> bytes:
    """Return the bytes of a value, which Pillow gives as latin-1 where its type is text."""
    text = value.encode("latin-1", "replace") if isinstance(value, str) else value
    return text if isinstance(text, bytes) else b""


def _comment(value: bytes, order: str) -> str:
    code = _CODES.get(value[:8])
    if code == "utf-16":
        code = "utf-16-le" if order == "<" else "utf-16-be"
    return (value[8:] if code else value).decode(code or "utf-8", "replace")
