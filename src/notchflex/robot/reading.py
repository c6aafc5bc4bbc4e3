"""Reading robots: the ready ones by name, others from TOML files."""

import os
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from notchflex._ready import READY, ready_names
from notchflex._replacing import AnyPath
from notchflex.errors import InputError, RobotFileError
from notchflex.robot.files import csv_table, read_text
from notchflex.robot.part import nearest
from notchflex.robot.robot import (
    Changed,
    Robot,
    from_table,
    remember_source,
    set_values,
    warn_unlikely,
)
from notchflex.robot.value_names import change_table

Refused = TypeVar("Refused", bound=InputError)


def load_robot(name_or_path: AnyPath) -> Robot:
    """Read a robot: a ready one by its name, or a robot file.

    Args:
        name_or_path: A name of `list_robots`, or the path of a TOML file in mm, N, MPa and deg.
            Text with a folder or the ending `.toml` is a path; other text is a ready robot first
            and a file in the working folder second.

    Returns:
        The robot; it remembers the text of its file, so that `save_robot` keeps the comments.

    Raises:
        RobotFileError: There is no such robot or file, it is not TOML, or a value in it is not
            allowed; the message names the file, the key and, for TOML syntax, the line.

    Example:
        >>> load_robot("pacheco2021-a").number_of_notches
        5
    """
    robot = load_changed(name_or_path, ()).robot
    warn_unlikely(robot)
    return robot


def load_changed(name_or_path: AnyPath, values: Sequence[tuple[str, object]]) -> Changed:
    """Read a robot and set values of it, which may repair its file; nothing warns."""
    path = _find(name_or_path)
    shown = path.stem if path.parent == READY else str(path)
    text = read_text(path, "robot file", shown, RobotFileError)
    table = parse_toml(text, shown)
    try:
        _read_curves(table, path.parent)
        robot, dropped = from_table(table), ()
    except InputError as error:
        if not values:
            raise in_file(shown, error, RobotFileError) from None
        try:
            dropped = change_table(table, values)
            robot, values = from_table(table), ()
        except InputError as remaining:
            raise in_file(shown, remaining, RobotFileError) from None
        except (LookupError, TypeError, AttributeError):  # no table in which values can be set
            raise in_file(shown, error, RobotFileError) from None
    if values:
        robot, dropped = set_values(robot, values)
    return Changed(remember_source(robot, text), dropped)


def _read_curves(table: dict[str, Any], folder: Path) -> None:
    """Put the numbers of CSV files of curves into the table of a robot."""
    rows: Any = table.get("notch")
    for row in rows if isinstance(rows, list) else ():
        name = row.get("file") if isinstance(row, dict) else None
        if isinstance(name, str):
            curve = csv_table(folder / name)
            for key, column in ("angle_deg", "angle_deg"), ("moment", "moment_Nmm"):
                row[key] = curve.numbers(column).tolist()
            del row["file"]


def in_file(shown: str, error: InputError, kind: type[Refused]) -> Refused:
    """Name the file before each sentence of an error that does not begin with it."""
    lines = str(error).splitlines()
    named = (line if line.startswith(shown) else f"{shown}: {line}" for line in lines)
    return kind("\n".join(named), error.code)


def robot_from_text(text: str, shown: str = "robot file") -> Robot:
    """Make a robot from the text of a robot file, which messages call `shown`."""
    return remember_source(from_table(parse_toml(text, shown)), text)


def _find(name_or_path: AnyPath) -> Path:
    """Decide between a ready robot and a file."""
    if not isinstance(name_or_path, str | os.PathLike):  # pyright: ignore
        raise RobotFileError.WRONG_TYPE(
            f"a robot is loaded by its name or the path of its file; got {name_or_path!r}."
        )
    text = os.fspath(name_or_path)
    path = Path(text)
    is_path = not isinstance(name_or_path, str) or path.suffix == ".toml" or len(path.parts) > 1
    names = ready_names()
    if not is_path and text in names:
        return READY / f"{text}.toml"
    # os.path: False, and no error, for a name that can be no file's
    if is_path or os.path.exists(text):
        if path.suffix == ".toml" and path.stem in names and not path.exists():
            raise RobotFileError.FILE_NOT_FOUND(
                f"{path}: there is no such file; the ready robot is called `{path.stem}`, "
                "without .toml."
            )
        return path
    raise RobotFileError.UNKNOWN_NAME(
        f"`{text}` is neither a ready robot{nearest(text, names)} nor a robot file. "
        f"Ready robots: {', '.join(names)}."
    )


def parse_toml(
    text: str,
    shown: str,
    kind: str = "robot file",
    error_class: type[InputError] = RobotFileError,
) -> dict[str, Any]:
    """Read the text of a TOML file; an error names the file, its kind and the line."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        match = re.fullmatch(
            r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", str(error)
        )
        what, line, column = match.groups() if match else (str(error), None, None)
        # "end of document" is the last line that has something on it
        line = line or len(text.rstrip().splitlines())
        where = f", column {column}" if column else ""
        raise error_class.FILE_UNREADABLE(
            f"{shown}, line {line}{where}: this is not TOML ({what[:1].lower()}{what[1:]}); "
            "write one `key = value` a line, text in quotes."
        ) from None
    except ValueError as error:  # a whole number of thousands of digits
        raise error_class.FILE_UNREADABLE(
            f"{shown} holds a number that cannot be read: {error}."
        ) from None
    except RecursionError:
        raise error_class.FILE_UNREADABLE(f"{shown} is nested too deeply for a {kind}.") from None
