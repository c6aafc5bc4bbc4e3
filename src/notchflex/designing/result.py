"""The result of a design: its tables, sentences, documents and files."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex import ConvergenceError, EquilibriumPath, Robot
from notchflex.designing.problem import DesignProblem
from notchflex.designing.robust import YieldOf
from notchflex.designing.search import SearchResult
from notchflex.designing.solver import distances
from notchflex.designing.specification import DesignSpec
from notchflex.search.slsqp import TOLERANCE
from notchflex.support import (
    AnyPath,
    Displayed,
    Summary,
    check_folder,
    document_head,
    numbers_at,
    robot_text,
    round_number,
    short,
    unwritable,
    write_csv,
    write_json,
    write_text,
)

# The most sentences about limits, the dearest first.
_MAX_SENTENCES = 12
# Change of a limit, relative to its size, for which its cost is stated.
_PART = 0.05
# No effect is below this part of the sum; a limit of a variable is reached within this part.
_NO_EFFECT, _AT_LIMIT = 1e-9, 1e-3

FILES = ("robot.toml", "wishes.csv", "design.json", "design.svg")
"""Files of a design; the last one where a picture can be drawn."""

_HEADS = ("quantity", "part", "unit", "asked", "achieved", "before", "met")
_MET = {None: "", True: "yes", False: "no"}

Writer = Callable[[Path], object]


class SavedInFolder(Displayed):
    """Base of results that are written into a folder."""

    def _contents(self) -> dict[str, Writer]:
        """By name of a file what writes it."""
        raise NotImplementedError

    def save(self, folder: AnyPath, *, inputs: Iterable[str | Path] = ()) -> tuple[Path, ...]:
        """Write robot files, tables, documents and pictures into a folder.

        Args:
            folder: The folder; it is made if it is missing.
            inputs: Files that are read; none of them may be replaced.

        Returns:
            The files.

        Raises:
            InputError: A file cannot be written.
        """
        contents = self._contents()
        files = check_folder(os.fspath(folder), contents, "-o", inputs=inputs)
        with unwritable(f"-o {folder} cannot be made"):
            Path(folder).mkdir(exist_ok=True)
        for file, write in zip(files, contents.values(), strict=True):
            write(file)
        return files


def picture_of(result: object, name: str) -> dict[str, Writer]:
    """Return the file of the picture of a result, where one can be drawn."""
    if importlib.util.find_spec("matplotlib") is None:
        return {}
    from notchflex import plot

    return {name: lambda file: plot(result).save(file)}


def headed(title: str, unit: str) -> str:
    """Return the head of a column with its unit."""
    return f"{title} [{unit}]" if unit else title


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

    @property
    def achieved_words(self) -> str:
        """What is achieved, with its unit."""
        return f"{numbers(self.achieved)} {self.unit}".rstrip()


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
class Design(SavedInFolder):
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
        return all(wish.met is not False for wish in self.wishes)

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
        """The step of every load in `path`."""
        steps = self.outcome.problem.solver.steps.last
        return {name: step for name, step in steps.items() if isinstance(name, str)}

    def raise_if_failed(self) -> Design:
        """Return itself, if it converged.

        Raises:
            ConvergenceError: It did not; the message says why.
        """
        if not self.converged:
            raise ConvergenceError(self.reason)
        return self

    def _contents(self) -> dict[str, Writer]:
        """The robot file, the table, the document and the picture."""
        robot, table, document, picture = FILES
        rows = [  # one for every number asked
            (wish.title, part, wish.unit, wish.asked, value, before, _MET[wish.met])
            for wish in self.wishes
            for part, value, before in zip_longest(wish.parts, wish.achieved, wish.before)
        ]
        return {
            robot: self.write_robot,
            table: lambda file: write_csv(file, _HEADS, rows),
            document: lambda file: write_json(file, design_document(self)),
            **picture_of(self, picture),
        }

    def write_robot(self, file: Path) -> None:
        """Write the robot file: what was asked and achieved, and below it the robot."""
        state = "converged" if self.converged else self.reason
        lines = [f"# Designed by notchflex: {self.spec.name}; {state}."]
        for wish in self.wishes:
            missed = " (not met)" if wish.met is False else ""
            lines.append(
                f"#   {wish.title}: asked {wish.asked}, achieved {wish.achieved_words}{missed}"
            )
        lines += [f"#   {part.sentence}" for part in told_yields(self.yields)]
        printable = ("".join(c if c.isprintable() else " " for c in line) for line in lines)
        write_text(file, "\n".join([*printable, "", robot_text(self.robot)]))

    def _summary(self) -> Summary:
        rows = [(wish.title, f"{wish.achieved_words}, asked {wish.asked}") for wish in self.wishes]
        state = "converged" if self.converged else self.reason
        return Summary(f"Design {self.spec.name!r}: {state}", rows, " ".join(self.explanation[:2]))


@dataclass(frozen=True, eq=False, repr=False)
class DesignFront(SavedInFolder):
    """Designs of which none is better in one objective without being worse in another.

    Attributes:
        spec: What was asked.
        points: The designs, by the first objective.
        reason: Why the search ended early, "" if it did not.
    """

    spec: DesignSpec
    points: tuple[Design, ...]
    reason: str

    @property
    def objectives(self) -> Float[np.ndarray, "points objectives"]:
        """Values of the objectives, in their units."""
        count = len(self.spec.objective)
        return np.array([[w.achieved[0] for w in point.wishes[:count]] for point in self.points])

    @property
    def titles(self) -> tuple[str, ...]:
        """Names of the objectives, with units."""
        wishes = self.points[0].wishes[: len(self.spec.objective)]
        return tuple(headed(wish.title, wish.unit) for wish in wishes)

    def _contents(self) -> dict[str, Writer]:
        """point_01.toml and so on, the table and the picture."""
        variables = [headed(each.name, each.unit) for each in self.points[0].variables]
        files: dict[str, Writer] = {}
        rows: list[list[Any]] = []
        for number, values in enumerate(self.objectives.tolist(), start=1):
            name, point = f"point_{number:02d}.toml", self.points[number - 1]
            files[name] = point.write_robot
            rows.append([name, *values, *(variable.value for variable in point.variables)])
        heads = ["robot", *self.titles, *variables]
        files["front.csv"] = lambda file: write_csv(file, heads, rows)
        return files | picture_of(self, "front.svg")

    def _summary(self) -> Summary:
        rows = [
            (f"point {number}", ", ".join(short(value) for value in values))
            for number, values in enumerate(self.objectives.tolist(), start=1)
        ]
        return Summary(f"Front of {len(self.points)} designs: {', '.join(self.titles)}", rows)


def numbers(values: Sequence[float]) -> str:
    """Return a number, or the range of several."""
    if not values:
        return "-"
    low, high = min(values), max(values)
    if high - low <= 1e-6 * max(abs(low), abs(high)):
        return short(low)
    return f"{short(low)} to {short(high)}"


def design_document(made: Design) -> dict[str, Any]:
    """Return a design as a document.

    Returns:
        `robot` (its description) and `name` as in every document, `design` (its name),
        `converged`, `met`, `reason`, `wishes`, `variables`, `explanation`, `solves`, `gradients`
        and `starts`, and of a robust design `yields`. Angles in deg, lengths in mm, forces in N.
    """
    names = ("converged", "met", "reason", "wishes", "variables", "explanation")
    document = document_head(made.robot) | {"design": made.spec.name}
    for name in (*names, "solves", "gradients", "starts"):
        document[name] = getattr(made, name)
    document["wishes"] = [{"quantity": wish.title} | vars(wish) for wish in made.wishes]
    for wish in document["wishes"]:
        del wish["title"]
    document["variables"] = [vars(variable) for variable in made.variables]
    return document | ({"yields": [vars(part) for part in made.yields]} if made.yields else {})


# Sentences that explain a design.


def told_yields(yields: Sequence[YieldOf]) -> list[YieldOf]:
    """Return the yield of all limits, and those that are wanted."""
    return [part for part in yields if part is yields[0] or part.wanted]


def curves_missed(outcome: SearchResult) -> list[str]:
    """Return a sentence for every curve with points that the axis does not reach."""
    sentences: list[str] = []
    for curve in {wish.curve: 0 for wish in outcome.problem.wishes if wish.curve}:
        far = distances(outcome.evaluation.point.offsets(curve))[:, 0]
        missed = list(map(str, np.flatnonzero(far > curve.within) + 1))
        if missed:
            shown = ", ".join(missed[:10]) + " ..." * (len(missed) > 10)
            sentences.append(
                f"curve.{curve.name} is not reached at {len(missed)} of {len(far)} points "
                f"({shown}), up to {short(far.max())} mm away; asked {curve.within:g} mm."
            )
    return sentences


def chosen_form(spec: DesignSpec, robot: Robot, forms: int) -> list[str]:
    """Return a sentence about the number of notches and the sizes that were chosen of several."""
    if forms < 2:
        return []
    chosen = [f"{robot.number_of_notches} notches"] if spec.number_of_notches else []
    for path in (path for stock in spec.stock for path in stock.values):
        chosen.append(f"{path} {short(next(iter(numbers_at(robot, path).values())))}")
    return [f"Chosen of {forms} combinations: {', '.join(chosen)}."]


def explain(outcome: SearchResult) -> list[str]:
    """Return sentences about the best robot of a design."""
    missed = missed_rows(outcome)
    return curves_missed(outcome) + (_missed(outcome, missed) if missed else _held(outcome))


def _held(outcome: SearchResult) -> list[str]:
    """Which limits hold the design, that with the greatest effect first, and what each costs."""
    problem, minimum = outcome.problem, outcome.minimum
    assert minimum is not None
    variables = problem.solver.variables
    limits, spans = [*problem.rows, *variables.columns], variables.span
    sizes = np.append(problem.sizes, spans)
    scales = np.append(np.ones(len(problem.rows)), spans)
    numbers = np.append(outcome.evaluation.rows[:, 0], outcome.evaluation.point.x)
    first = len(minimum.multipliers) - len(minimum.variables)  # of the variables
    places = np.append(np.arange(len(problem.rows)), first + np.arange(len(spans)))
    what, sentences = _objective_name(problem), list[tuple[float, str]]()
    for k in np.flatnonzero(minimum.active[places]).tolist():
        between, number = limits[k], numbers[k]
        is_equal = between.lower == between.upper
        is_low = between.upper - number > number - between.lower
        side = "wanted" if is_equal else "least" if is_low else "greatest"
        unit, limit = between.unit, between.lower if is_low else between.upper
        step = round_number(_PART * sizes[k])
        effect = float(-minimum.multipliers[places[k]] / scales[k] * step)  # of the step more
        text = f"{between.title} stands at its {side} value, " + f"{short(limit)} {unit}".strip()
        if what is not None and abs(effect) > _NO_EFFECT * abs(outcome.evaluation.total):
            name, amount_unit, verb = what
            # A wanted value is moved to where the sum falls, a limit to where it leaves more room.
            is_more = effect < 0.0 if is_equal else not is_low
            change = f"{short(step)} {unit}".strip() + (" more" if is_more else " less")
            amount = f"{short(abs(effect))} {amount_unit}".strip()
            text += f"; {change} would {verb} {amount} of {name}"
        elif is_equal:
            continue
        sentences.append((abs(effect), f"{text}."))
    told = [sentence for _, sentence in sorted(sentences, key=lambda pair: -pair[0])]
    if len(told) > _MAX_SENTENCES:
        told[_MAX_SENTENCES:] = [f"{len(told) - _MAX_SENTENCES} more limits are reached."]
    return told or ["No limit is active: the design meets the specification inside all limits."]


def _objective_name(problem: DesignProblem) -> tuple[str, str, str] | None:
    """Name and unit of the objective, and what less of a limit does to it; None without one."""
    if not problem.objectives:
        return None
    if len(problem.objectives) > 1:
        return "the weighted sum of the objectives", "", "save"
    (wish,) = problem.objectives
    if wish.asked.target is not None:
        return f"the squared distance of {wish.title} from {wish.asked.target:g}", "", "save"
    if wish.take == "rms":
        return f"the square of {wish.title}", f"{wish.unit}²" if wish.unit else "", "save"
    return wish.title, wish.unit, "save" if wish.asked.goal == "minimise" else "gain"


def missed_rows(outcome: SearchResult) -> list[int]:
    """Return the number of the row by which each missed constraint is missed most, worst first."""
    rows, worst = outcome.problem.rows, dict[int, int]()
    violation = np.abs(outcome.problem.violation(outcome.evaluation))
    for number in np.argsort(-violation).tolist():
        if violation[number] > TOLERANCE:
            worst.setdefault(id(rows[number].wish), number)
    return list(worst.values())


def _missed(outcome: SearchResult, missed: Sequence[int]) -> list[str]:
    """Conflicting constraints, the violation of each at the nearest robot, and what may help."""
    problem = outcome.problem
    several = "These constraints contradict each other"
    start = several if len(missed) > 1 else "One constraint cannot be met"
    told = [f"{start} within the limits of the variables; the robot that comes nearest:"]
    for number in missed:
        row, value = problem.rows[number], float(outcome.evaluation.rows[number, 0])
        unit = f" {row.unit}" if row.unit else ""
        way, limit = ("above", row.upper) if value > row.upper else ("below", row.lower)
        word = "the value" if row.lower == row.upper else "its limit"
        off = f"{short(abs(value - limit))}{unit} {way} {word} {short(limit)}{unit}"
        told.append(f"{row.title} is {short(value)}{unit}, {off}.")
    names: list[str] = []
    columns = problem.solver.variables.columns
    for z, column in zip(outcome.evaluation.z.tolist(), columns, strict=True):
        if abs(z - 0.5) > 0.5 - _AT_LIMIT:
            which, limit = ("greatest", column.upper) if z > 0.5 else ("least", column.lower)
            names.append(f"{column.title} ({which}, {limit:g} {column.unit})".replace(" )", ")"))
    if not names:
        none = "No variable stands at its limit: other variables are needed, or weaker wishes."
        return [*told, none]
    shown = ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
    return [*told, f"Wider limits could help where a variable stands at its own: {shown}."]
