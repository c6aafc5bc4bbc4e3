"""What is done to a robot: tension or stroke at the base of every tendon, step by step."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from notchflex.errors import InputError

_FORM = "a number, or one entry per tendon with None where nothing is commanded"


@dataclass(frozen=True)
class Load:
    """One load on a robot.

    Args:
        tension: Tension at the base of every tendon, N. A single number pulls the first tendon;
            a sequence has one entry per tendon, None where its tension is not commanded.
        stroke: Tendon drawn out at the base since the free robot, mm; in the same form.
        base_rotation: Rotation vector of the base in the world, rad.

    A tendon of which neither is commanded hangs slack (0 N).

    Example:
        >>> Load(tension=2.0)
        Load(tension=2.0, stroke=None, base_rotation=(0.0, 0.0, 0.0))
    """

    tension: float | Sequence[float | None] | None = None
    stroke: float | Sequence[float | None] | None = None
    base_rotation: Sequence[float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class LoadPath:
    """Loads one after the other.

    Args:
        tension: Commanded tensions, N, steps by tendons, NaN where not commanded.
        stroke: Commanded strokes, mm, in the same form.
        base_rotation: Rotation vector of the base in the world, rad.
    """

    tension: np.ndarray
    stroke: np.ndarray
    base_rotation: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        """Check shapes and numbers."""
        tension = np.atleast_2d(_table(self.tension, "tension"))
        stroke = np.atleast_2d(_table(self.stroke, "stroke"))
        base_rotation = _rotation(self.base_rotation)
        if tension.shape != stroke.shape or tension.ndim != 2:
            raise InputError(
                f"a load path needs tension and stroke of one shape, steps by tendons; "
                f"got {tension.shape} and {stroke.shape}"
            )
        if len(tension) == 0:
            raise InputError("a load path needs at least one step; got none")
        if np.isinf(tension).any() or np.isinf(stroke).any():
            raise InputError("a tension or stroke is infinite; give finite numbers (N, mm)")
        if (tension < 0).any():
            raise InputError(
                f"a tendon can only pull: got a tension of {np.nanmin(tension):g} N, give 0 or more"
            )
        if (~np.isnan(tension) & ~np.isnan(stroke)).any():
            raise InputError(
                "tension and stroke are both given for one tendon in one step; give one of them"
            )
        object.__setattr__(self, "tension", tension)
        object.__setattr__(self, "stroke", stroke)
        object.__setattr__(self, "base_rotation", base_rotation)

    def __len__(self) -> int:
        """Number of steps."""
        return len(self.tension)

    def release(self) -> LoadPath:
        """The same way there and back, the peak twice.

        Example:
            >>> len(pull(0.0, 3.0, steps=31).release())
            62
        """
        return LoadPath(
            np.concatenate([self.tension, self.tension[::-1]]),
            np.concatenate([self.stroke, self.stroke[::-1]]),
            self.base_rotation,
        )

    def then(self, following: LoadPath) -> LoadPath:
        """This path and another after it; a tendon that one of them does not name is slack in it.

        Raises:
            InputError: What follows is no path.

        Example:
            >>> pull(0.0, 1.0, steps=2).then(pull(1.0, 1.0, steps=1, tendon=2)).tension.tolist()
            [[0.0, nan], [1.0, nan], [nan, 1.0]]
        """
        if not isinstance(following, LoadPath):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError(
                f"a load path goes on with another notchflex.LoadPath; got {_shown(following)}"
            )
        count = max(self.tension.shape[1], following.tension.shape[1])
        first, second = self.for_tendons(count), following.for_tendons(count)
        return LoadPath(
            np.concatenate([first.tension, second.tension]),
            np.concatenate([first.stroke, second.stroke]),
            self.base_rotation,
        )

    def for_tendons(self, count: int) -> LoadPath:
        """The same path for a robot of so many tendons; tendons not named hang slack."""
        given = self.tension.shape[1]
        if given > count:
            raise InputError(
                f"the load commands {given} tendons, but the robot has {count}; "
                f"give at most {count}"
            )
        added = np.full((len(self), count - given), np.nan)
        return LoadPath(
            np.concatenate([self.tension, added], axis=1),
            np.concatenate([self.stroke, added], axis=1),
            self.base_rotation,
        )


def pull(start: float, stop: float, steps: int = 31, *, tendon: int = 1) -> LoadPath:
    """Pull one tendon by tension, from one value to another in equal steps.

    Args:
        start: First tension, N.
        stop: Last tension, N.
        steps: Number of steps, both ends included.
        tendon: Which tendon, counted from 1.

    Returns:
        The path; `.release()` adds the way back.

    Raises:
        InputError: Fewer than one step, a negative or infinite tension, no such tendon.

    Example:
        >>> pull(0.0, 3.0, steps=4).tension[:, 0].tolist()
        [0.0, 1.0, 2.0, 3.0]
    """
    return _ramp("tension", start, stop, steps, tendon)


def draw(start: float, stop: float, steps: int = 31, *, tendon: int = 1) -> LoadPath:
    """Draw one tendon by stroke, from one value to another in equal steps.

    Args:
        start: First stroke, mm.
        stop: Last stroke, mm.
        steps: Number of steps, both ends included.
        tendon: Which tendon, counted from 1.

    Returns:
        The path; `.release()` adds the way back.

    Raises:
        InputError: Fewer than one step, an infinite stroke, no such tendon.

    Example:
        >>> draw(0.0, 1.0, steps=3).stroke[:, 0].tolist()
        [0.0, 0.5, 1.0]
    """
    return _ramp("stroke", start, stop, steps, tendon)


def _ramp(what: str, start: float, stop: float, steps: int, tendon: int) -> LoadPath:
    steps, tendon = _whole(steps, "steps"), _whole(tendon, "tendon")
    if steps < 1:
        raise InputError(f"a range needs at least one step; got {steps}")
    if tendon < 1:
        raise InputError(f"tendons are counted from 1; got {tendon}")
    first, last = _number(start, f"the first {what}"), _number(stop, f"the last {what}")
    commanded = np.full((steps, tendon), np.nan)
    with np.errstate(over="ignore", invalid="ignore"):
        commanded[:, tendon - 1] = np.linspace(first, last, steps)
    if not np.isfinite(commanded[:, tendon - 1]).all():
        raise InputError(f"a {what} range needs finite ends; got {first:g} and {last:g}")
    nothing = np.full_like(commanded, np.nan)
    return LoadPath(commanded, nothing) if what == "tension" else LoadPath(nothing, commanded)


def load_path(loads: Load | LoadPath | Iterable[Any], tendons: int) -> LoadPath:
    """Bring loads of any form to one path for a robot of so many tendons.

    Args:
        loads: A path, one load, or loads in order.
        tendons: Number of tendons of the robot.

    Returns:
        The path, every tendon named.

    Raises:
        InputError: Too many entries, numbers that are no loads, a base that turns on the way.
    """
    if isinstance(loads, LoadPath):
        return loads.for_tendons(tendons)
    try:
        every = [loads] if isinstance(loads, Load) else list(loads)
    except TypeError:
        raise InputError(
            f"loads must be a notchflex.Load, a LoadPath or Loads in order; got {_shown(loads)}"
        ) from None
    if not every:
        raise InputError("there are no loads; give at least one")
    for load in every:
        if not isinstance(load, Load):
            raise InputError(f"a load must be a notchflex.Load; got {type(load).__name__}")
    rotation = _rotation(every[0].base_rotation)
    if any((_rotation(load.base_rotation) != rotation).any() for load in every):
        raise InputError("base_rotation must be the same for all loads of a path")
    return LoadPath(
        np.stack([_entries(load.tension, tendons, "tension") for load in every]),
        np.stack([_entries(load.stroke, tendons, "stroke") for load in every]),
        rotation,
    )


def _entries(value: Any, tendons: int, what: str) -> np.ndarray:
    """One number per tendon, NaN where nothing is commanded."""
    if hasattr(value, "__array__"):
        value = np.asarray(value).tolist()
    several = isinstance(value, Sequence) and not isinstance(value, str | bytes)
    given: list[Any] = list(value) if several else [value]
    if len(given) > tendons:
        raise InputError(
            f"{what} has {len(given)} entries, but the robot has {tendons} tendons; "
            f"give at most {tendons}"
        )
    entries = np.full(tendons, np.nan)
    for i, entry in enumerate(given):
        if entry is None:
            continue
        entries[i] = _number(entry, what, _FORM)
        if not np.isfinite(entries[i]):
            raise InputError(f"{what} must be finite; got {_shown(entry)}")
    return entries


def _number(value: Any, what: str, form: str = "a number") -> float:
    """A number, which text and truth values are not."""
    try:
        if isinstance(value, str | bytes | bytearray | bool | np.bool_):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{what} must be {form}; got {_shown(value)}") from None


def _whole(value: Any, what: str) -> int:
    try:
        if isinstance(value, bool | np.bool_):
            raise TypeError
        return operator.index(value)
    except TypeError:
        raise InputError(f"{what} must be a whole number; got {_shown(value)}") from None


def _table(value: Any, what: str) -> np.ndarray:
    """Numbers, steps by tendons; None within them is NaN."""
    try:
        if value is None or np.asarray(value).dtype.kind not in "iufO":
            raise TypeError
        return np.asarray(value, float)
    except (TypeError, ValueError, OverflowError):
        raise InputError(
            f"{what} of a load path must be numbers, steps by tendons; got {_shown(value)}"
        ) from None


def _rotation(value: Any) -> np.ndarray:
    try:
        rotation = np.asarray(value, float)
    except (TypeError, ValueError, OverflowError):
        rotation = np.empty(0)
    if rotation.shape != (3,) or not np.isfinite(rotation).all():
        raise InputError(
            f"base_rotation needs three finite numbers (rotation vector, rad); got {_shown(value)}"
        )
    return rotation


def _shown(value: Any) -> str:
    """A value as Python writes it, cut short."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # a whole number of thousands of digits
        text = f"a huge {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."
