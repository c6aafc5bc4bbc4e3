"""The result of a design: its tables, documents and files."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from notchflex import ConvergenceError, EquilibriumPath, Robot
from notchflex.designing.explanation import yield_sentences
from notchflex.designing.model.wishes import Wish
from notchflex.designing.robust import YieldOf
from notchflex.designing.search import SearchResult
from notchflex.designing.specification import DesignConstraint, DesignObjective, DesignSpec
from notchflex.support import (
    Displayed,
    Summary,
    check_folder,
    document_head,
    robot_text,
    short,
    unwritable,
    write_csv,
    write_json,
    write_text,
)

if TYPE_CHECKING:
    from notchflex.designing.front import DesignFront


MINIMISE, MAXIMISE = "as small as possible", "as great as possible"


@dataclass(frozen=True)
class WishResult:
    """One objective or constraint, with the achieved value.

    Attributes:
        title: The quantity, with its state.
        unit: Its unit.
        asked: What was asked of it, in words.
        achieved: Its numbers, made one or few as asked.
        before: The same of the robot that the design began with; empty where it has none.
        met: Whether it is met; None for an objective that is only to be small or great.
        parts: What the numbers are called.
    """

    title: str
    unit: str
    asked: str
    achieved: tuple[float, ...]
    before: tuple[float, ...]
    met: bool | None
    parts: tuple[str, ...]


@dataclass(frozen=True)
class VariableResult:
    """One number that the search chose.

    Attributes:
        name: What it is called.
        unit: Its unit.
        value: The value chosen.
        before: The value of the robot that the design began with, within the limits.
        lower: Least value allowed.
        upper: Greatest value allowed.
    """

    name: str
    unit: str
    value: float
    before: float
    lower: float
    upper: float


@dataclass(frozen=True, eq=False, repr=False)
class Design(Displayed):
    """A designed robot, and how well it does what was asked.

    Attributes:
        spec: What was asked.
        before: The robot that the design began with.
        robot: The designed robot.
        converged: Whether all constraints hold and no small change improves the design.
        reason: Why not, "" if it has converged.
        wishes: What was asked and what is achieved.
        variables: The numbers chosen.
        explanation: Sentences: which limits hold the design, what each costs, and what cannot be
            met.
        solves: Number of robots solved.
        gradients: Number of robots differentiated.
        starts: Number of searches.
        yields: Of a robust design, which part of robots made within the tolerances meets all
            limits, and each of them.
    """

    spec: DesignSpec
    before: Robot
    robot: Robot
    converged: bool
    reason: str
    wishes: tuple[WishResult, ...]
    variables: tuple[VariableResult, ...]
    explanation: tuple[str, ...]
    solves: int
    gradients: int
    starts: int
    outcome: SearchResult
    yields: tuple[YieldOf, ...] = ()

    @property
    def met(self) -> bool:
        """Whether all constraints hold."""
        return all(one.met is not False for one in self.wishes)

    @cached_property
    def path(self) -> EquilibriumPath | None:
        """The states of the designed robot, one after the other; None if nothing asks for one."""
        return self.outcome.problem.solver.path(self.outcome.evaluation.point.x)

    @cached_property
    def path_before(self) -> EquilibriumPath | None:
        """The same of the robot that the design began with, at its loads."""
        problem = self.outcome.problem
        return problem.solver.path(problem.x(problem.start))

    @property
    def state_steps(self) -> dict[str, int]:
        """The step of every state in `path`."""
        steps = self.outcome.problem.solver.paths.step
        return {name: step for name, step in steps.items() if isinstance(name, str)}

    def save(self, folder: str | os.PathLike[str]) -> tuple[Any, ...]:
        """Write robot file, table, picture and JSON document into a folder.

        Args:
            folder: The folder; it is made if it is missing.

        Returns:
            The files.

        Raises:
            InputError: A file cannot be written.
        """
        return write_design(self, folder)

    def raise_if_failed(self) -> Design:
        """Return itself, if it converged.

        Raises:
            ConvergenceError: It did not; the message says why.
        """
        if not self.converged:
            raise ConvergenceError(self.reason)
        return self

    def _summary(self) -> Summary:
        rows = [
            (one.title, f"{numbers(one.achieved)} {one.unit}".rstrip() + f", asked {one.asked}")
            for one in self.wishes
        ]
        state = "converged" if self.converged else self.reason
        return Summary(f"Design {self.spec.name!r}: {state}", rows, " ".join(self.explanation[:2]))


def numbers(values: Sequence[float]) -> str:
    """Return a number, or the range of several."""
    if not values:
        return "-"
    low, high = min(values), max(values)
    if high - low <= 1e-6 * max(abs(low), abs(high)):
        return short(low)
    return f"{short(low)} to {short(high)}"


def asked_in_words(wish: Wish) -> str:
    """Return what was asked, such as "at most 0.06"."""
    asked = wish.asked
    if isinstance(asked, DesignObjective):
        if asked.target is not None:
            return f"near {asked.target:g} {wish.unit}".rstrip()
        return MINIMISE if asked.goal == "minimise" else MAXIMISE
    assert isinstance(asked, DesignConstraint)
    unit = f" {wish.unit}" if wish.unit else ""
    if asked.order is not None:
        by = f" by {asked.margin:g}{unit} or more" if asked.margin else ""
        way = "falling" if asked.order == "tip-first" else "rising"
        return f"{asked.order}: {way} toward the tip{by}"
    if asked.equal is not None:
        return f"{asked.equal:g}{unit}"
    of = "" if asked.wanted_yield is None else f" for {100.0 * asked.wanted_yield:g} % of robots"
    return f"{asked.words(wish.unit)}{of}"


def design_document(made: Design) -> dict[str, Any]:
    """Return a design as a document.

    Returns:
        `robot` (its description) and `name` as in every document, `design` (its name),
        `converged`, `met`, `reason`, `wishes`, `variables`, `explanation`, `solves`, `gradients`
        and `starts`, and of a robust design `yields`. Angles in deg, lengths in mm, forces in N.
    """
    return {
        **document_head(made.robot),
        "design": made.spec.name,
        "converged": made.converged,
        "met": made.met,
        "reason": made.reason,
        "wishes": [
            {
                "quantity": one.title,
                "unit": one.unit,
                "asked": one.asked,
                "achieved": list(one.achieved),
                "before": list(one.before),
                "met": one.met,
                "parts": list(one.parts),
            }
            for one in made.wishes
        ],
        "variables": [vars(one) for one in made.variables],
        "explanation": list(made.explanation),
        "solves": made.solves,
        "gradients": made.gradients,
        "starts": made.starts,
        **({"yields": [vars(one) for one in made.yields]} if made.yields else {}),
    }


def wish_rows(design: Design) -> list[tuple[str, str, str, str, str, str, str]]:
    """Return a row for every number asked: quantity, part, unit, asked, achieved, before, met."""
    rows: list[tuple[str, str, str, str, str, str, str]] = []
    for one in design.wishes:
        met = "" if one.met is None else "yes" if one.met else "no"
        for number, value in enumerate(one.achieved):
            part = one.parts[number] if len(one.parts) == len(one.achieved) else ""
            was = repr(one.before[number]) if number < len(one.before) else ""
            rows.append((one.title, part, one.unit, one.asked, repr(value), was, met))
    return rows


HEADS = ("quantity", "part", "unit", "asked", "achieved", "before", "met")


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
        from notchflex import plot

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
        from notchflex import plot

        plot(front).save(files[-1])
    return files


def make_folder(folder: str | os.PathLike[str]) -> None:
    """Make a folder, if it is missing.

    Raises:
        InputError: It cannot be made.
    """
    with unwritable(f"-o {folder} cannot be made"):
        Path(folder).mkdir(exist_ok=True)


def designed_text(made: Design) -> str:
    """Return the robot file: what was asked and achieved, and below it the robot."""
    state = "converged" if made.converged else made.reason
    lines = [f"# Designed by notchflex: {_one_line(made.spec.name)}; {state}."]
    for one in made.wishes:
        achieved = f"{numbers(one.achieved)} {one.unit}".rstrip()
        missed = " (not met)" if one.met is False else ""
        lines.append(f"#   {one.title}: asked {one.asked}, achieved {achieved}{missed}")
    lines += [f"#   {sentence}" for sentence in yield_sentences(made.yields)]
    return "\n".join([*map(_one_line, lines), "", robot_text(made.robot)])


def _one_line(text: str) -> str:
    return " ".join("".join(c if c.isprintable() else " " for c in text).split("\n"))
