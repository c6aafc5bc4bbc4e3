"""Paths of loads of robots that differ by numbers, row by row, with slopes of every row."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from notchflex._quantity import REGISTERED
from notchflex.analysis.derivatives.slopes import LOADS, SLOPING, load_units, with_loads
from notchflex.analysis.outputs import STEPS, follow_row
from notchflex.analysis.tangent import (
    StepLayouts,
    adjoint_step,
    tangent_step,
)
from notchflex.loads.command import make_commands
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.numbers import (
    Place,
    VariedRobots,
    parts_of,
    places_by_name,
)
from notchflex.solver.programs.assembled import AssembledRobots
from notchflex.solver.programs.compiled import on_cores
from notchflex.solver.programs.static_structure import StaticStructure

# Largest number of rows that are solved together: more would not fit the cache.
_ROWS = 256


@dataclass(frozen=True, eq=False)
class RobotRows:
    """Robots and loads as rows of values.

    Attributes:
        path: The path at the present values.
        start: Present values of the parameters, by name.
        forms: Where every output is in a row of them, the shape of its values, and their kind.
    """

    path: EquilibriumPath
    start: Mapping[str, np.ndarray]
    forms: Mapping[str, tuple[slice, tuple[int, ...], str]]

    @cached_property
    def possible(self) -> bool:
        """Whether rows are solved at once.

        They are not where loads depend on numbers of the robot, or these on more than numbers.
        """
        return not self._numbers or (self._programs is not None and not self.path.chain.loaded)

    @cached_property
    def _numbers(self) -> list[str]:
        return [name for name in self.start if name not in LOADS]

    @cached_property
    def _columns(self) -> list[int]:
        """Where the numbers of the robot are in a row of values."""
        first = np.cumsum([0, *(at.size for at in self.start.values())]).tolist()
        return [at for at, name in zip(first, self.start, strict=False) if name not in LOADS]

    @cached_property
    def _named(self) -> tuple[Robot, list[list[Place]]]:
        return places_by_name(self.path.robot, self._numbers)

    @cached_property
    def _programs(self) -> AssembledRobots | None:
        robot, places = self._named
        if not places:
            return None
        varied = [place for own in places for place in own]
        programs = AssembledRobots.tried(robot, self.path.chain, varied)
        if programs is None:
            return None
        same = programs.joined.structure.form is self.path.prepared.chain_layout
        return programs if same and set(varied) <= set(programs.form.places) else None

    @cached_property
    def _units(self) -> Float[np.ndarray, "n numbers"]:
        """Which numbers of the robot each of the values is."""
        assert self._programs is not None
        places = self._programs.form.places
        units = np.zeros((sum(at.size for at in self.start.values()), len(places)))
        units[self._columns] = [[place in own for place in places] for own in self._named[1]]
        return units

    @cached_property
    def _base(self) -> Float[np.ndarray, " numbers"]:
        """The numbers of the robot, 0 where they are among the values."""
        assert self._programs is not None
        numbers = self._programs.form.numbers_of(parts_of(self._named[0]))
        return np.where(self._units.any(axis=0), 0.0, numbers)

    @cached_property
    def _structure(self) -> StaticStructure:
        if self._programs is None:
            return self.path.prepared.static_structure
        return self._programs.joined.structure

    @cached_property
    def _layouts(self) -> StepLayouts:
        ready = self.path.prepared
        command, varies = ready.command_layout(self.path.commands), self._programs is not None
        outputs = tuple(name for name in self.forms if name in SLOPING)
        return StepLayouts(self._structure, command, ready.state, outputs, varies)

    @cached_property
    def _loads(self) -> tuple[np.ndarray, Float[np.ndarray, "n s command"]]:
        """The packed loads where all values are 0, and their changes per unit of each value."""
        path = self.path
        zeros = {name: 0.0 * at for name, at in self.start.items() if name in LOADS}
        none = make_commands(with_loads(path.load, zeros), path.robot, path.chain).packed()
        units = [
            load_units(path, name) if name in LOADS else np.zeros((1, *none.shape))
            for name in self.start
        ]
        return none, np.concatenate(units)

    def _valid(self, at: Float[np.ndarray, "k n"]) -> Bool[np.ndarray, " k"]:
        """Return which values a robot and loads can have."""
        valid: Any = np.isfinite(at).all(axis=1)
        tension = np.concatenate(
            [np.full(one.size, name == "tension") for name, one in self.start.items()]
        )
        moves = self._loads[1].any(axis=(1, 2))  # a tendon that is not commanded may have any
        valid &= (at[:, tension & moves] >= 0.0).all(axis=1)
        if self._numbers and valid.any():
            columns = at[valid][:, self._columns].T
            robots = VariedRobots(self.path.robot, dict(zip(self._numbers, columns, strict=True)))
            valid[valid] = robots.valid()
        return valid

    def values(self, at: Float[np.ndarray, "k n"]) -> tuple[np.ndarray, Bool[np.ndarray, " k"]]:
        """Return the outputs of every row, side by side, and which rows are known."""
        return self._pieces(self._values, at)

    def along(
        self, at: Float[np.ndarray, "k n"], change: Float[np.ndarray, "k n"]
    ) -> tuple[np.ndarray, Bool[np.ndarray, " k"]]:
        """Return the changes of the outputs along a change of every row's values."""
        return self._pieces(self._along, at, change)

    def back(
        self, at: Float[np.ndarray, "k n"], weights: Float[np.ndarray, "k m"]
    ) -> tuple[np.ndarray, Bool[np.ndarray, " k"]]:
        """Return the derivatives of a weighted sum of every row's outputs by its values."""
        return self._pieces(self._back, at, weights)

    def _pieces(
        self, work: Callable[..., tuple[np.ndarray, np.ndarray]], *tables: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Evaluate the valid rows piece by piece, on all cores; others are known to be NaN."""
        count = len(tables[0])
        valid = np.flatnonzero(self._valid(tables[0]))
        known = np.ones(count, bool)
        # A piece without a row tells the size of the results.
        pieces = [valid[start : start + _ROWS] for start in range(0, len(valid), _ROWS)]
        results: Any = None
        solving = on_cores(lambda rows: work(*(one[rows] for one in tables)), pieces or [valid])
        for rows, (values, alike) in zip(pieces or [valid], solving, strict=True):
            if results is None:
                results = np.full((count, values.shape[1]), np.nan)
            results[rows], known[rows] = values, alike
        return results, known

    def _followed(
        self, at: np.ndarray, names: tuple[str, ...]
    ) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray], np.ndarray]:
        """Follow the paths of rows; return their chains, loads and outputs, and which are known."""
        none, units = self._loads
        commands = none + np.tensordot(at, units, 1)
        chains, alike = self.path.prepared.dynamic_vector, np.ones(len(at), bool)
        if self._programs is not None:
            chains, alike = self._programs.chains(self._base + at @ self._units)
        by_row, numbers = (chains.ndim == 2, True, False), np.array(self.path.settings.numbers)
        layouts = self._structure, self._layouts.command, names
        found = follow_row.rows(by_row, chains, commands, numbers, *layouts)
        return chains, commands, found, alike

    def _steps(self, found: Mapping[str, np.ndarray]) -> list[np.ndarray]:
        """Return what programs take of every step beside its load; rows, then steps."""
        rest = np.broadcast_to(self.path.prepared.rest_vector, found["states"][:, :1].shape)
        before = np.concatenate([rest, found["states"][:, :-1]], axis=1)
        return [before, *(found[name] for name in STEPS)]

    def _packed(self, by_name: Mapping[str, np.ndarray], count: int) -> Float[np.ndarray, "k m"]:
        """Return outputs or their changes as rows, those that have slopes in the world."""
        rows = np.zeros((count, max(part.stop for part, _, _ in self.forms.values())))
        for name, (part, _, _) in self.forms.items():
            values = by_name.get(name, np.zeros(0))
            if name in SLOPING:
                values = REGISTERED[name].turned(values, self.path.load.base_to_world)
            if values.size:
                rows[:, part] = values.reshape(count, -1)
        return rows

    def _values(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        names = tuple(dict.fromkeys((*self.forms, "converged")))
        _, _, found, alike = self._followed(at, names)
        for name in set(found) & set(SLOPING):
            found[name][~found["converged"]] = np.nan
        return self._packed(found, len(at)), alike

    def _along(self, at: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        chains, commands, found, alike = self._followed(at, STEPS)
        chain_change = np.zeros(1)
        if self._programs is not None:
            numbers = self._base + at @ self._units
            chain_change, same = self._programs.along(numbers, change @ self._units)
            alike = alike & same
        tables = *self._steps(found), commands, np.tensordot(change, self._loads[1], 1)
        carried = np.zeros_like(tables[0][:, 0])
        by_row = (True, *(chains.ndim == 2,) * 2, *(True,) * len(tables))
        parts: list[dict[str, np.ndarray]] = []
        for step in range(len(self.path)):
            vectors = (carried, chains, chain_change, *(one[:, step] for one in tables))
            carried, by = tangent_step.rows(by_row, *vectors, self._layouts)
            parts.append(by)
        slopes = {name: np.stack([by[name] for by in parts], axis=1) for name in parts[0]}
        return self._packed(slopes, len(at)), alike

    def _back(self, at: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        chains, commands, found, alike = self._followed(at, STEPS)
        tables = *self._steps(found), commands, self._seeds(weights)
        carried, by_load = np.zeros_like(tables[0][:, 0]), np.zeros_like(commands)
        by_chain = np.zeros((len(at), self._structure.size))
        by_row = (True, chains.ndim == 2, *(True,) * len(tables))
        counts = np.zeros((len(at), 1), bool)
        layouts = self._layouts._replace(chain_varies=False)
        for step in reversed(range(len(self.path))):
            vectors = carried, chains, *(one[:, step] for one in tables)
            before, by = adjoint_step.rows(by_row, *vectors, layouts)
            # No step beyond the last that counts: one that failed there must not matter.
            counts = counts | tables[-1][:, step].any(axis=1, keepdims=True)
            carried = np.where(counts, before, 0.0)
            by_load[:, step] = np.where(counts, by["load"], 0.0)
            by_chain += np.where(counts, by["chain"], 0.0)
        gradient = np.tensordot(by_load, self._loads[1], ((1, 2), (1, 2)))
        if self._programs is not None:
            numbers = self._base + at @ self._units
            varied = np.flatnonzero(self._units.any(axis=0)).tolist()
            by_number, same = self._programs.gradient(numbers, by_chain, varied)
            gradient += by_number @ self._units[:, varied].T
            alike = alike & same
        return gradient, alike

    def _seeds(self, weights: Float[np.ndarray, "k m"]) -> Float[np.ndarray, "k s outputs"]:
        """Return weights of outputs in the frame of the base, step by step."""
        turn = self.path.load.base_to_world
        back = None if turn is None else turn.T
        seeds: list[np.ndarray] = []
        for name in self._layouts.outputs:
            part, shape, _ = self.forms[name]
            own = REGISTERED[name].turned(weights[:, part].reshape(-1, *shape), back)
            seeds.append(own.reshape(len(weights), shape[0], -1))
        return np.concatenate(seeds, axis=2)
