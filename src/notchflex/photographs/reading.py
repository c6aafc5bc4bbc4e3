"""Reading photographs, turned as their EXIF says, and the loads under which they were taken."""

from __future__ import annotations

import io
import math
import os
import re
import struct
import warnings
import zlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex import InputError, Robot
from notchflex.photographs.measured import PHOTOGRAPH
from notchflex.support import AnyPath, bounded_bytes, need, read_data_table

MOST_PIXELS = 120e6
"""A picture of more pixels is not decoded."""

_DAMAGED = (
    SyntaxError, ValueError, TypeError, OSError, EOFError, LookupError, ArithmeticError,
    struct.error, zlib.error,
)  # fmt: skip
_SIDES, _EXIF_PART = (256, 257), 0x8769  # tags of TIFF


def _head_of(data: bytes, exif: bool = False) -> tuple[int, int, dict[int, Any], str]:
    """Read the head of a file: width, height, tags of its EXIF by number, order of the bytes.

    Where it is damaged, or neither PNG, JPEG nor TIFF, width and height are 0. The picture is
    decoded only if the EXIF of a PNG is asked for and does not stand before the picture, and never
    if it has more than `MOST_PIXELS`.
    """
    need("PIL", "photographs", "reading photographs")
    from PIL import Image, JpegImagePlugin, PngImagePlugin

    block, sides, tags = Image.Exif(), (0, 0), dict[int, Any]()
    with warnings.catch_warnings(), suppress(*_DAMAGED):
        warnings.simplefilter("ignore")  # Pillow warns of damaged tags, which it leaves out
        if data[:4] in (b"II*\0", b"MM\0*"):
            block.load(data)
            sides = tuple(block.get(tag) for tag in _SIDES)
        else:
            # `Image.open` would refuse large pictures without telling how large they are.
            is_jpeg, file = data[:2] == b"\xff\xd8", io.BytesIO(data)
            plugin: Any = JpegImagePlugin if is_jpeg else PngImagePlugin
            picture = (plugin.JpegImageFile if is_jpeg else plugin.PngImageFile)(file)
            sides = picture.size
            if exif and math.prod(sides) <= MOST_PIXELS:
                block = picture.getexif()
        tags = {**block.get_ifd(_EXIF_PART), **block}
    width, height = (side if isinstance(side, int) and side > 0 else 0 for side in sides)
    return width, height, tags, block.endian or "<"


LARGEST_FILE = 400_000_000
_LONGEST_SHAPE = 50
_LEAST_SIDE = 64


def read_photograph(source: AnyPath) -> NDArray[np.uint8]:
    """Return a photograph as blue, green, red of 8 bits, (height, width, 3).

    Raises:
        InputError: There is no such file, it is not a photograph, or it is too large or too small.
    """
    need("cv2", "photographs", "measuring photographs")
    import cv2

    name = os.fspath(source)
    data = photograph_bytes(name)
    width, height, *_ = _head_of(data)
    image: Any = None
    if width * height > 0:
        _check_size(name, width, height)
        log: Any = cv2.utils.logging  # OpenCV's own words on bad files are not shown
        level = log.setLogLevel(log.LOG_LEVEL_SILENT)
        with suppress(cv2.error):
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        log.setLogLevel(level)
    if image is None:
        raise InputError.FILE_FORMAT(
            f"{name} is not a photograph that can be read; give a PNG, JPEG or TIFF file"
        )
    _check_size(name, image.shape[1], image.shape[0])
    return image


def photograph_bytes(name: str) -> bytes:
    """Return the bytes of a file that may be a photograph.

    Raises:
        InputError: There is no such file, it cannot be read, or it is too large.
    """
    try:
        return bounded_bytes(name, LARGEST_FILE)
    except (FileNotFoundError, NotADirectoryError):
        raise InputError.FILE_NOT_FOUND(
            f"there is no photograph {name}; check the name and the folder it is in"
        ) from None
    except IsADirectoryError:
        raise InputError.FILE_FORMAT(f"{name} is a folder; name the photographs in it") from None
    except (OSError, ValueError) as problem:
        words = getattr(problem, "strerror", None) or problem
        raise InputError.FILE_UNREADABLE(f"{name} cannot be read: {words}") from None


def _check_size(name: str, width: int, height: int) -> None:
    if width * height > MOST_PIXELS:
        words = f"at most {MOST_PIXELS / 1e6:.0f} million are read, make it smaller"
    elif min(width, height) < _LEAST_SIDE:
        words = f"each side needs {_LEAST_SIDE} or more"
    elif max(width, height) > _LONGEST_SHAPE * min(width, height):
        words = f"no side may be more than {_LONGEST_SHAPE} times the other, cut it to the robot"
    else:
        return
    raise InputError.OUT_OF_RANGE(f"{name} has {width} x {height} pixels; {words}")


_DESCRIPTION, _COMMENT = 0x010E, 0x9286
_CODES = {b"ASCII\0\0\0": "latin-1", b"UNICODE\0": "utf-16", b"\0\0\0\0\0\0\0\0": "utf-8"}


def exif_texts(photograph: bytes) -> list[str]:
    """Return the texts in the EXIF of a JPEG, PNG or TIFF file, UserComment first.

    Nothing is raised for files that are damaged or have no EXIF: there are then no texts.
    """
    _, _, tags, order = _head_of(photograph, exif=True)
    comment, description = (_bytes(tags.get(tag)) for tag in (_COMMENT, _DESCRIPTION))
    code = _CODES.get(comment[:8])
    text = comment[8:] if code else comment
    if code == "utf-16":
        code = "utf-16-le" if order == "<" else "utf-16-be"
    texts = text.decode(code or "utf-8", "replace"), description.decode("utf-8", "replace")
    return [words for text in texts if (words := text.replace("\0", " ").strip())]


def _bytes(value: object) -> bytes:
    """Return the bytes of a value, which Pillow gives as latin-1 where its type is text."""
    text = value.encode("latin-1", "replace") if isinstance(value, str) else value
    return text if isinstance(text, bytes) else b""


_NUMBER = r"(?P<tension>\d+(?:[.,]\d+)?)"
_FIELDS = {"tension": _NUMBER, "pull": r"(?P<pull>[^_]+?)"}
_TENSION = re.compile(
    rf"\btension\s*=\s*{_NUMBER}\s*(?:N\s*)?(?=$|[;,\s](?!\s*[mk]N))", re.IGNORECASE
)
_PULL = re.compile(r"\bpull\s*=\s*(?P<pull>\w+)", re.IGNORECASE)


def loads_of(
    names: Sequence[str],
    robot: Robot,
    table: AnyPath | None,
    pattern: str | None,
    exif: bool = False,
    columns: Mapping[str, str] | None = None,
) -> dict[str, tuple[str, ...]]:
    """Return columns of loads, one text for each photograph; none if nothing is given.

    Raises:
        InputError: Several are given, a photograph has no loads, or a file name does not fit.
    """
    if (table is not None) + (pattern is not None) + exif > 1:
        raise InputError.CONFLICT(
            "give the loads as a table, by a pattern of names or by EXIF, not by several"
        )
    if table is not None:
        return _from_table(names, table, columns)
    if pattern is None and not exif:
        return {}
    if robot.number_of_tendons != 1:
        raise InputError.UNSUPPORTED(
            f"{robot.name} has {robot.number_of_tendons} tendons; a pattern or EXIF gives the "
            "tension of one, give the loads as a table"
        )
    readings = _from_exif(names) if pattern is None else _from_names(names, pattern)
    pulls = tuple(pull for _, pull in readings)
    if any(pulls) and not all(pulls):
        raise InputError.MISSING_VALUE(
            f"{Path(names[pulls.index('')]).name}: EXIF gives no pull, but that of other "
            "photographs does; give all or none"
        )
    tensions = tuple(tension.replace(",", ".") for tension, _ in readings)
    return ({"pull": pulls} if all(pulls) else {}) | {"tendon_force_N": tensions}


def _from_table(
    names: Sequence[str], source: AnyPath, named: Mapping[str, str] | None
) -> dict[str, tuple[str, ...]]:
    table = read_data_table(source, named)
    if PHOTOGRAPH not in table.header:
        raise InputError.TABLE_COLUMNS(
            f"{table.name}: there is no column {PHOTOGRAPH} with the names of the files; "
            f"{table.columns}."
        )
    listed = [Path(text).name for text in table.texts(PHOTOGRAPH)]
    rows: list[int] = []
    for name in names:
        here = [row for row, text in enumerate(listed) if text == Path(name).name]
        if len(here) != 1:
            words = "is not listed" if not here else f"is listed {len(here)} times"
            raise InputError.TABLE_ROWS(
                f"{table.name}: the photograph {Path(name).name} {words}; give it one row."
            )
        rows += here
    columns = [name for name in table.header if name != PHOTOGRAPH]
    return {name: tuple(table.texts(name)[row] for row in rows) for name in columns}


def _from_names(names: Sequence[str], pattern: str) -> list[tuple[str, str]]:
    """Return the tension and the pull that the name of each photograph gives."""
    if pattern.count("{tension}") != 1 or pattern.count("{pull}") > 1:
        raise InputError.BAD_SYNTAX(
            f"the pattern {pattern!r} needs {{tension}} once, and {{pull}} at most once, such as "
            "wrist_{pull}_{tension}N.jpg"
        )
    form = re.escape(pattern)
    for name, group in _FIELDS.items():
        form = form.replace(re.escape(f"{{{name}}}"), group)
    readings: list[tuple[str, str]] = []
    for path in map(Path, names):
        match = re.fullmatch(form, path.name) or re.fullmatch(form, path.stem)
        if match is None:
            raise InputError.BAD_SYNTAX(
                f"the name of the photograph {path.name} does not fit the pattern {pattern!r}"
            )
        readings.append((match["tension"], match.groupdict().get("pull", "")))
    return readings


def _from_exif(names: Sequence[str]) -> list[tuple[str, str]]:
    """Return the tension and the pull that the EXIF of each photograph gives."""
    readings: list[tuple[str, str]] = []
    for name in names:
        texts = exif_texts(photograph_bytes(name))
        match = next(filter(None, map(_TENSION.search, texts)), None)
        if match is None:
            words = f"its texts are {texts!r:.200}" if texts else "it has no text in EXIF"
            raise InputError.MISSING_VALUE(
                f"{Path(name).name}: UserComment and ImageDescription of EXIF give no tension; "
                f"{words}, write such as: tension=1.2 N"
            )
        pull = _PULL.search(match.string)
        readings.append((match["tension"], pull["pull"] if pull else ""))
    return readings
