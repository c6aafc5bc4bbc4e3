"""Reading a photograph: any depth and any number of channels, turned as its EXIF says."""

from __future__ import annotations

import io
import os
import struct
import warnings
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex import InputError
from notchflex.support import bounded_bytes, need

MOST_PIXELS = 120e6
"""A picture of more pixels is not decoded."""

_DAMAGED = (
    SyntaxError, ValueError, TypeError, OSError, EOFError, LookupError, ArithmeticError,
    struct.error, zlib.error,
)  # fmt: skip
_SIDES, _EXIF_PART = (256, 257), 0x8769  # tags of TIFF


class Head(NamedTuple):
    """Head of an image file.

    Attributes:
        width: Width, pixels; 0 where it is not stated.
        height: Height, pixels; likewise.
        tags: Values of the tags of its EXIF, by their numbers; of a TIFF always.
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
    from PIL import Image, JpegImagePlugin, PngImagePlugin

    block = Image.Exif()
    with warnings.catch_warnings():  # Pillow warns of damaged tags, which it leaves out
        warnings.simplefilter("ignore")
        try:
            if data[:4] in (b"II*\0", b"MM\0*"):
                block.load(data)
                width, height = (block.get(tag) for tag in _SIDES)
            else:
                # `Image.open` would refuse large pictures without telling how large they are.
                is_jpeg, file = data[:2] == b"\xff\xd8", io.BytesIO(data)
                reader: Any = (
                    JpegImagePlugin.JpegImageFile if is_jpeg else PngImagePlugin.PngImageFile
                )
                picture = reader(file)
                width, height = picture.size
                if exif and width * height <= MOST_PIXELS:
                    block = picture.getexif()
            tags = {**block.get_ifd(_EXIF_PART), **block}
        except _DAMAGED:
            return None
    width, height = (side if isinstance(side, int) and side > 0 else 0 for side in (width, height))
    return Head(width, height, tags, block.endian or "<")


LARGEST_FILE = 400_000_000
_LONGEST_SHAPE = 50
_LEAST_SIDE = 64


def read_photograph(source: str | os.PathLike[str]) -> NDArray[np.uint8]:
    """Return a photograph as blue, green, red of 8 bits, (height, width, 3).

    Raises:
        InputError: There is no such file, it is not a photograph, or it is too large or too small.
    """
    need("cv2", "photographs", "measuring photographs")
    name = os.fspath(source)
    data = photograph_bytes(name)
    head = head_of(data)
    width, height = (0, 0) if head is None else head[:2]
    _check_size(name, width, height)
    image = _decoded(data) if min(width, height) > 0 else None
    if image is None or image.ndim != 3:
        raise InputError.FILE_FORMAT(
            f"{name} is not a photograph that can be read; give a PNG, JPEG or TIFF file"
        )
    _check_size(name, image.shape[1], image.shape[0])
    return image


def _decoded(data: bytes) -> Any:
    """Return the picture, or None; OpenCV's own words on bad files are not shown."""
    import cv2

    logging: Any = getattr(cv2.utils, "logging", None)
    level = None if logging is None else logging.setLogLevel(logging.LOG_LEVEL_SILENT)
    try:
        return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:
        return None
    finally:
        if logging is not None:
            logging.setLogLevel(level)


def photograph_bytes(name: str) -> bytes:
    """Return the bytes of a file that may be a photograph.

    Raises:
        InputError: There is no such file, it cannot be read, or it is too large.
    """
    try:
        path = Path(name)
        is_folder, size = path.is_dir(), path.stat().st_size
        data = b"" if is_folder or size > LARGEST_FILE else bounded_bytes(path, LARGEST_FILE)
    except (FileNotFoundError, NotADirectoryError):
        raise InputError.FILE_NOT_FOUND(
            f"there is no photograph {name}; check the name and the folder it is in"
        ) from None
    except (OSError, ValueError) as problem:
        words = getattr(problem, "strerror", None) or problem
        raise InputError.FILE_UNREADABLE(f"{name} cannot be read: {words}") from None
    if is_folder:
        raise InputError.FILE_FORMAT(f"{name} is a folder; name the photographs in it")
    if size > LARGEST_FILE:
        raise InputError.OUT_OF_RANGE(
            f"{name} is larger than {LARGEST_FILE / 1e6:.0f} MB; give a smaller photograph"
        )
    return data


def _check_size(name: str, width: int, height: int) -> None:
    if width * height > MOST_PIXELS:
        raise InputError.OUT_OF_RANGE(
            f"{name} has {width} x {height} pixels; at most {MOST_PIXELS / 1e6:.0f} million are "
            "read, make it smaller"
        )
    if width and min(width, height) < _LEAST_SIDE:
        raise InputError.OUT_OF_RANGE(
            f"{name} has {width} x {height} pixels; each side needs {_LEAST_SIDE} or more"
        )
    if max(width, height) > _LONGEST_SHAPE * min(width, height):
        raise InputError.OUT_OF_RANGE(
            f"{name} has {width} x {height} pixels; no side may be more than {_LONGEST_SHAPE} "
            "times the other, cut it to the robot"
        )
