"""Reading a photograph: any depth and any number of channels, turned as its EXIF says."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex._extras import need
from notchflex.errors import InputError
from notchflex.photographs.heads import MOST_PIXELS, head_of

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
