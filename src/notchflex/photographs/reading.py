"""Reading a photograph: any depth and any number of channels, turned as its EXIF says."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex._extras import need
from notchflex.errors import InputError
from notchflex.photographs.heads import PNG, Tiff, jpeg_segments, tiff_of

MOST_PIXELS = 120e6
LARGEST_FILE = 400_000_000
_LEAST_SIDE = 64


def read_photograph(source: str | os.PathLike[str]) -> NDArray[np.uint8]:
    """Return a photograph as blue, green, red of 8 bits, (height, width, 3).

    Raises:
        InputError: There is no such file, it is not a photograph, or it is too large or too small.
    """
    need("cv2", "photographs", "measuring photographs")
    name = os.fspath(source)
    data = photograph_bytes(name)
    size = _size_in_head(data)
    _check_size(name, *size)
    image = _decoded(data) if min(size) > 0 else None
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
        data = b"" if is_folder or size > LARGEST_FILE else path.read_bytes()
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


def _size_in_head(data: bytes) -> tuple[int, int]:
    """Return width and height by the head of a PNG, JPEG or TIFF, before it is decoded.

    Files of another kind, whose size is not known beforehand, give (0, 0) and are not decoded.
    """
    if data.startswith(PNG):
        return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    if (tiff := tiff_of(data)) is not None:
        return _size_of_tiff(tiff)
    for marker, content in jpeg_segments(data):
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height = int.from_bytes(content[1:3], "big")
            return int.from_bytes(content[3:5], "big"), height
    return 0, 0


def _size_of_tiff(tiff: Tiff) -> tuple[int, int]:
    size = {256: 0, 257: 0}  # tags of width and height
    for tag, kind, value in tiff.entries:
        if tag in size and kind in (3, 4):  # numbers of 16 or of 32 bits
            size[tag] = tiff.number(value[: 2 if kind == 3 else 4])
    return size[256], size[257]


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
