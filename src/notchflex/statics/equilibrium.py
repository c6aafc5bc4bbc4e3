"""One state of a path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from notchflex.statics.state import State

if TYPE_CHECKING:  # for the type only: a path hands out its states
    from xarray import Dataset

    from notchflex.statics.path import Path

# What a path has and one of its states has not.
_OF_PATHS = {"run", "prepared", "chain", "load", "each_from_rest", "settings"}


class ConvergenceError(RuntimeError):
    """A result was asked to be converged and is not."""


class Equilibrium:
    """One state of a path: every quantity of `Path`, without the axis of steps.

    Example:
        >>> from notchflex import Load, load_robot, solve
        >>> wrist = solve(load_robot("pacheco2021-a"), Load(tension=1.0))
        >>> wrist.notch_angle.shape
        (5,)
    """

    def __init__(self, path: Path, step: int) -> None:
        """Look at one step of a path."""
        self._path = path
        self._step = step

    @property
    def path(self) -> Path:
        """The path that it is a state of."""
        return self._path

    @property
    def step(self) -> int:
        """Which step of the path it is, counted from 0."""
        return self._step

    def __getattr__(self, name: str) -> Any:
        """A quantity of the path, at this step."""
        if name.startswith("_") or name in _OF_PATHS:
            raise AttributeError(name)
        value = getattr(self._path, name)
        if isinstance(value, tuple):  # such as the friction front, m and eta
            return tuple(part[self._step] for part in cast("tuple[Any, ...]", value))
        return value if name == "robot" else value[self._step]

    @property
    def state(self) -> State:
        """This state, to save or continue from."""
        return self._path.state_at(self._step)

    def to_xarray(self) -> Dataset:
        """This state as a labelled data set: what `Path.to_xarray` has, at this step."""
        return self._path.to_xarray().isel(step=self._step)

    def raise_if_failed(self) -> Equilibrium:
        """Itself, if it converged.

        Raises:
            ConvergenceError: It did not; the message says why.
        """
        if not self.converged:
            raise ConvergenceError(self.reason)
        return self


__all__ = ["ConvergenceError", "Equilibrium"]
