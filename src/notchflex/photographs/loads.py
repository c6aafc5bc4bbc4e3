"""The loads under which photographs were taken: by a table, the names of the files, or EXIF."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from notchflex import InputError, Robot
from notchflex.photographs.measured import PHOTOGRAPH
from notchflex.photographs.reading import head_of, photograph_bytes
from notchflex.support import read_data_table

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
    code = _CODES.get(comment[:8])
    text = comment[8:] if code else comment
    if code == "utf-16":
        code = "utf-16-le" if head.order == "<" else "utf-16-be"
    texts = text.decode(code or "utf-8", "replace"), description.decode("utf-8", "replace")
    return [words for text in texts if (words := text.replace("\0", " ").strip())]


def _bytes(value: object) -> bytes:
    """Return the bytes of a value, which Pillow gives as latin-1 where its type is text."""
    text = value.encode("latin-1", "replace") if isinstance(value, str) else value
    return text if isinstance(text, bytes) else b""


_FIELDS = {"tension": r"(?P<tension>\d+(?:[.,]\d+)?)", "pull": r"(?P<pull>[^_]+?)"}

_TENSION = re.compile(
    r"\btension\s*=\s*(?P<tension>\d+(?:[.,]\d+)?)\s*(?:N\s*)?(?=$|[;,\s](?!\s*[mk]N))",
    re.IGNORECASE,
)
_PULL = re.compile(r"\bpull\s*=\s*(?P<pull>\w+)", re.IGNORECASE)


def loads_of(
    names: Sequence[str],
    robot: Robot,
    table: str | os.PathLike[str] | None,
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
    if exif:
        return _from_exif(names, robot)
    if table is not None:
        return _from_table(names, table, columns)
    return {} if pattern is None else _from_names(names, robot, pattern)


def _from_table(
    names: Sequence[str], source: str | os.PathLike[str], named: Mapping[str, str] | None
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


def _from_names(names: Sequence[str], robot: Robot, pattern: str) -> dict[str, tuple[str, ...]]:
    _check_one_tendon(robot, "a pattern")
    if pattern.count("{tension}") != 1 or pattern.count("{pull}") > 1:
        raise InputError.BAD_SYNTAX(
            f"the pattern {pattern!r} needs {{tension}} once, and {{pull}} at most once, such as "
            "wrist_{pull}_{tension}N.jpg"
        )
    form = re.escape(pattern)
    for name, group in _FIELDS.items():
        form = form.replace(re.escape(f"{{{name}}}"), group)
    readings: list[dict[str, str]] = []
    for name in names:
        path = Path(name)
        match = re.fullmatch(form, path.name) or re.fullmatch(form, path.stem)
        if match is None:
            raise InputError.BAD_SYNTAX(
                f"the name of the photograph {path.name} does not fit the pattern {pattern!r}"
            )
        readings.append(match.groupdict())
    columns = {"tendon_force_N": tuple(one["tension"].replace(",", ".") for one in readings)}
    if "pull" in readings[0]:
        return {"pull": tuple(one["pull"] for one in readings), **columns}
    return columns


def _from_exif(names: Sequence[str], robot: Robot) -> dict[str, tuple[str, ...]]:
    _check_one_tendon(robot, "EXIF")
    tensions: list[str] = []
    pulls: list[str] = []
    for name in names:
        texts = exif_texts(photograph_bytes(name))
        matches = [match for text in texts if (match := _TENSION.search(text))]
        if not matches:
            words = f"its texts are {texts!r:.200}" if texts else "it has no text in EXIF"
            raise InputError.MISSING_VALUE(
                f"{Path(name).name}: UserComment and ImageDescription of EXIF give no tension; "
                f"{words}, write such as: tension=1.2 N"
            )
        tensions.append(matches[0]["tension"].replace(",", "."))
        pull = _PULL.search(matches[0].string)
        pulls.append(pull["pull"] if pull else "")
    columns = {"tendon_force_N": tuple(tensions)}
    if all(pulls):
        return {"pull": tuple(pulls), **columns}
    if any(pulls):
        without = Path(names[pulls.index("")]).name
        raise InputError.MISSING_VALUE(
            f"{without}: EXIF gives no pull, but that of other photographs does; give all or none"
        )
    return columns


def _check_one_tendon(robot: Robot, what: str) -> None:
    if robot.number_of_tendons != 1:
        raise InputError.UNSUPPORTED(
            f"{robot.name} has {robot.number_of_tendons} tendons; {what} gives the tension of "
            "one, give the loads as a table"
        )
