"""Result of a simulation: the states of a path."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import jax.tree_util as tree_util
import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.linalg import norm
from numpy.typing import ArrayLike

from notchflex._jax import jax
from notchflex._summary import Displayed, Summary
from notchflex._values import ByValue, frozen, read_only
from notchflex.errors import ConvergenceError, Failure, InputError
from notchflex.loads import LoadPath
from notchflex.loads.command import Command, make_commands
from notchflex.mechanics.chain import Chain, unchecked_dimensions
from notchflex.mechanics.flexure import MAX_REFINEMENT
from notchflex.mechanics.tendon import Straight
from notchflex.results.quantities import QUANTITIES, PathQuantities, friction_front
from notchflex.results.state import Equilibrium, State, path_summary, state_of
from notchflex.robot import Material, Robot
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.run import SolverRun
from notchflex.solver.quantities import Shape, reported
from notchflex.solver.residual import SolverState, closing_stroke

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset

    from notchflex._plot import Picture
    from notchflex.analysis.slopes import PathGradient


# A run read back from a file: its numbers are reported without solving.

REPORTED = (*Shape._fields, *reported("state"))
"""Everything that a run reports of each state, by name."""

BEFORE = ("tension", "stroke", "wire_stroke", "span_tension", "contact_slid")
"""What is needed of the state before the first one: work is integrated from there."""

FLATTENING = "flattening"
"""What the loss of flattening is counted from, of every state; for materials that remember."""

MATERIAL = "material"
"""Memory of the material in that state, where it has any."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """States of many loads, loads as leading axis, as `SolverRun` has them."""

    solved: SolverState  # the last solved states
    reported: Mapping[str, np.ndarray]  # by the names of `REPORTED`
    first: Mapping[str, np.ndarray]  # state before the first load: `BEFORE` and others
    held: tuple[np.ndarray, np.ndarray]  # smallest eigenvalue, sign of determinant
    residual: Float[np.ndarray, " s"]
    iterations: Int[np.ndarray, " s"]
    converged: Bool[np.ndarray, " s"]
    tried: Bool[np.ndarray, " s"]
    reached: Float[np.ndarray, " s"]  # part of the way from the load before
    overdrawn: Int[np.ndarray, " s"]  # bit k: no shape allows the stroke of tendon k
    snapped: Float[np.ndarray, "s n"]  # notches that snapped shut (1) or open (-1)

    def quantity(self, name: str) -> np.ndarray:
        """Return a quantity of each state by its name in the registry."""
        return self.reported[name]

    def rows(self, some: slice) -> Recorded:
        """Return some of the loads."""
        start = np.arange(len(self.converged))[some][0]
        first = self.first
        if start:
            recorded = {**self.reported, MATERIAL: self.solved.memory.material}
            first = {name: np.asarray(recorded[name])[start - 1] for name in first}
        cut = {name: values for name, values in vars(self).items() if name != "first"}
        return Recorded(first=first, **jax.tree.map(lambda values: np.asarray(values)[some], cut))

    def before(self, name: str) -> np.ndarray:
        """Return a quantity of the state before the first load, by name."""
        return self.first[name]

    def stability(self, commands: Command) -> tuple[np.ndarray, np.ndarray]:
        """Return the smallest real part of the eigenvalues, and the determinant's sign."""
        del commands  # they were counted when it was computed
        return self.held

    def stable(self, commands: Command) -> Bool[np.ndarray, " s"]:
        """Return whether each state is stable."""
        eigenvalue, sign = self.stability(commands)
        return (eigenvalue > 0.0) & (sign > 0.0)


# Warnings on the validity of a result.

MOMENT_ERROR = 0.01
"""Relative error of the bending moment of the strain modes above which a path has a warning."""


def path_warnings(path: EquilibriumPath) -> list[str]:
    """Return one sentence for each reason to doubt a path."""
    strains = [
        warning
        for material in dict.fromkeys(path.robot.materials[1:])
        for warning in _strains_of(path, material)
    ]
    outside = unchecked_dimensions(path.robot)
    return [*outside, *_snaps(path), *strains, *_unstable(path), *_coarse(path)]


def _snaps(path: EquilibriumPath) -> Iterator[str]:
    """Warn of notches that pass a limit point under tension."""
    for event, side in (("snaps shut", 1), ("snaps open", -1)):
        steps, notches = np.nonzero(path.snap == side)
        if len(steps):
            names = ", ".join(str(notch + 1) for notch in dict.fromkeys(notches.tolist()))
            yield (
                f"notch {names} {event}, first at step {steps[0] + 1} "
                f"({_load(path, int(steps[0]))}): it passes a limit point, where it softens as it "
                "closes, so that no shape between is in equilibrium under this tension; prescribe "
                "the stroke to pass through the shapes between."
            )


def _strains_of(path: EquilibriumPath, material: Material) -> Iterator[str]:
    is_of = np.array([each == material for each in path.robot.materials[1:]])
    # The law is fitted in the outer strain of eq. 16, which therefore selects its branch.
    for strain, limit, description, consequence in (
        (
            "peak strain",
            material.allowed_strain,
            "the allowed strain of {:.3g} %",
            "the notch may be damaged there",
        ),
        (
            "outer strain",
            getattr(material, "plastic_strain", None),
            "{:.3g} %, where the plastic branch begins,",
            "that branch is a guess, and a real notch would stay bent",
        ),
    ):
        if limit is None:
            continue
        values = getattr(path, strain.replace(" ", "_"))
        size = np.where(path.converged[:, None] & is_of, np.abs(values), -np.inf)
        beyond = size > limit
        if not beyond.any():
            continue
        notches = [str(notch + 1) for notch in np.flatnonzero(beyond.any(axis=0))]
        step = int(np.flatnonzero(beyond.any(axis=1))[0])
        yield (
            f"the {strain} passes {description.format(100 * limit)} in notch"
            f"{'es' if len(notches) > 1 else ''} {', '.join(notches)}, first at step {step + 1} "
            f"({_load(path, step)}), at most {100 * np.nanmax(size):.3g} %: {consequence}."
        )


def _unstable(path: EquilibriumPath) -> Iterator[str]:
    unstable = np.flatnonzero(path.converged & ~path.stable)
    determined = path.determinant_sign[unstable] != 0.0 if len(unstable) else np.zeros(0, bool)
    indeterminate = Failure.INDETERMINATE_TENSIONS
    for steps, verdict, reason in (
        (unstable[determined], "unstable", "a real robot would snap to another shape"),
        (unstable[~determined], "not determined", f"{indeterminate.text}; {indeterminate.remedy}"),
    ):
        if len(steps):
            plural = "s are" if len(steps) > 1 else " is"
            first = f"first step {steps[0] + 1} ({_load(path, steps[0])})"
            yield f"{len(steps)} step{plural} {verdict}, {first}: {reason}."


def _coarse(path: EquilibriumPath) -> Iterator[str]:
    error = np.where(path.converged, path.moment_error, -np.inf)
    if not (error > MOMENT_ERROR).any():
        return
    step = int(np.argmax(error))
    refinement = path.chain.refinement
    remedy = (
        f"simulate with --refinement {refinement + 1} (in Python refinement={refinement + 1}) "
        "and see what changes"
        if refinement < MAX_REFINEMENT
        else "there is no finer --refinement, so take the result with care"
    )
    yield (
        f"the strain modes miss the bending moment by up to {100 * error[step]:.2g} % of the "
        f"largest one, at step {step + 1} ({_load(path, step)}): {remedy}."
    )


def _load(path: EquilibriumPath, step: int) -> str:
    return ", ".join(f"{value:.4g}" for value in path.tension[step]) + " N"


# Reasons why a step of a path did not converge, as sentences for the user.

# Largest opening of a notch that counts as closed, as a fraction of its height: a stroke converges
# up to the last state before the last notch closes.
_CLOSED_TOLERANCE = 1e-3
# Largest free span of a tendon at which the edges of its channel count as meeting, relative to the
# natural span.
_EDGES_MEET = 5e-2
# Tension of a slack tendon, relative to what friction takes: rounding.
_SLACK = 1e-6


def why_not(path: EquilibriumPath, step: int) -> tuple[Failure | None, str]:
    """Return the failure at a step, and a sentence on it; None and "" where it converged."""
    if path.converged[step]:
        return None, ""
    if not path.run.tried[step]:
        return _said(Failure.NOT_TRIED, failed=int(np.argmin(path.converged)) + 1)
    if path.run.converged[step]:  # but beyond the limits of the model
        if not path.run.quantity("bend_possible")[step]:
            return _said(Failure.BENT_TOO_FAR)
        if path.run.quantity("friction_holds")[step]:
            return _said(Failure.TOO_FEW_MODES, percent=100 * path.moment_error[step])
        return _said(Failure.FRICTION_LOCKS)
    stroke = ", ".join(f"{value:.4g}" for value in path.stroke[step])
    last = f"; the last good state has tension {_load(path, step)} and stroke {stroke} mm"
    opening = np.asarray(path.chain.rods.length).sum(axis=-1)
    all_closed = (path.gap[step] < _CLOSED_TOLERANCE * opening).all()
    drawn = path.load.stroke[step]
    past_closing = np.asarray(path.chain.inextensible) & (drawn >= closing_stroke(path.chain))
    if (all_closed or past_closing.any()) and not np.isnan(drawn).all():
        return _said(Failure.NOTCHES_CLOSED, last)
    if (slack := _slack_by_loss(path, step)) is not None:
        return _said(Failure.LOSS_LEAVES_SLACK, last, tendon=slack[0] + 1, loss=slack[1])
    overdrawn = int(path.run.overdrawn[step])
    tendons = [str(tendon + 1) for tendon in range(path.chain.tendons) if overdrawn >> tendon & 1]
    if len(tendons) == 1:
        return _said(Failure.STROKE_OUT_OF_REACH, last, tendon=tendons[0])
    if tendons:
        return _said(Failure.STROKES_CONTRADICT, last, tendons=" and ".join(tendons))
    if (met := _edges_that_meet(path, step)) is not None:
        return _said(Failure.TENDON_EDGES_MEET, last, tendon=met[0] + 1, notch=met[1] + 1)
    reached, left = 100.0 * float(path.run.reached[step]), float(path.residual[step])
    return _said(Failure.NO_EQUILIBRIUM, last, percent=reached, residual=left)


def _said(failure: Failure, last: str = "", **values: object) -> tuple[Failure, str]:
    return failure, f"{failure.text.format(**values)}{last}; {failure.remedy}"


def _edges_that_meet(path: EquilibriumPath, step: int) -> tuple[int, int] | None:
    """Return a straight tendon and a notch, from 0, where its free span vanishes."""
    # Where the edges of its channel meet before those of the notch, the span between them has no
    # direction. A compliant contact lets a closed notch reach that state.
    chain = path.chain
    position, rotation = path.body_position[step], path.body_rotation[step]
    for group in chain.groups:
        if not isinstance(group, Straight):
            continue
        leaves, enters = (_in_space(chain, points) for points in (group.leaves, group.enters))
        runs, natural = np.asarray(group.runs), np.asarray(group.natural_gap)
        for (notch, column), before in np.ndenumerate(np.asarray(group.back)):
            body, anchor = notch + 1, notch + 1 - int(before)
            entered = position[body] + rotation[body] @ enters[notch, column]
            left = position[anchor] + rotation[anchor] @ leaves[notch, column]
            if runs[notch, column] and norm(entered - left) < _EDGES_MEET * natural[notch, column]:
                return group.numbers[column], notch
    return None


def _slack_by_loss(path: EquilibriumPath, step: int) -> tuple[int, float] | None:
    """Return a tendon driven by stroke, from 0, that constant losses leave slack; their sum, N."""
    # While the slack passes from a closed notch to the next, the tension rises at the same stroke.
    for tendon in np.flatnonzero(np.isfinite(path.load.stroke[step])):
        turning = path.contact_turning[step, tendon]
        losses = path.chain.friction.constant_loss(turning)
        loss = 0.0 if losses is None else float(np.nansum(losses))
        tension = path.span_tension[step, tendon]
        if np.nanmin(tension) < _SLACK * loss < np.nanmax(tension):
            return int(tendon), loss
    return None


def _in_space(chain: Chain, points: ArrayLike) -> Float[np.ndarray, "n t 3"]:
    """Transform points of the tendons to the frames of the bodies."""
    points = np.asarray(points)
    if chain.frame is None:
        return points
    return np.insert(points, 1, 0.0, axis=-1) @ np.asarray(chain.frame).T


@dataclass(frozen=True, eq=False, repr=False)
class EquilibriumPath(ByValue, PathQuantities, Displayed):
    """Equilibria along a load path. Units mm, N, N mm, rad; s steps, n notches, t tendons.

    Where a step did not converge its row holds the last good state (its `tension` and `stroke`
    are that state's, not the commanded ones), `converged` is false and `reason` explains it; the
    later steps were not tried and hold the same state.

    Attributes:
        robot: The robot.
        load: The loads.
        prepared: The robot as arrays.
        run: Arrays that the solver returned, or those read from a file.
        each_from_rest: Whether every state starts from the same one, not from its neighbour.
        settings: Tolerance and limits of the solver.
    """

    robot: Robot
    load: LoadPath
    prepared: PreparedChain
    run: SolverRun | Recorded
    each_from_rest: bool = False
    settings: Settings = DEFAULT

    @property
    def chain(self) -> Chain:
        """The robot as arrays."""
        return self.prepared.chain

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self.load)

    @overload
    def __getitem__(self, step: int) -> Equilibrium: ...
    @overload
    def __getitem__(self, step: slice) -> EquilibriumPath: ...
    def __getitem__(self, step: int | slice) -> Equilibrium | EquilibriumPath:
        """Return one state, or the path of some of them; work is counted from its first state."""
        if isinstance(step, slice):
            return replace(self, load=self.load[step], run=self.run.rows(step))
        steps = len(self.load.tension)
        if not -steps <= step < steps:
            raise IndexError(f"step {step} of a path of {steps} steps")
        return Equilibrium(self, step % steps)

    def quantity(self, name: str) -> Any:
        """Return a quantity of every step by its name, steps as leading axis, read only.

        Args:
            name: Name of a property, such as "notch_angle".
        """
        cache = vars(self).setdefault("_cache", {})
        if name in cache:
            return cache[name]
        if name not in QUANTITIES:
            names = ", ".join(QUANTITIES)
            raise InputError.UNKNOWN_NAME(f"there is no quantity {name!r}; there are {names}")
        quantity = QUANTITIES[name]
        if quantity.source in ("path", "derived"):
            values = quantity.formula(self)
        else:  # vectors and rotations of the solver are in the frame of the base
            values = quantity.turned(self.solver_quantity(name), self.load.base_to_world)
        cache[name] = frozen(values)
        return cache[name]

    def _value(self) -> Any:
        solved = tuple(self.solver_quantity(name) for name in Shape._fields)
        first = (self.run.before("tension"), self.run.before("stroke"))
        return (self.robot, self.load, self.settings, self.each_from_rest, first, solved)

    def solver_quantity(self, name: str) -> np.ndarray:
        """Return a quantity that the solver reports of every step, by its name.

        Steps that were not tried repeat the last one that was: their rows are empty.
        """
        values = self.run.quantity(name)
        tried = self.run.tried
        if tried.all():
            return values
        return values[np.maximum.accumulate(np.where(tried, np.arange(len(tried)), 0))]

    @cached_property
    def front(self) -> tuple[Int[np.ndarray, "s t"], Float[np.ndarray, "s t"]]:
        """Front of reversed friction along every tendon, m and eta, (s, t) each.

        Gao 2017, eq. 26: the friction of contact i is that of unloading for i < m, eta times
        the largest for i = m, and that of loading for i > m. Contacts are counted from 1 at the
        base; m is one more than there are when all have turned (eta is then NaN). A tendon that
        is pulled for the first time has m = 1 and eta = 1.
        """
        contact, part = friction_front(self.contact_log_ratio, self.contact_bound)
        return frozen(contact), frozen(part)

    @cached_property
    def failures(self) -> list[tuple[Failure | None, str]]:
        """Failure at every step, and a sentence on it; None and "" where it converged."""
        return [why_not(self, step) for step in range(len(self))]

    @cached_property
    def commands(self) -> Command:
        """The loads as arrays for the solver."""
        return make_commands(self.load, self.robot, self.chain)

    @cached_property
    def stability(self) -> tuple[np.ndarray, np.ndarray]:
        """Smallest eigenvalue of the stiffness, N mm, and sign of its determinant, (s,) each."""
        value, sign = self.run.stability(self.commands)
        return read_only(value), read_only(sign)

    def state_at(self, step: int) -> State:
        """Return the state after a step (or the last good one), to save or continue from."""
        solved: SolverState = tree_util.tree_map(
            lambda leaf: read_only(np.asarray(leaf)[step]), self.run.solved
        )
        return state_of(self.robot, self.chain, solved)

    @property
    def state(self) -> State:
        """State after the last converged step."""
        return self.state_at(-1)

    def jacobian(
        self,
        names: str | Sequence[str],
        outputs: str | Sequence[str] = ("total_angle", "tip_position"),
    ) -> dict[str, np.ndarray]:
        """Differentiate quantities by numbers of the robot and by loads.

        Slopes go through the memory of the contacts. Where a contact changes between sticking and
        sliding, lips meet or the material's law has a kink, they are those of one side
        (`Differentiable.kinks` lists these). They are NaN from a step on that did not converge, and
        with friction from one that was solved in three parts or more.

        Args:
            names: Numbers of the robot file (as for `Robot.with_value`, in the units of the file)
                and loads: "tension" (N), "stroke" (mm), "tip_force" (N) and "tip_moment" (N mm).
            outputs: Names of quantities that are numbers.

        Returns:
            By name of the quantity, in the world: its slopes, steps as leading axis and a column of
            the last axis for each number. A load has one column for each of its numbers, all
            tendons or axes of the first step, then those of the second.

        Raises:
            InputError: There is no such number or quantity, or the path was read from a file.

        Example:
            >>> from notchflex import load_robot, pull, simulate
            >>> path = simulate(load_robot("pacheco2021-a"), pull(1.0, 1.0, steps=1))
            >>> path.jacobian(["notch.depth", "tension"])["total_angle"].round(2).tolist()
            [[13.3, 1.52]]
        """
        from notchflex.analysis.slopes import jacobian

        return jacobian(self, names, outputs)

    def gradient(self, weights: Mapping[str, Any]) -> PathGradient:
        """Differentiate a weighted sum of quantities by everything that the path depends on.

        It runs once backwards over the path, whatever the number of names asked for afterwards.

        Args:
            weights: By name of a quantity the weight of each of its numbers, in the shape of the
                quantity or one that broadcasts to it.

        Returns:
            The derivatives: `[name]` is that by a number of the robot or by a load, `by(names)`
            those by several; names as for `jacobian`.

        Raises:
            InputError: There is no such quantity, weights have another shape, or the path was read
                from a file.

        Example:
            >>> from notchflex import load_robot, pull, simulate
            >>> path = simulate(load_robot("pacheco2021-a"), pull(1.0, 1.0, steps=1))
            >>> gradient = path.gradient({"total_angle": 1.0})
            >>> f"{gradient['notch.depth']:.2f} rad/mm, {gradient['tension'][0, 0]:.3f} rad/N"
            '13.30 rad/mm, 1.520 rad/N'
        """
        from notchflex.analysis.slopes import gradient

        return gradient(self, weights)

    def to_xarray(self) -> Dataset:
        """Return the whole path as a labelled data set: every quantity, with its name and unit.

        Units are those of Python: mm, N, rad. `notchflex.save_path` writes a NetCDF file of it
        that `notchflex.read_path` reads back, with the states that a simulation continues from.

        Raises:
            InputError: xarray is not installed.

        Example:
            >>> from notchflex import load_robot, pull, simulate
            >>> path = simulate(load_robot("pacheco2021-a"), pull(0.0, 1.0, steps=3))
            >>> path.to_xarray()["notch_angle"].dims
            ('step', 'notch')
        """
        from notchflex.results.io import dataset_of

        return dataset_of(self)

    def to_dataframe(self, library: str = "polars") -> Any:
        """Return the path as a table of one row per step, with the columns of the CSV file.

        Units stand in the names of the columns: mm, N and, unlike the properties, deg.

        Args:
            library: "polars" or "pandas".

        Returns:
            A `polars.DataFrame` or a `pandas.DataFrame`.

        Raises:
            InputError: The library is not installed, or there is no such library.

        Example:
            >>> from notchflex import load_robot, pull, simulate
            >>> path = simulate(load_robot("pacheco2021-a"), pull(0.0, 1.0, steps=3))
            >>> path.to_dataframe().select("tendon_force_N", "notch_5_deg").shape
            (3, 2)
        """
        from notchflex.results.io import dataframe_of

        return dataframe_of(self, library)

    @overload
    def plot(self) -> Picture: ...
    @overload
    def plot(self, x: str, y: str, *, ax: Axes | None = None) -> Axes: ...
    def plot(
        self, x: str | None = None, y: str | None = None, *, ax: Axes | None = None
    ) -> Picture | Axes:
        """Draw the path, or one of its quantities over another; see `notchflex.plot`.

        Args:
            x: Quantity or CSV column on the horizontal axis, such as "stroke".
            y: The same on the vertical axis, such as "tension" or "notch_3_deg".
            ax: Axes of matplotlib to draw into; new ones if None.

        Returns:
            Without x and y the usual picture, which a notebook shows; otherwise the axes.

        Raises:
            InputError: There is no such quantity, it can't be drawn, or matplotlib is missing.
        """
        from notchflex._plot import plot

        return plot(self, x, y, ax=ax)

    def _summary(self) -> Summary:
        return path_summary(self)

    def raise_if_failed(self) -> EquilibriumPath:
        """Return itself, if every step converged.

        Raises:
            ConvergenceError: A step did not; the message says which and why.
        """
        if not self.converged.all():
            step = int(np.argmin(self.converged))
            failure, text = self.failures[step]
            raise ConvergenceError(f"step {step + 1} of {len(self)}: {text}", failure)
        return self
