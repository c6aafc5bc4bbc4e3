"""What Pillow reads in the head of a PNG, JPEG or TIFF file: its size and its EXIF."""

from __future__ import annotations

import io
import struct
import warnings
import zlib
from collections.abc import Mapping
from typing import Any, NamedTuple

from notchflex._extras import need

MOST_PIXELS = 120e6
"""A picture of more pixels is not decoded."""

_DAMAGED = (
    SyntaxError, ValueError, TypeError, OSError, EOFError, LookupError, ArithmeticError,
    struct.error, zlib.error,
)  # fmt: skip
_WIDTH, _HEIGHT, _EXIF_PART = 256, 257, 0x8769


class Head(NamedTuple):
    """Head of an image file.

    Attributes:
        width: Width, pixels; 0 where it is not stated.
        height: Height, pixels; likewise.
        tags: Values of the tags of its EXIF, or of a TIFF, by their numbers.
        order: Order of the bytes in them, "<" or ">".
    """

    width: int
    height: int
    tags: Mapping[int, Any]
    order: str


def head_of(data: bytes, exif: bool = False) -> Head | None:
    """Read the head of a file; None if it is damaged, or neither PNG, JPEG nor TIFF.

    The picture is decoded only if the EXIF of a PNG is asked for and does not stand before the
    picture, and never if it has more than `MOST_PIXELS`.
    """
    need("PIL", "photographs", "reading photographs")
    with warnings.catch_warnings():  # Pillow warns of damaged tags, which it leaves out
        warnings.simplefilter("ignore")
        try:
            return _head(data, exif)
        except _DAMAGED:
            return None


def _head(data: bytes, exif: bool) -> Head:
    from PIL import JpegImagePlugin, PngImagePlugin

    if data[:4] in (b"II*\0", b"MM\0*"):
        tags, order = _tags(data)
        return Head(_side(tags.get(_WIDTH)), _side(tags.get(_HEIGHT)), tags, order)
    # `Image.open` would refuse large pictures without telling how large they are.
    if data[:2] == b"\xff\xd8":
        picture: Any = JpegImagePlugin.JpegImageFile(io.BytesIO(data))
    else:
        picture = PngImagePlugin.PngImageFile(io.BytesIO(data))
        if exif and "exif" not in picture.info and picture.width * picture.height <= MOST_PIXELS:
            picture.load()
    tags, order = _tags(picture.info.get("exif", b"")) if exif else ({}, "<")
    return Head(picture.width, picture.height, tags, order)


def _side(value: object) -> int:
    return value if isinstance(value, int) and value > 0 else 0


def _tags(block: bytes) -> tuple[Mapping[int, Any], str]:
    """Return the tags of an EXIF block, or of a TIFF, and the order of its bytes."""
    from PIL import Image

    found = Image.Exif()
    found.load(block)
    return {**found.get_ifd(_EXIF_PART), **found}, found.endian or "<"
