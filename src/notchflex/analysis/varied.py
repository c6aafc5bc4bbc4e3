"""Chains of the robots of a batch: robots that differ by numbers, and any others."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex.analysis.solve import level_of
from notchflex.errors import ErrorCode, InputError
from notchflex.loads.command import LoadKind
from notchflex.mechanics.chain import Chain
from notchflex.robot import Robot
from notchflex.robot.numbers import PartsForm, Place, parts_of, places_by_name
from notchflex.robot.value_names import parse_path
from notchflex.solver.programs.assembled import AssembledRobots
from notchflex.solver.programs.prepare import PreparedChain, prepare
from notchflex.solver.programs.static_structure import StaticStructure

Rows = Int[np.ndarray, " k"]
"""Numbers of some rows."""

FEW = 256
"""So many robots are assembled in Python before programs for them are compiled."""

# By how much of its width a box is widened, so that the next numbers lie in it too.
_WIDER = 0.25


@dataclass(frozen=True, eq=False)
class VariedRobots:
    """Robots made of some robots and numbers of their own; each is made when asked for."""

    robots: Sequence[Robot]  # what they are made of
    which: Int[np.ndarray, " n"]  # of these each is made of
    values: Mapping[str, Float[np.ndarray, " n"]]  # numbers of each by name

    @classmethod
    def of(cls, robot: Robot, values: Mapping[str, Float[np.ndarray, " n"]]) -> VariedRobots:
        """Return robots that are made of one."""
        return cls([robot], np.zeros(len(next(iter(values.values()))), int), values)

    def __len__(self) -> int:
        """Return the number of robots."""
        return len(self.which)

    def __getitem__(self, number: int) -> Robot:
        """Make one of the robots; raise where the numbers make none."""
        robot = self.robots[self.which[number]]
        values = {name: float(column[number]) for name, column in self.values.items()}
        return robot.with_values(values) if values else robot

    @cached_property
    def errors(self) -> dict[int, InputError]:
        """Why numbers make no valid robot, by number of the robot."""
        errors = dict[int, InputError]()
        for number, robot in enumerate(self.robots if self.values else ()):
            members = np.flatnonzero(self.which == number)
            table = np.stack([column[members] for column in self.values.values()], axis=1)
            names = tuple(self.values)
            with np.errstate(invalid="ignore"):  # numbers may be infinite, or none
                for row, error in _errors(robot, names, table, np.arange(len(members))):
                    errors[int(members[row])] = error
        return errors

    def forms(self, numbers: Rows) -> Iterator[RobotForm]:
        """Yield some of the robots by the forms of their parts."""
        forms = dict[PartsForm, RobotForm]()
        for number in np.unique(self.which[numbers]).tolist():
            robot, places = places_by_name(self.robots[number], [*self.values])
            pairs = zip(self.values, places, strict=True)
            columns = {place: name for name, named in pairs for place in named}
            form = PartsForm.of(parts_of(robot), columns)
            of_form = forms.setdefault(form, RobotForm(self, numbers, form, {}, columns))
            of_form.bases[number] = robot
        for of_form in forms.values():
            members = numbers[np.isin(self.which[numbers], list(of_form.bases))]
            yield of_form._replace(members=members)


def _errors(
    robot: Robot,
    names: tuple[str, ...],
    table: Float[np.ndarray, "n d"],
    rows: Rows,
) -> Iterator[tuple[int, InputError]]:
    """Yield rows of a table whose numbers make no valid robot, with the reason."""
    # Rules tie a number to its limits, to the tube, a tendon or another number of the same notch,
    # each of them monotonic: if all corners of a box are valid, so is all inside. Other boxes are
    # halved.
    notches = [parse_path(name).number if "notch" in name else None for name in names]
    cliques = tuple(
        tuple(place for place, notch in enumerate(notches) if notch in (None, single))
        for single in dict.fromkeys(notch for notch in notches if notch is not None) or [None]
    )
    numbers = table[rows]
    if sum(2 ** len(clique) for clique in cliques) <= len(rows):
        low, high = numbers.min(axis=0), numbers.max(axis=0)
        known_box, wider = _known_box(robot, names), _WIDER * (high - low)
        if known_box and (known_box[0] <= low).all() and (high <= known_box[1]).all():
            return
        for box in ((low - wider, high + wider), (low, high)):
            ends = np.array(box)
            corners = (
                (list(clique), corner)  # of numbers that belong together
                for clique in cliques
                for corner in itertools.product(*ends[:, list(clique)].T)
            )
            for clique, corner in corners:
                tried = ends.mean(axis=0)
                tried[clique] = corner
                if _error(robot, names, tried) is not None:
                    break
            else:
                known_box[:] = box
                return
        spread = np.nan_to_num((high - low) / np.ptp(table, axis=0))
        order = np.argsort(numbers[:, np.argmax(spread)], kind="stable")
        for half in np.array_split(rows[order], 2):
            yield from _errors(robot, names, table, half)
        return
    for row in rows.tolist():
        if (error := _error(robot, names, table[row])) is not None:
            yield row, error


@lru_cache(maxsize=16)
def _known_box(robot: Robot, names: tuple[str, ...]) -> list[np.ndarray]:
    """Return the ends of the last box of numbers that was found valid; none at first."""
    return []


def _error(
    robot: Robot, names: tuple[str, ...], numbers: Float[np.ndarray, " d"]
) -> InputError | None:
    """Return why numbers make no valid robot; None where they make one."""
    try:
        robot.with_values(dict(zip(names, numbers.tolist(), strict=True)))
    except InputError as error:
        if error.code is not ErrorCode.INVALID_ROBOT:  # no robot of this kind has such a number
            raise
        return error
    return None


@dataclass(frozen=True, eq=False)
class Chains:
    """Chains of robots, packed for programs."""

    ready: PreparedChain  # one of the chains
    structure: StaticStructure  # layout of all
    packed: Callable[[Rows], tuple[np.ndarray, Bool[np.ndarray, " k"]]]
    programs: AssembledRobots | None = None  # what makes chains from numbers of the form
    form: RobotForm | None = None

    def along(
        self, robots: Rows, changes: Float[np.ndarray, "k names"]
    ) -> tuple[np.ndarray, Bool[np.ndarray, " k"]]:
        """Differentiate chains along changes of the named values; return also which are right."""
        if self.programs is None or self.form is None:
            return np.zeros(1), np.ones(len(robots), bool)
        return self.programs.along(self.form.table(robots), changes @ self.form.units)

    def back(
        self, robots: Rows, weights: Float[np.ndarray, "k chain"]
    ) -> tuple[Float[np.ndarray, "k names"], Bool[np.ndarray, " k"]]:
        """Differentiate weighted sums of chains by the named values, as `along`."""
        if self.programs is None or self.form is None:
            return np.zeros((len(robots), 0)), np.ones(len(robots), bool)
        return self.programs.gradient(self.form.table(robots), weights, 1.0 * self.form.units)

    def bodies(self, chains: Float[np.ndarray, "k chain"]) -> Chain:
        """Return the chain with the masses, lengths and temperature of every robot, for loads."""
        if chains.ndim == 1 or not self.ready.chain.loaded:
            return self.ready.chain
        indices: Chain = self.structure.form.unpack_indices()
        names = ("body_length", "body_mass", "body_centre", "temperature")
        values: dict[str, Any] = {
            name: chains[:, self.structure.indices_of(places)]
            for name in names
            if (places := getattr(indices, name)) is not None
        }
        return dataclasses.replace(self.ready.chain, **values)


def single_chains(prepared: Mapping[int, PreparedChain]) -> Chains:
    """Return chains of one structure that were assembled one by one, by the robots' numbers."""
    ready = next(iter(prepared.values()))
    table = np.stack([chain.dynamic_vector for chain in prepared.values()])
    rows = np.zeros(max(prepared) + 1, int)
    rows[list(prepared)] = np.arange(len(prepared))

    def packed(numbers: Rows) -> tuple[np.ndarray, Bool[np.ndarray, " k"]]:
        chains = table[0] if len(table) == 1 else table[rows[numbers]]
        return chains, np.ones(len(numbers), bool)

    return Chains(ready, ready.static_structure, packed)


class RobotForm(NamedTuple):
    """Robots whose parts have one form."""

    robots: VariedRobots  # all of the batch
    members: Rows  # numbers of those of this form
    form: PartsForm
    bases: dict[int, Robot]  # robots by number; notches that have a name stand alone
    columns: dict[Place, str]  # names of the numbers that vary, by place

    @property
    def example(self) -> Robot:
        """One of these robots."""
        return next(iter(self.bases.values()))

    @property
    def units(self) -> Bool[np.ndarray, "names numbers"]:
        """Which numbers of a robot each value by name is."""
        names = np.array([self.columns.get(place, "") for place in self.form.places])
        return np.array([*self.robots.values])[:, None] == names

    def table(self, numbers: Rows) -> Float[np.ndarray, "k numbers"]:
        """Return the numbers of some robots, as `PartsForm.numbers_of` does."""
        bases = np.zeros((len(self.robots.robots), len(self.form.places)))
        bases[list(self.bases)] = [
            self.form.numbers_of(parts_of(robot)) for robot in self.bases.values()
        ]
        rows = bases[self.robots.which[numbers]]
        for place, name in self.columns.items():
            rows[:, self.form.places.index(place)] = self.robots.values[name][numbers]
        return rows

    def chains(self, kind: int, refinement: int) -> Chains | None:
        """Return the chains for a kind of loads (`acting`); None where no program makes them."""
        # A direction, or no finite number, is no number of a form.
        if not set(self.columns) <= set(self.form.places):
            return None
        programs, ready = _programs(self.example, (*self.columns,), kind, refinement)
        if programs is None or programs.joined.structure.form is not ready.chain_layout:
            return None

        def packed(numbers: Rows) -> tuple[np.ndarray, Bool[np.ndarray, " k"]]:
            distinct, inverse = np.unique(numbers, return_inverse=True)
            chains, alike = programs.chains(self.table(distinct))
            if np.array_equal(distinct, numbers):  # a copy would take time
                return chains, alike
            return chains[inverse], alike[inverse]

        return Chains(ready, programs.joined.structure, packed, programs, self)


def prepare_kind(robot: Robot, kind: int, refinement: int) -> PreparedChain:
    """Prepare a robot for a kind of loads: bits of `loads.command.acting`."""
    loaded = bool(kind & LoadKind.LOADED)
    level = level_of(robot, loaded, loaded and bool(kind & LoadKind.SIDEWAYS))
    return prepare(robot, level, loaded, loaded and bool(kind & LoadKind.FOLLOWING), refinement)


@lru_cache(maxsize=8)
def _programs(
    robot: Robot, varied: tuple[Place, ...], kind: int, refinement: int
) -> tuple[AssembledRobots | None, PreparedChain]:
    """Return programs for robots that differ in some of their numbers, and one prepared."""
    ready = prepare_kind(robot, kind, refinement)
    return AssembledRobots.tried(robot, ready.chain, varied), ready
