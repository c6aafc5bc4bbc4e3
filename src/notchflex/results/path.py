"""Result of a simulation: the states of a path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import jax.tree_util as tree_util
import numpy as np
from jaxtyping import Float, Int

from notchflex._summary import Displayed, Summary
from notchflex._values import ByValue, frozen, read_only
from notchflex.errors import ConvergenceError, Failure, InputError
from notchflex.loads import LoadPath
from notchflex.loads.command import Command, make_commands, out_of_frame
from notchflex.mechanics.chain import Chain
from notchflex.results.equilibrium import Equilibrium
from notchflex.results.quantities.path_formulas import friction_front
from notchflex.results.quantities.properties import QUANTITIES, PathQuantities
from notchflex.results.reason import why_not
from notchflex.results.recorded import Recorded
from notchflex.results.state import State
from notchflex.robot import Robot
from notchflex.solver.derived.quantities import Shape
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.run import SolverRun
from notchflex.solver.solver_state import SolverState

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from xarray import Dataset

    from notchflex._plot import Picture


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
        kept = vars(self).setdefault("_kept", {})
        if name in kept:
            return kept[name]
        if name not in QUANTITIES:
            names = ", ".join(QUANTITIES)
            raise InputError.UNKNOWN_NAME(f"there is no quantity {name!r}; there are {names}")
        quantity = QUANTITIES[name]
        if quantity.source in ("path", "derived"):
            values = quantity.formula(self)
        else:  # vectors and rotations of the solver are in the frame of the base
            values = self.solver_quantity(name)
            if quantity.in_world:
                values = quantity.turned(values, self.load.base_to_world)
        kept[name] = frozen(values)
        return kept[name]

    def _value(self) -> Any:
        solved = tuple(self.solver_quantity(name) for name in Shape._fields)
        first = (self.run.before("tension"), self.run.before("stroke"))
        return (self.robot, self.load, self.settings, self.each_from_rest, first, solved)

    def solver_quantity(self, name: str) -> np.ndarray:
        """Return a quantity that the solver reports of every step, by its name.

        Steps that were not tried repeat the last one that was: their rows are empty.
        """
        values = self.run.quantity(name)
        if len(values) == 1:  # always tried
            return values
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
        chain = self.chain
        if solved.applied is not None and chain.frame is not None:
            solved = solved._replace(applied=out_of_frame(solved.applied, chain.frame))
        name = self.robot.name
        return State(name, solved, chain.level, chain.loaded, chain.refinement, self.robot)

    @property
    def state(self) -> State:
        """State after the last converged step."""
        return self.state_at(-1)

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
        from notchflex.results.files.dataset import dataset_of

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
        from notchflex.results.files.dataframe import dataframe_of

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
        from notchflex.results.summary import path_summary

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
