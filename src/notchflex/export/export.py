"""Writes robots to files of other programs: cut patterns, drawings, solids, simulators."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, NamedTuple

from notchflex import InputError, Robot
from notchflex.export.formats import FORMATS, Document, Subject, format_of
from notchflex.support import check_output, replacing

if TYPE_CHECKING:
    from notchflex import Equilibrium, EquilibriumPath


class Exported(NamedTuple):
    """A file that was written.

    Attributes:
        file: Its path.
        warnings: Sentences about what is in it.
        facts: Numbers about what is in it, with their units in the names.
    """

    file: str
    warnings: tuple[str, ...]
    facts: dict[str, Any]


def export_robot(
    robot: Robot | EquilibriumPath | Equilibrium,
    file: str | PathLike[str],
    options: object | None = None,
) -> Exported:
    """Write a robot to a file of another program; the suffix selects the format.

    Args:
        robot: The robot without loads; or a state, or a path whose last step counts, for the
            formats that show the robot under load.
        file: Path of the file, written completely or not at all; a file there is replaced.
        options: Options of the format; those that it has by default if None.

    Returns:
        What was written, with warnings.

    Raises:
        InputError: The robot or the options do not allow it, a package is missing, or the file
            cannot be written.

    Example:
        >>> import notchflex as nf
        >>> nf.export_robot(nf.load_robot("pacheco2021-a"), "wrist.pdf").file
        'wrist.pdf'
    """
    if not isinstance(file, (str, PathLike)):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(f"file must be a path; got {type(file).__name__}.")
    target = fspath(file)
    name = format_of(target)
    check_output(target, "export_robot")
    FORMATS[name].check_packages("export_robot")
    return write({target: build(name, _subject(robot), options)})[0]


def build(name: str, subject: Subject, options: object | None = None) -> Document:
    """Make the document of a format; nothing is written.

    Raises:
        InputError: The robot or the options do not allow it.
    """
    kind, path, step = FORMATS[name], subject.path, subject.step
    options = kind.options() if options is None else options
    if not isinstance(options, kind.options):
        raise InputError.WRONG_TYPE(
            f"a {kind.text} takes {kind.options.__name__}; got {type(options).__name__}."
        )
    if path is not None and not kind.bends:
        raise InputError.CONFLICT(
            f"a {kind.text} shows the robot as it is cut, without loads; give the robot instead "
            "of a result."
        )
    if path is not None and not path.converged[step]:
        raise InputError.NOT_CONVERGED(
            f"the state that is exported did not converge: {path.reason[step]}."
        )
    return kind.build(subject, options)


def write(documents: Mapping[str, Document]) -> list[Exported]:
    """Write documents, by file; each completely or not at all."""
    written: list[Exported] = []
    for file, document in documents.items():
        with replacing(file) as temporary:
            document.writer(document.content, temporary)
        written.append(Exported(file, document.warnings, document.facts))
    return written


def _subject(robot: object) -> Subject:
    if isinstance(robot, Robot):
        return Subject(robot)
    from notchflex import Equilibrium, EquilibriumPath  # they import JAX

    if isinstance(robot, EquilibriumPath):
        robot = robot[-1]
    if isinstance(robot, Equilibrium):
        return Subject(robot.robot, robot.path, robot.step)
    raise InputError.WRONG_TYPE(
        f"export_robot takes a Robot, an Equilibrium or an EquilibriumPath; got "
        f"{type(robot).__name__}."
    )
