"""One state of a path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

import numpy as np
from jaxtyping import Float, Int

from notchflex._summary import Displayed, Summary
from notchflex.errors import ConvergenceError
from notchflex.loads import Load
from notchflex.results.quantities.properties import EquilibriumQuantities
from notchflex.results.state import State
from notchflex.robot import Robot

if TYPE_CHECKING:  # for the types only: a path hands out its states
    from matplotlib.axes import Axes
    from xarray import Dataset

    from notchflex._plot import Picture
    from notchflex.results.path import EquilibriumPath


class Equilibrium(EquilibriumQuantities, Displayed):
    """One state of a path: every quantity of `EquilibriumPath`, without the axis of steps.

    Example:
        >>> from notchflex import Load, load_robot, solve
        >>> solve(load_robot("pacheco2021-a"), Load(tension=1.0))
        Equilibrium of Pacheco 2021, wrist A
          load            tension 1 N
          total angle     51.50 deg
          notch angles    11.2, 10.4, 10.2, 9.9, 9.7 deg
          tip position    (4.513, 0.000, 7.879) mm
          tendon tension  1 N
          tendon stroke   1.246 mm
          converged       yes
    """

    def __init__(self, path: EquilibriumPath, step: int) -> None:
        """Look at one step of a path."""
        self._path = path
        self._step = step

    @property
    def path(self) -> EquilibriumPath:
        """The path that it is a state of."""
        return self._path

    @property
    def step(self) -> int:
        """Which step of the path it is, counted from 0."""
        return self._step

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self._path.robot

    @property
    def load(self) -> Load:
        """The load of this step."""
        return self._path.load[self._step]

    def quantity(self, name: str) -> Any:
        """Return a quantity by its name: a number, or an array without the axis of steps.

        Args:
            name: Name of a property, such as "notch_angle".
        """
        value = self._path.quantity(name)[self._step]
        return value.item() if isinstance(value, np.generic) else value

    @property
    def front(self) -> tuple[Int[np.ndarray, " t"], Float[np.ndarray, " t"]]:
        """Friction front along every tendon, m and eta; see `EquilibriumPath.front`."""
        return self.front_contact, self.front_eta

    @property
    def state(self) -> State:
        """This state, to save or continue from."""
        return self._path.state_at(self._step)

    def to_dict(self) -> dict[str, Any]:
        """Return this state as plain values: a step of the JSON document of its path.

        Returns:
            Values by the JSON keys, whose names end with the unit; angles in deg.

        Example:
            >>> from notchflex import Load, load_robot, solve
            >>> step = solve(load_robot("pacheco2021-a"), Load(tension=1.0)).to_dict()
            >>> step["load"], round(step["total_angle_deg"], 1)
            ({'tension_N': [1.0], 'stroke_mm': [None]}, 51.5)
        """
        from notchflex.results.files.json import step_document

        return step_document(self._path, self._step)

    def to_xarray(self) -> Dataset:
        """Convert the state to a labelled data set, as `EquilibriumPath.to_xarray` at this step."""
        return self._path.to_xarray().isel(step=self._step)

    @overload
    def plot(self) -> Picture: ...
    @overload
    def plot(self, *, ax: Axes) -> Axes: ...
    def plot(self, *, ax: Axes | None = None) -> Picture | Axes:
        """Draw this state; see `notchflex.plot`.

        Args:
            ax: Axes of matplotlib to draw the bent robot into.

        Returns:
            The picture of robot, notch angles and tensions, which a notebook shows; the axes if
            some were given.
        """
        from notchflex._plot import plot

        return plot(self, ax=ax)

    def raise_if_failed(self) -> Equilibrium:
        """Return itself, if it converged.

        Raises:
            ConvergenceError: It did not; the message says why.
        """
        if not self.converged:
            raise ConvergenceError(self.reason, self.path.failures[self.step][0])
        return self

    def _summary(self) -> Summary:
        from notchflex.results.summary import equilibrium_summary

        return equilibrium_summary(self)
