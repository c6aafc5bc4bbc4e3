"""The files of a design: robot, table, picture and JSON document."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from notchflex.designing.documents import HEADS, design_document, wish_rows
from notchflex.designing.explanation import yield_sentences
from notchflex.designing.result import Design, numbers
from notchflex.errors import InputError
from notchflex.results.files.csv import write_csv
from notchflex.results.files.json import write_json
from notchflex.results.files.writing import check_folder, write_text
from notchflex.robot.robot import source_of
from notchflex.robot.writing import robot_text

if TYPE_CHECKING:
    from notchflex.designing.front import DesignFront

FRONT_TABLE, FRONT_PICTURE = "front.csv", "front.svg"
ROBOT, TABLE, DOCUMENT, PICTURE = "robot.toml", "wishes.csv", "design.json", "design.svg"


def file_names() -> tuple[str, ...]:
    """Return the names of the files, with a picture where one can be drawn."""
    drawn = importlib.util.find_spec("matplotlib") is not None
    return (ROBOT, TABLE, DOCUMENT, *((PICTURE,) if drawn else ()))


def write_design(
    made: Design, folder: str | os.PathLike[str], *, inputs: Iterable[str | Path] = ()
) -> tuple[Path, ...]:
    """Write the files of a design into a folder.

    Args:
        made: The design.
        folder: The folder; it is made if it is missing.
        inputs: Files that are read; none of them may be replaced.

    Returns:
        The files.

    Raises:
        InputError: A file cannot be written.
    """
    names = file_names()
    files = check_folder(os.fspath(folder), names, "-o", inputs=inputs)
    make_folder(folder)
    write_text(files[0], designed_text(made))
    write_csv(files[1], HEADS, wish_rows(made))
    write_json(files[2], design_document(made))
    if PICTURE in names:
        from notchflex._plot import plot

        plot(made).save(files[3])
    return files


def write_front(
    front: DesignFront, folder: str | os.PathLike[str], *, inputs: Iterable[str | Path] = ()
) -> tuple[Path, ...]:
    """Write a front into a folder: point_01.toml and so on, the table and the picture.

    Raises:
        InputError: A file cannot be written.
    """
    robots = [f"point_{number:02d}.toml" for number in range(1, len(front.points) + 1)]
    drawn = [FRONT_PICTURE] if PICTURE in file_names() else []
    files = check_folder(os.fspath(folder), (*robots, FRONT_TABLE, *drawn), "-o", inputs=inputs)
    make_folder(folder)
    for file, point in zip(files, front.points, strict=False):
        write_text(file, designed_text(point))
    names = [f"{v.name} [{v.unit}]" if v.unit else v.name for v in front.points[0].variables]
    rows = (
        [name, *values, *(v.value for v in point.variables)]
        for name, point, values in zip(robots, front.points, front.objectives.tolist(), strict=True)
    )
    write_csv(files[len(robots)], ["robot", *front.titles, *names], rows)
    if drawn:
        from notchflex._plot import plot

        plot(front).save(files[-1])
    return files


def make_folder(folder: str | os.PathLike[str]) -> None:
    """Make a folder, if it is missing.

    Raises:
        InputError: It cannot be made.
    """
    try:
        Path(folder).mkdir(exist_ok=True)
    except OSError as problem:
        words = problem.strerror or problem
        raise InputError.FILE_UNWRITABLE(f"-o {folder} cannot be made: {words}.") from None


def designed_text(made: Design) -> str:
    """Return the robot file: what was asked and achieved, and below it the robot."""
    state = "converged" if made.converged else made.reason
    lines = [f"# Designed by notchflex: {_one_line(made.spec.name)}; {state}."]
    for one in made.wishes:
        achieved = f"{numbers(one.achieved)} {one.unit}".rstrip()
        missed = " (not met)" if one.met is False else ""
        lines.append(f"#   {one.title}: asked {one.asked}, achieved {achieved}{missed}")
    lines += [f"#   {sentence}" for sentence in yield_sentences(made.yields)]
    return "\n".join([*map(_one_line, lines), "", robot_text(made.robot, source_of(made.robot))])


def _one_line(text: str) -> str:
    return " ".join("".join(c if c.isprintable() else " " for c in text).split("\n"))
