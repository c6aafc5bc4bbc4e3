"""A robot prepared for control: one compiled program solves a load and differentiates it.

`nf.solve` prepares robot, load and result anew each time and returns everything that may be asked.
A search or a control loop asks for a few quantities and their derivatives by the drives, hundreds
of times a second: here all that stays the same is packed once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex import LoadPath, Robot, State, Stepper
from notchflex.analysis.outputs import reported_shapes
from notchflex.control.program.compiled_search import SearchLayouts, Task, blank_task, search_drives
from notchflex.loads.command import make_commands
from notchflex.solver.programs.compiled import Packed
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import PytreeLayout, padded_indices


class Response(NamedTuple):
    """A solved load, and how what was asked of it changes with the drives.

    Attributes:
        state: The state, packed as for a `Stepper`.
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


@dataclass(frozen=True, eq=False)
class DriveModel:
    """A robot under given external loads, as a function of its drives and of the state before.

    Attributes:
        robot: The robot.
        load: One step: which tendons are driven by stroke, and the external loads.
        outputs: Quantities that are asked.
        start: State to continue from; rest where None.
    """

    robot: Robot
    load: LoadPath
    outputs: tuple[str, ...]
    start: State | None = None

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
        ready, own = self.prepared, self._own
        state, values, slopes, sticks, drive, status = search_drives(
            ready.long.packed,
            ready.packed_states(before)._replace(by_row=False),
            self._command,
            Packed(task, self._task_layout),
            self._numbers,
            self._layouts,
        )
        state = state[padded_indices(ready.state, ready.long.state)]
        jacobian = slopes[:, own].T
        slid = jacobian
        if sliding is not None and sticks.any():
            slid = np.where(sticks > 0.0, sliding, jacobian)
        converged, whole = bool(status[0]), bool(status[1])
        return Response(state, values[own], jacobian, converged, whole, slid), drive, status

    @cached_property
    def stepper(self) -> Stepper:
        """The robot step by step."""
        words: Any = np.where(np.isnan(self.load.stroke[0]), "tension", "stroke").tolist()
        return Stepper(
            self.robot,
            self.outputs,
            drives=words,
            loads=replace(self.load[0], tension=None, stroke=None),
            from_state=self.start,
            refinement=0 if self.start is None else self.start.refinement,
        )

    @property
    def prepared(self) -> PreparedChain:
        """The robot as arrays, with modes enough for the loads and for the state before."""
        return self.stepper.prepared

    @cached_property
    def first(self) -> Float[np.ndarray, " state"]:
        """The state to continue from, packed."""
        return self.stepper.start()

    def drives(self, state: Float[np.ndarray, " state"]) -> Float[np.ndarray, " t"]:
        """Return tensions (N), of tendons driven by stroke strokes (mm), of a packed state."""
        return self.stepper.drives_of(state)

    def dead_band(
        self, state: Float[np.ndarray, " state"]
    ) -> tuple[Float[np.ndarray, " t"], Float[np.ndarray, " t"]]:
        """Return the lowest and highest drives between which nothing moves."""
        low, high = self.stepper.dead_band(state).T
        return low, high

    def slip(
        self, before: Float[np.ndarray, " state"], after: Float[np.ndarray, " state"]
    ) -> Float[np.ndarray, " t"]:
        """Return how far every tendon has slid at its first contact from one state to another."""
        first = self.stepper.contact_places[2, :, 0]
        return np.abs(after[first] - before[first])

    def friction(self, state: Float[np.ndarray, " state"]) -> Float[np.ndarray, " t"]:
        """Return the logarithm of the largest tension ratio over all contacts of every tendon."""
        places = self.stepper.contact_places[1]
        return np.where(places >= 0, state[places], 0.0).sum(axis=1)

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Positions of the entries of each output in `Response.values`."""
        return {name: place for name, (place, _) in self.stepper.places.items()}

    @property
    def _own(self) -> np.ndarray:
        return self.stepper.entries

    @cached_property
    def _command(self) -> Packed:
        commands = make_commands(self.load, self.robot, self.prepared.chain)
        loads = self.prepared.packed_commands(commands)
        return Packed(loads.numbers[0], loads.layout)

    @cached_property
    def _plain(self) -> np.ndarray:
        """The task of solving one load, of drives that are still to be put in, packed."""
        return self._task_layout.pack(self._blank)

    @cached_property
    def _blank(self) -> Task:
        tendons = self.prepared.long.chain.tendons
        turn = self.load.base_to_world
        long = self.prepared.long
        shapes = reported_shapes(long.static_structure, long.state, self.outputs)
        size = sum(int(np.prod(shape)) for shape in shapes.values())
        return blank_task(size, tendons, np.eye(3) if turn is None else turn)

    @cached_property
    def _fields(self) -> dict[str, slice]:
        """Positions of the fields of a task in the packed vector."""
        numbers = zip(Task._fields, self._task_layout.indices, strict=True)
        return {name: slice(int(at.min()), int(at.max()) + 1) for name, at in numbers}

    @cached_property
    def _layouts(self) -> SearchLayouts:
        long = self.prepared.long
        places = padded_indices(self.prepared.state, long.state)
        ratio, bound = places[self.stepper.contact_places[:2, :, 0]]
        first = tuple(ratio.tolist()), tuple(bound.tolist())
        return SearchLayouts(long.state, first, self.outputs)

    @cached_property
    def _task_layout(self) -> PytreeLayout:
        return PytreeLayout.of(self._blank)

    @cached_property
    def _numbers(self) -> np.ndarray:
        return np.array(self.stepper.settings.numbers, float)
