"""A robot prepared for control: one compiled program solves a load and differentiates it.

`nf.solve` prepares robot, load and result anew each time and returns everything that may be asked.
A search or a control loop asks for a few quantities and their derivatives by the drives, hundreds
of times a second: here all that stays the same is packed once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex._jax import jax
from notchflex._quantity import REGISTERED
from notchflex.analysis.solve import prepare_for
from notchflex.control.program.compiled_search import SearchLayouts, Task, blank_task, search_drives
from notchflex.control.program.drive_step import dead_band
from notchflex.loads.command import make_commands
from notchflex.loads.load_path import LoadPath
from notchflex.results.state import (
    SavedState,
    State,
    fitted,
)
from notchflex.robot import Robot
from notchflex.solver.newton import (
    DEFAULT,
    Settings,
)
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import PytreeLayout, pad_rows
from notchflex.solver.quantities import unpad_quantity
from notchflex.solver.residual import SolverState


class Response(NamedTuple):
    """A solved load, and how what was asked of it changes with the drives.

    Attributes:
        state: The state, packed for the padded chain.
        values: Quantities that were asked, one after the other, flattened, (m,).
        jacobian: Their change per unit of every drive (N or mm), (m, t). NaN where the load was
            so hard that its derivatives are not known.
        converged: Whether the load has an equilibrium within what the model is for.
        whole: Whether it was solved in one substep.
        sliding: The Jacobian, of tendons that stick as they last slid, (m, t).
    """

    state: Float[np.ndarray, " state"]
    values: Float[np.ndarray, " m"]
    jacobian: Float[np.ndarray, "m t"]
    converged: bool
    whole: bool
    sliding: Float[np.ndarray, "m t"]


class DriveAim(NamedTuple):
    """A target of drives, and their limits; m target values, t tendons.

    Attributes:
        entries: Entries of a response that have a target, (m,).
        goal: What they are to become, (m,).
        weights: What an error of each counts, (m,).
        low: Lowest drives, (t,).
        high: Highest drives, (t,).
        driven: Which tendons are driven, (t,).
        tolerance: Weighted error at which the target is met.
        unit: Drive that about closes a notch, N or mm.
        solves: How many loads may be solved.
    """

    entries: np.ndarray
    goal: np.ndarray
    weights: np.ndarray
    low: np.ndarray
    high: np.ndarray
    driven: np.ndarray
    tolerance: float
    unit: float
    solves: int


# Corrections of drives and equilibrium after a solved load.
_CORRECTIONS = 8.0


class _Places(NamedTuple):
    """Positions in a packed state that control needs.

    Attributes:
        tension: Base tension of every tendon, (t,).
        stroke: Its stroke, (t,).
        first_ratio: Log ratio of its first contact, (t,).
        first_bound: Largest of that, (t,).
        first_slid: How far it has slid, (t,).
        bounds: Of all its contacts, one array per tendon.
    """

    tension: np.ndarray
    stroke: np.ndarray
    first_ratio: np.ndarray
    first_bound: np.ndarray
    first_slid: np.ndarray
    bounds: tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class DriveModel:
    """A robot under given external loads, as a function of its drives and of the state before.

    Attributes:
        robot: The robot.
        load: One step: which tendons are driven by stroke, and the external loads.
        outputs: Quantities that are asked.
        start: State to continue from; rest where None.
        settings: Tolerance and limits of the solver.
    """

    robot: Robot
    load: LoadPath
    outputs: tuple[str, ...]
    start: State | SavedState | None = None
    settings: Settings = DEFAULT

    def solve(
        self, before: Float[np.ndarray, " state"], drive: Float[np.ndarray, " t"]
    ) -> Response:
        """Solve one load from a state, and differentiate it.

        Args:
            before: The state before, packed.
            drive: Tension (N) or stroke (mm) of every tendon.
        """
        task = self._plain.copy()
        at = self._fields
        task[at["present"].start : at["high"].stop].reshape(3, -1)[:] = drive
        return self._run(before, task)[0]

    def search(
        self,
        before: Float[np.ndarray, " state"],
        start: Float[np.ndarray, " t"],
        known: Response,
        aim: DriveAim,
    ) -> tuple[Response, Float[np.ndarray, " t"], float, bool, int]:
        """Solve the load at the drives that slopes predict for a target, and correct them.

        Args:
            before: The state before, packed.
            start: Drives to start from.
            known: Values and slopes there.
            aim: The target and the limits of the drives.

        Returns:
            The solved state, its drives, its weighted distance from the target, whether that is
            met, and how many loads were solved.
        """
        task, at, entries = self._plain.copy(), self._fields, aim.entries
        own = self._own[entries]
        task[at["goal"]][own], task[at["weights"]][own] = aim.goal, aim.weights
        task[at["miss"]][own] = aim.weights * (known.values[entries] - aim.goal)
        slopes = task[at["slopes"]].reshape(-1, len(start))
        slopes[own] = aim.weights[:, None] * known.sliding[entries]
        rows = (start, aim.low, aim.high, aim.driven)
        task[at["present"].start : at["driven"].stop].reshape(4, -1)[:] = rows
        redundant = float(aim.driven.sum()) > len(entries)
        task[at["tolerance"].start :] = (
            aim.tolerance,
            aim.unit,
            aim.solves,
            _CORRECTIONS,
            redundant,
        )
        response, drive, status = self._run(before, task, known.sliding)
        return response, drive, float(status[3]), bool(status[2]), int(status[4])

    def _run(
        self, before: np.ndarray, task: np.ndarray, sliding: np.ndarray | None = None
    ) -> tuple[Response, np.ndarray, np.ndarray]:
        chain, settings = self.prepared.long.dynamic_vector, self._numbers
        state, values, slopes, sticks, drive, status = search_drives(
            chain, before, self._commands[0][0], task, settings, self._layouts
        )
        own = self._own
        jacobian = slopes[:, own].T
        slid = jacobian
        if sliding is not None and sticks.any():
            slid = np.where(sticks > 0.0, sliding, jacobian)
        converged, whole = bool(status[0]), bool(status[1])
        return Response(state, values[own], jacobian, converged, whole, slid), drive, status

    @cached_property
    def prepared(self) -> PreparedChain:
        """The robot as arrays, with modes enough for the loads and for the state before."""
        refinement = 0 if self.start is None else self.start.refinement
        return prepare_for(self.robot, self.load, self.start, refinement)

    @cached_property
    def first(self) -> Float[np.ndarray, " state"]:
        """The state to continue from, packed for the padded chain."""
        own = self.prepared.state.pack(fitted(self.start, self.prepared.chain))
        return pad_rows(np.asarray(own), self.prepared.state, self.prepared.long.state)

    def drives(self, state: Float[np.ndarray, " state"]) -> Float[np.ndarray, " t"]:
        """Return tensions (N), of tendons driven by stroke strokes (mm), of a packed state."""
        slices = self._places
        by_stroke = ~np.isnan(self.load.stroke[0])
        return np.where(by_stroke, state[slices.stroke], state[slices.tension])

    def dead_band(
        self, state: Float[np.ndarray, " state"]
    ) -> tuple[Float[np.ndarray, " t"], Float[np.ndarray, " t"]]:
        """Return between which drives nothing moves, as the first contact of a tendon sticks.

        Exactly so while the other tendons stay as they are. A stroke always moves something.
        """
        slices, by_stroke = self._places, ~np.isnan(self.load.stroke[0])
        ratio, bound = state[slices.first_ratio], state[slices.first_bound]
        return dead_band(self.drives(state), ratio, bound, by_stroke)

    def slip(
        self, before: Float[np.ndarray, " state"], after: Float[np.ndarray, " state"]
    ) -> Float[np.ndarray, " t"]:
        """Return how far every tendon has slid at its first contact from one state to another."""
        first = self._places.first_slid
        return np.abs(after[first] - before[first])

    def friction(self, state: Float[np.ndarray, " state"]) -> Float[np.ndarray, " t"]:
        """Return the logarithm of the largest tension ratio over all contacts of every tendon."""
        return np.array([state[slices].sum() for slices in self._places.bounds])

    @cached_property
    def _places(self) -> _Places:
        long = self.prepared.long
        numbers: SolverState = jax.tree.unflatten(long.state.structure, long.state.indices)
        chain = self.prepared.chain
        ratios, bounds, slides = ([np.zeros(0, int)] * chain.tendons for _ in range(3))
        memory: Any = numbers.memory
        every = zip(chain.groups, memory.log_ratio, memory.bound, memory.slid, strict=True)
        for group, ratio, bound, slid in every:
            for column, tendon in enumerate(group.numbers):
                edges = np.asarray(chain.contacts)[tendon]
                edges = edges[edges >= 0]
                ratios[tendon] = ratio[edges // 2, column, edges % 2]
                bounds[tendon] = bound[edges // 2, column, edges % 2]
                slides[tendon] = slid[edges // 2, column, edges % 2]
        point: Any = numbers.point
        ratio, bound, slid = (np.array([one[0] for one in of]) for of in (ratios, bounds, slides))
        drawn: Any = numbers.stroke
        return _Places(point.base_tension, drawn, ratio, bound, slid, tuple(bounds))

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Positions of the entries of each output in `Response.values`."""
        ends = np.cumsum([0, *(int(np.prod(shape)) for shape in self.shapes.values())])
        return {n: slice(*ends[i : i + 2]) for i, n in enumerate(self.shapes)}

    @cached_property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of each output, in the order of `Response.values`."""
        return {name: shape for name, (shape, _) in self._selected.items()}

    @cached_property
    def _selected(self) -> dict[str, tuple[tuple[int, ...], np.ndarray]]:
        """Shape of each output of the robot itself, and where its numbers are in the padded one."""
        long, begin = self.prepared.long.chain, 0
        sizes = {"tendon": long.tendons, "notch": long.flexures, "body": long.flexures + 1}
        selected: dict[str, tuple[tuple[int, ...], np.ndarray]] = {}
        for name in self.outputs:
            shape = [sizes.get(axis, 3) for axis in REGISTERED[name].per]
            entries = begin + np.arange(int(np.prod(shape))).reshape(shape)
            begin += entries.size
            own = unpad_quantity(self.prepared.chain, name, entries.astype(float))
            selected[name] = (own.shape, own.ravel().astype(int))
        return selected

    @cached_property
    def _size(self) -> int:
        """Number of values of the outputs of the padded robot."""
        long = self.prepared.long.chain
        sizes = {"tendon": long.tendons, "notch": long.flexures, "body": long.flexures + 1}
        per = (REGISTERED[name].per for name in self.outputs)
        return sum(int(np.prod([sizes.get(axis, 3) for axis in axes])) for axes in per)

    @cached_property
    def _own(self) -> np.ndarray:
        return np.concatenate([entries for _, entries in self._selected.values()])

    @cached_property
    def _commands(self) -> tuple[np.ndarray, Any]:
        ready = self.prepared
        return ready.padded_commands(make_commands(self.load, self.robot, ready.chain))

    @cached_property
    def _plain(self) -> np.ndarray:
        """The task of solving one load, of drives that are still to be put in, packed."""
        return self._layouts.task.pack(self._blank)

    @cached_property
    def _blank(self) -> Task:
        tendons = self.prepared.long.chain.tendons
        turn = self.load.base_to_world
        return blank_task(self._size, tendons, np.eye(3) if turn is None else turn)

    @cached_property
    def _fields(self) -> dict[str, slice]:
        """Positions of the fields of a task in the packed vector."""
        numbers = zip(Task._fields, self._layouts.task.indices, strict=True)
        return {name: slice(int(at.min()), int(at.max()) + 1) for name, at in numbers}

    @cached_property
    def _layouts(self) -> SearchLayouts:
        long, form = self.prepared.long, PytreeLayout.of(self._blank)
        ratio, bound = self._places.first_ratio, self._places.first_bound
        first = tuple(ratio.tolist()), tuple(bound.tolist())
        return SearchLayouts(
            long.static_structure, self._commands[1], long.state, form, first, self.outputs
        )

    @cached_property
    def _numbers(self) -> np.ndarray:
        return np.array(self.settings.numbers, float)
