"""Where results go: paths are checked before anything is computed; standard output.

Also what to do with a stream that can no longer be written: later text goes nowhere, so that the
rest of the work (files, warnings, the exit code) is done as if nobody had been listening.
"""

from __future__ import annotations

import csv
import io
import json
import math
import os
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np

from notchflex import __version__
from notchflex._extras import need
from notchflex._quantity import Quantity
from notchflex._replacing import is_replaceable, replacing, unwritable
from notchflex.errors import InputError
from notchflex.results.quantities import (
    AXES,
    CONTACT_STATES,
    QUANTITIES,
    holds,
    span_names,
    spans_of,
    units,
)
from notchflex.robot import Robot
from notchflex.robot.robot import to_table

if TYPE_CHECKING:
    from pathlib import Path as FilePath

    from notchflex.results.path import EquilibriumPath


def write_document(text: str) -> None:
    """Write a document (JSON, CSV) to standard output, as UTF-8 whatever the terminal takes.

    A reader that has gone (`notchflex schema | head`) is not a failure.

    Args:
        text: What to write.
    """
    stream = sys.stdout
    try:
        stream.flush()
        buffer = getattr(stream, "buffer", None)
        if buffer is None:  # a StringIO in its place
            stream.write(text)
        else:
            buffer.write(text.encode("utf-8", errors="replace"))
        stream.flush()
    except BrokenPipeError:
        let_go(stream)


def let_go(stream: TextIO) -> None:
    """Send what a stream still holds, and all that is written to it later, nowhere.

    Python would otherwise complain once more when it flushes the stream at exit.

    Args:
        stream: Standard output or standard error.
    """
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


STANDARD_OUTPUT = "-"
PAPER = (".png", ".svg", ".pdf")
BROWSER = (".html",)
MOVING = (".gif",)
_DRAWN_BY = {".html": ("matplotlib", "plotly"), ".gif": ("matplotlib", "PIL")}
"""What has to be installed for a kind of picture, where that is more than matplotlib."""


def check_output(target: str, option: str, *, inputs: Iterable[str | Path] = ()) -> None:
    """Raise if a file cannot be written at `target`; nothing is created or changed.

    Args:
        target: A path, or `-` for standard output.
        option: The option that named it, for the message.
        inputs: Files that are read; an output must not replace one of them.

    Raises:
        InputError: The folder is missing, the path is a folder or read-only, or it is an input.
    """
    if target == STANDARD_OUTPUT:
        return
    if not target.strip():
        raise InputError.MISSING_VALUE(f"{option} needs the name of a file, and got an empty one.")
    if "\0" in target:
        raise InputError.FILE_UNWRITABLE(
            f"{option} {target!r} cannot be written: it holds a null character."
        )
    path = Path(target)
    with unwritable(f"{option} {target!r} cannot be written"):
        obstacle = _obstacle(path)
        for source in [] if obstacle else inputs:
            if Path(source).exists() and path.exists() and path.samefile(source):
                raise InputError.CONFLICT(
                    f"{option} {target}: this would replace the file that is read; choose another."
                )
    if obstacle:
        raise InputError.FILE_UNWRITABLE(f"{option} {target}: {obstacle}.")


def _obstacle(path: Path) -> str:
    """Say why a file cannot be written, "" if it can."""
    folder = path.parent
    if path.is_dir():
        return "this is a folder; give the name of a file to write in it"
    if not folder.exists():
        return f"the folder {folder} does not exist; make it first or choose another"
    if not folder.is_dir():
        return f"{folder} is a file, not a folder"
    if path.exists() and not os.access(path, os.W_OK):
        return "this file may not be written; choose another"
    if is_replaceable(path) and not _folder_takes_files(folder):
        return f"no file may be written in the folder {folder}; choose another"
    return ""


def check_folder(
    folder: str, names: Iterable[str], option: str, *, inputs: Iterable[str | Path] = ()
) -> tuple[Path, ...]:
    """Raise if files cannot be written in a folder, which may be missing; nothing is changed.

    Args:
        folder: The folder; if it is missing, the one that it would be made in must be there.
        names: Names of the files.
        option: The option that named the folder, for the message.
        inputs: Files that are read; none of them may be replaced.

    Returns:
        The paths of the files.

    Raises:
        InputError: A file cannot be written there, has no name of a file, or is an input.
    """
    if not folder.strip():
        raise InputError.MISSING_VALUE(
            f"{option} needs the name of a folder, and got an empty one."
        )
    if folder == STANDARD_OUTPUT:
        raise InputError.FILE_FORMAT(
            f"{option} - : files cannot go to standard output; name a folder."
        )
    files: list[Path] = []
    for name in names:
        if Path(name).name != name or "\0" in name:
            raise InputError.FILE_UNWRITABLE(
                f"{option} {folder}: a file cannot be called {name!r}."
            )
        files.append(Path(folder) / name)
    there = os.path.exists(folder) if "\0" not in folder else False
    sources = list(inputs)
    for target in files if there else [folder]:
        check_output(str(target), option, inputs=sources)
    return tuple(files)


def check_picture(
    target: str,
    option: str,
    *,
    inputs: Iterable[str | Path] = (),
    kinds: tuple[str, ...] = PAPER + BROWSER,
) -> None:
    """Raise if a picture cannot be written at `target`: as `check_output`, and its kind too.

    Args:
        target: A path.
        option: The option that named it, for the message.
        inputs: Files that are read; an output must not replace one of them.
        kinds: The suffixes that this picture may have.

    Raises:
        InputError: The suffix is none of them, or what draws the picture is not installed.
    """
    if target == STANDARD_OUTPUT:
        raise InputError.FILE_FORMAT(
            f"{option} - : a picture cannot go to standard output; name a file, "
            "for example wrist.png."
        )
    suffix = Path(target).suffix.lower()
    if suffix not in kinds:
        got = f"the suffix {suffix}" if suffix else "no suffix"
        known = f"{', '.join(kinds[:-1])} or {kinds[-1]}"
        raise InputError.FILE_FORMAT(
            f"{option} {target}: got {got}; a picture is written as {known}."
        )
    check_output(target, option, inputs=inputs)
    for module in _DRAWN_BY.get(suffix, ("matplotlib",)):
        need(module, "plot", option)


def check_distinct(outputs: dict[str, str | None]) -> None:
    """Raise if two options name the same file, or both standard output.

    Args:
        outputs: Option to its target; None where the option was not given.

    Raises:
        InputError: Two targets are the same.
    """
    seen: dict[str, str] = {}
    for option, target in outputs.items():
        if target is None:
            continue
        # What holds a null character names no file: `check_output` tells that.
        plain = target == STANDARD_OUTPUT or "\0" in target
        name = target if plain else os.path.realpath(target)
        if name in seen:
            where = "standard output" if target == STANDARD_OUTPUT else target
            raise InputError.CONFLICT(
                f"{seen[name]} and {option} both write to {where}; give them different files."
            )
        seen[name] = option


def write_text(target: str | Path, text: str) -> None:
    """Write UTF-8 text to a file, whole or not at all, or to standard output for `-`.

    Args:
        target: Path, or `-`.
        text: What to write.

    Raises:
        InputError: The file cannot be written.
    """
    if str(target) == STANDARD_OUTPUT:
        write_document(text)
        return
    with replacing(target) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="replace", newline="\n")


def _folder_takes_files(folder: Path) -> bool:
    """Say whether a file can be made in `folder`, by making one without a name and dropping it.

    Asking for permissions is not enough: a read-only file system or a full quota grants them.
    """
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


# Results as a CSV table: one row a step, the columns of the table of quantities.
#
# The columns of tensions, strokes and angles have the names that measured data have
# (`tendon_force_N`, `tendon_displacement_mm`, `notch_j_deg`, `total_deg`), so that a computed table
# can be compared as if it had been measured.


def path_columns(path: EquilibriumPath) -> dict[str, Sequence[Any]]:
    """Return the columns of a path: header to the values of its S steps, at the edge units."""
    columns: dict[str, Sequence[Any]] = {"step": range(1, len(path) + 1)}
    for quantity in QUANTITIES.values():
        if quantity.column and holds(path, quantity):
            columns.update({one.header: one.values for one in entries_of(path, quantity)})
    return columns


def write_path_csv(
    target: str | FilePath, path: EquilibriumPath, more: Mapping[str, Sequence[Any]] | None = None
) -> None:
    """Write a path as CSV to a file, whole or not at all, or to standard output for `-`.

    Args:
        target: Path, or `-` for standard output.
        path: The path.
        more: Further columns behind those of the path, a value per step.

    Raises:
        InputError: The file cannot be written.
    """
    write_columns(target, {**path_columns(path), **(more or {})})


def write_columns(target: str | FilePath, columns: Mapping[str, Iterable[Any]]) -> None:
    """Write columns as CSV, as `write_csv` does its rows.

    Args:
        target: Path, or `-` for standard output.
        columns: As many values under every header.

    Raises:
        InputError: The file cannot be written.
    """
    write_csv(target, list(columns), zip(*columns.values(), strict=True))


def write_csv(target: str | FilePath, header: Sequence[str], rows: Iterable[Iterable[Any]]) -> None:
    """Write rows as CSV (UTF-8, comma, header first); NaN and None become empty fields.

    Args:
        target: Path, or `-` for standard output.
        header: Names of the columns.
        rows: Rows of as many values.

    Raises:
        InputError: The file cannot be written.
    """
    write_text(target, csv_text(header, rows))


def csv_text(header: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """Return what `write_csv` writes."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for row in rows:
        writer.writerow([_field(value) for value in row])
    return text.getvalue()


@dataclass(frozen=True)
class CsvEntry:
    """One entry of a quantity along a path, such as the angle of one notch.

    Attributes:
        header: The CSV column; "" where the quantity has none.
        name: Which entry it is, such as "notch 3"; "" for a quantity with one number.
        values: A value per step, at the edge units.
    """

    header: str
    name: str
    values: Any


def is_listed(quantity: Quantity) -> bool:
    """Tell whether `entries_of` lists the entries of a quantity one by one."""
    return quantity.per in ((), ("notch",), ("axis",), ("tendon",), ("tendon", "span"))


def entries_of(path: EquilibriumPath, quantity: Quantity) -> Iterator[CsvEntry]:
    """Yield every entry of a quantity, in the order of the CSV columns."""
    values: Any = getattr(path, quantity.name)
    if quantity.scale != 1.0:
        values = np.asarray(values) * quantity.scale
    several = path.tension.shape[1] > 1
    tendons = [(i, i + 1 if several else "") for i in range(path.tension.shape[1])]
    match quantity.per:
        case ():
            yield CsvEntry(quantity.header(), "", values)
        case ("notch",):
            for notch in range(values.shape[1]):
                header = quantity.header(notch=notch + 1)
                yield CsvEntry(header, f"notch {notch + 1}", values[:, notch])
        case ("axis",):
            for index, axis in enumerate(AXES):
                yield CsvEntry(quantity.header(axis=axis), axis, values[:, index])
        case ("tendon",):
            for index, number in tendons:
                name = f"tendon {number}" if several else ""
                yield CsvEntry(quantity.header(tendon=number), name, values[:, index])
        case ("tendon", "span"):
            for index, number in tendons:
                for span, name in enumerate(span_names(spans_of(path, index))):
                    header = quantity.header(tendon=number, span=name)
                    words = f"tendon {number}, " if several else ""
                    words += name.replace("_", " ")
                    yield CsvEntry(header, words, values[:, index, span])
        case other:
            raise NotImplementedError(f"no CSV columns for a quantity per {other}")


def _field(value: Any) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return int(value)
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return value


# Results as one JSON document: keys and units from the table of quantities, never a NaN.

# Quantities of contacts are gathered contact by contact.
CONTACTS = tuple(q for q in QUANTITIES.values() if q.key and q.per == ("tendon", "contact"))
PLAIN = tuple(q for q in QUANTITIES.values() if q.key and q not in CONTACTS)

# External loads are input, not results: they are not registered as quantities.
_LOAD_KEYS = {
    "tip_force": ("tip_force_N", "N"),
    "tip_moment": ("tip_moment_Nmm", "N mm"),
    "tip_point": ("tip_point_mm", "mm"),
    "tip_mass": ("tip_mass_g", "g"),
    "gravity": ("gravity_m_s2", "m/s^2"),
    "force": ("body_forces.force_N", "N"),
    "moment": ("body_forces.moment_Nmm", "N mm"),
    "point": ("body_forces.point_mm", "mm"),
}
LOAD_UNITS = {f"load.{key}": unit for key, unit in _LOAD_KEYS.values()}


def path_document(path: EquilibriumPath) -> dict[str, Any]:
    """Return a path as a document of plain lists, numbers, strings and None.

    Args:
        path: Solved path, S steps.

    Returns:
        `name`, `version`, `robot` (its whole description), `units` (JSON key to unit),
        `converged`, `reason`, `reason_code` (name of a `Failure`) and `steps`, a list of S
        objects. None stands where there is no number. Angles in deg, lengths in mm, forces in N.
        Where external loads act in any step, `load` holds those of every step.
    """
    external = _external(path)
    failed = next((step for step, good in enumerate(path.converged) if not good), None)
    steps = [_step(path, index, external) for index in range(len(path))]
    return {
        **document_head(path.robot),
        "units": units() | (LOAD_UNITS if external else {}),
        "converged": failed is None,
        "reason": "" if failed is None else str(path.reason[failed]),
        "reason_code": "" if failed is None else str(path.reason_code[failed]),
        "steps": steps,
    }


def step_document(path: EquilibriumPath, index: int) -> dict[str, Any]:
    """Return one step (from 0) of the document of a path, of plain values."""
    return plain(_step(path, index, _external(path)))


def document_head(robot: Robot) -> dict[str, Any]:
    """Return the head that every document has: the robot's name and description, the version."""
    return {
        "name": robot.name,
        "program": "notchflex",
        "version": __version__,
        "robot": plain(to_table(robot)),
    }


def json_text(document: Any) -> str:
    r"""Return a document as JSON text that ends with a newline.

    Args:
        document: Nested dicts and lists; numpy arrays and numbers are allowed.

    Returns:
        Strict JSON: NaN becomes null.

    Example:
        >>> json_text({"angle_deg": [1.5, float("nan")]})
        '{"angle_deg": [1.5, null]}\n'
    """
    return json.dumps(plain(document), ensure_ascii=False, allow_nan=False) + "\n"


def write_json(target: str | FilePath, document: Any) -> None:
    """Write a document to a file, whole or not at all, or to standard output for `-`.

    Raises:
        InputError: The file cannot be written.
    """
    write_text(target, json_text(document))


def plain(value: Any) -> Any:
    """Return a value as JSON knows it: arrays as lists, NaN as None, infinity as "inf".

    Infinity only stands in robot descriptions (an inextensible tendon); as a string it is read
    back as a number by the robot models.
    """
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, float):
        if math.isnan(value):
            return None
        if math.isinf(value):
            return "inf" if value > 0 else "-inf"
    return value


def _step(path: EquilibriumPath, index: int, external: list[dict[str, Any]]) -> dict[str, Any]:
    step: dict[str, Any] = {"step": index + 1}
    for quantity in PLAIN:
        if holds(path, quantity):
            holder = step
            *outer, last = quantity.key.split(".")
            for key in outer:
                holder = holder.setdefault(key, {})
            holder[last] = _value(path, quantity, index)
    if external:
        step.setdefault("load", {}).update(external[index])
    step["contacts"] = [_contacts(path, tendon, index) for tendon in range(path.tension.shape[1])]
    return step


def _external(path: EquilibriumPath) -> list[dict[str, Any]]:
    """External loads of every step; nothing at all where no step has any."""
    if all(one.is_nothing for one in path.load.external):
        return []
    return [_with_units(asdict(one)) for one in path.load.external]


def _with_units(values: dict[str, Any]) -> dict[str, Any]:
    forces = values.pop("body_forces", None)
    named = {
        _LOAD_KEYS.get(name, (name,))[0].rpartition(".")[2]: value for name, value in values.items()
    }
    if forces is not None:
        named["body_forces"] = [_with_units(one) for one in forces]
    return named


def _value(path: EquilibriumPath, quantity: Quantity, index: int) -> Any:
    value = getattr(path, quantity.name)[index]
    if quantity.per == ("tendon", "span"):
        return [row[: spans_of(path, tendon)] for tendon, row in enumerate(value)]
    if quantity.scale != 1.0:
        return np.asarray(value) * quantity.scale
    return value.item() if isinstance(value, np.generic) else value


def _contacts(path: EquilibriumPath, tendon: int, index: int) -> list[dict[str, Any]]:
    count = spans_of(path, tendon) - 1
    columns = {
        q.key.split(".")[1]: getattr(path, q.name)[index, tendon, :count] * q.scale
        for q in CONTACTS
        if holds(path, q)
    }
    columns["state"] = [CONTACT_STATES[int(state)] for state in columns["state"]]
    return [{key: column[contact] for key, column in columns.items()} for contact in range(count)]
