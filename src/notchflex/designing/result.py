"""The result of a design: its tables, sentences, documents and files."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from notchflex import ConvergenceError, EquilibriumPath, Robot
from notchflex.designing.model.wishes import Wish
from notchflex.designing.problem import DesignProblem, Row
from notchflex.designing.robust import YieldOf
from notchflex.designing.search import SearchResult
from notchflex.designing.specification import DesignConstraint, DesignObjective, DesignSpec
from notchflex.search.slsqp import TOLERANCE
from notchflex.support import (
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

if TYPE_CHECKING:
    from notchflex.designing.front import DesignFront


# The most sentences about limits, the dearest first.
_MAX_SENTENCES = 12
# Change of a limit, relative to its size, for which its cost is stated.
_PART = 0.05
# No effect is below this part of the sum; a limit of a variable is reached within this part.
_NO_EFFECT, _AT_LIMIT = 1e-9, 1e-3
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
    names = ("converged", "met", "reason", "wishes", "variables", "explanation")
    names += ("solves", "gradients", "starts")
    document = document_head(made.robot) | {"design": made.spec.name}
    document |= {name: getattr(made, name) for name in names}
    document["wishes"] = [
        {"quantity": wish.title}
        | {key: value for key, value in vars(wish).items() if key != "title"}
        for wish in made.wishes
    ]
    document["variables"] = [vars(variable) for variable in made.variables]
    return document | ({"yields": [vars(part) for part in made.yields]} if made.yields else {})


def wish_rows(design: Design) -> Iterator[tuple[Any, ...]]:
    """Yield a row for every number asked: quantity, part, unit, asked, achieved, before, met."""
    for wish in design.wishes:
        met = {None: "", True: "yes", False: "no"}[wish.met]
        parts = wish.parts if len(wish.parts) == len(wish.achieved) else ("",) * len(wish.achieved)
        for part, value, before in zip_longest(parts, wish.achieved, wish.before):
            yield wish.title, part, wish.unit, wish.asked, value, before, met


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
    _make_folder(folder)
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
    _make_folder(folder)
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


def _make_folder(folder: str | os.PathLike[str]) -> None:
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


def curves_missed(outcome: SearchResult) -> tuple[str, ...]:
    """Return a sentence for every curve with points that the axis does not reach."""
    sentences: list[str] = []
    for curve in {id(w.curve): w.curve for w in outcome.problem.wishes if w.curve}.values():
        far = outcome.evaluation.point.curve(curve).values
        numbers = (np.flatnonzero(far > curve.within) + 1).tolist()
        if numbers:
            shown = ", ".join(map(str, numbers[:10])) + (" ..." if len(numbers) > 10 else "")
            sentences.append(
                f"curve.{curve.name} is not reached at {len(numbers)} of {len(far)} points "
                f"({shown}), up to {short(float(far.max()))} mm away; asked {curve.within:g} mm."
            )
    return tuple(sentences)


def chosen_form(spec: DesignSpec, robot: Robot, forms: int) -> tuple[str, ...]:
    """Return a sentence about the number of notches and the sizes that were chosen of several."""
    if forms < 2:
        return ()
    chosen = [f"{robot.number_of_notches} notches"] if spec.number_of_notches else []
    for path in (path for stock in spec.stock for path in stock.values):
        value = next(iter(numbers_at(robot, path).values()))
        chosen.append(f"{path} {short(value)}")
    return (f"Chosen of {forms} combinations: {', '.join(chosen)}.",)


def yield_sentences(yields: Sequence[YieldOf]) -> tuple[str, ...]:
    """Return a sentence for the yield of all limits, and for every one that is wanted."""
    return tuple(_yield_sentence(one) for one in yields if one is yields[0] or one.wanted)


def _yield_sentence(one: YieldOf) -> str:
    achieved, low, high, plain = (
        f"{100.0 * part:.4g}" for part in (one.achieved, *one.interval, one.plain)
    )
    target = "" if one.wanted is None else f", wanted {100.0 * one.wanted:.4g} %"
    meets = "meet" if one.title == "all limits" else "meet the limit of"
    return (
        f"{achieved} % of the robots made within the tolerances {meets} {one.title} "
        f"({low} to {high} %{target}); without regard to tolerances {plain} %."
    )


def explain(outcome: SearchResult) -> tuple[str, ...]:
    """Return sentences about the best robot of a design."""
    missed = missed_rows(outcome)
    limits = (*_missed(outcome, missed), _at_limits(outcome)) if missed else _held(outcome)
    return (*curves_missed(outcome), *limits)


class _ActiveLimit(NamedTuple):
    """A limit that the design is at."""

    title: str
    unit: str
    limit: float
    side: str  # "least", "greatest" or "wanted"
    step: float  # a round change of the limit
    effect: float  # change of the sum by that step more


def _active_limits(outcome: SearchResult) -> list[_ActiveLimit]:
    """Return the limits that are reached, that with the greatest effect first."""
    problem, minimum = outcome.problem, outcome.minimum
    assert minimum is not None
    rows = [
        (row.title, row.wish.unit, row, row.size or size, 1.0)
        for row, size in zip(problem.rows, problem.sizes.tolist(), strict=True)
    ]
    columns = [(c.name, c.unit, c, c.span, c.span) for c in problem.solver.variables.columns]
    numbers = np.append(outcome.evaluation.rows.values, outcome.evaluation.point.x)
    first = len(minimum.multipliers) - len(minimum.variables)  # of the variables
    places = [*range(len(rows)), *range(first, first + len(columns))]
    limits: list[_ActiveLimit] = []
    for place, number, described in zip(places, numbers, [*rows, *columns], strict=True):
        if minimum.active[place]:
            title, unit, between, size, scale = described
            is_low = between.upper - number > number - between.lower
            limit = between.lower if is_low else between.upper
            is_equal = between.lower == between.upper
            side = "wanted" if is_equal else "least" if is_low else "greatest"
            step = round_number(_PART * size)
            effect = -minimum.multipliers[place] / scale * step
            limits.append(_ActiveLimit(title, unit, limit, side, step, effect))
    return sorted(limits, key=lambda limit: -abs(limit.effect))


def _held(outcome: SearchResult) -> tuple[str, ...]:
    """Which limits hold the design, and what each costs."""
    sentences = [_sentence(outcome, limit) for limit in _active_limits(outcome)]
    kept = [one for one in sentences if one]
    if not kept:
        return ("No limit is active: the design meets the specification inside all limits.",)
    left = len(kept) - _MAX_SENTENCES
    more = [f"{left} more limits are reached."] if left > 0 else []
    return (*kept[:_MAX_SENTENCES], *more)


def _sentence(outcome: SearchResult, active: _ActiveLimit) -> str:
    what = _objective_name(outcome.problem)
    limit = f"{active.title} stands at its {active.side} value, "
    limit += f"{short(active.limit)} {active.unit}".strip()
    if what is None or abs(active.effect) <= _NO_EFFECT * abs(outcome.evaluation.total):
        return "" if active.side == "wanted" else f"{limit}."
    name, unit, verb = what
    # A wanted value is moved to where the sum falls, a limit to where it leaves more room.
    is_more = active.effect < 0.0 if active.side == "wanted" else active.side == "greatest"
    step = f"{short(active.step)} {active.unit}".strip() + (" more" if is_more else " less")
    amount = f"{short(abs(active.effect))} {unit}".strip()
    return f"{limit}; {step} would {verb} {amount} of {name}."


def _objective_name(problem: DesignProblem) -> tuple[str, str, str] | None:
    """Name and unit of the objective, and what less of a limit does to it; None without one."""
    if not problem.objectives:
        return None
    if len(problem.objectives) > 1:
        return "the weighted sum of the objectives", "", "save"
    wish = next(iter(problem.objectives))
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    if asked.target is not None:
        return f"the squared distance of {wish.title} from {asked.target:g}", "", "save"
    if wish.take == "rms":
        return f"the square of {wish.title}", f"{wish.unit}²" if wish.unit else "", "save"
    return wish.title, wish.unit, "save" if asked.goal == "minimise" else "gain"


def missed_rows(outcome: SearchResult) -> list[int]:
    """Return the number of the row by which each missed constraint is missed most, worst first."""
    rows, worst = outcome.problem.rows, dict[int, int]()
    violation = np.abs(outcome.problem.violation(outcome.evaluation))
    for number in np.argsort(-violation).tolist():
        if violation[number] > TOLERANCE:
            worst.setdefault(id(rows[number].wish), number)
    return list(worst.values())


def _missed(outcome: SearchResult, missed: Sequence[int]) -> tuple[str, ...]:
    """Conflicting constraints, and the violation of each at the nearest robot."""
    several = "These constraints contradict each other"
    start = several if len(missed) > 1 else "One constraint cannot be met"
    numbers = outcome.evaluation.rows.values.tolist()
    return (
        f"{start} within the limits of the variables; the robot that comes nearest:",
        *(_miss(outcome.problem.rows[number], numbers[number]) for number in missed),
    )


def _miss(row: Row, value: float) -> str:
    unit = f" {row.wish.unit}" if row.wish.unit else ""
    limit = row.upper if value > row.upper else row.lower
    way = "above" if value > limit else "below"
    word = "the value" if row.lower == row.upper else "its limit"
    off = f"{short(abs(value - limit))}{unit} {way} {word} {short(limit)}{unit}"
    return f"{row.title} is {short(value)}{unit}, {off}."


def _at_limits(outcome: SearchResult) -> str:
    """Which variables stand at their limits, where wider ones could help."""
    columns = outcome.problem.solver.variables.columns
    names: list[str] = []
    for z, column in zip(outcome.evaluation.z.tolist(), columns, strict=True):
        if abs(z - 0.5) > 0.5 - _AT_LIMIT:
            which, limit = ("greatest", column.upper) if z > 0.5 else ("least", column.lower)
            names.append(f"{column.name} ({which}, {limit:g} {column.unit})".replace(" )", ")"))
    if not names:
        return "No variable stands at its limit: other variables are needed, or weaker wishes."
    shown = ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
    return f"Wider limits could help where a variable stands at its own: {shown}."
