"""Loads on a robot one after the other, as arrays over the steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isnan
from typing import Any

import numpy as np
from jaxtyping import Int

from notchflex._summary import Displayed, Summary
from notchflex.errors import InputError
from notchflex.loads.external import EXTERNAL, NOTHING, BodyForce, ExternalLoad
from notchflex.loads.load import BASE_TURN, Load
from notchflex.loads.validation import shown, table, vector


@dataclass(frozen=True, repr=False)
class LoadPath(Displayed):
    """Loads one after the other.

    Args:
        tension: Commanded tensions, N, steps by tendons, NaN where not commanded.
        stroke: Commanded strokes, mm, in the same form.
        base_rotation: Rotation vector of the base in the world, rad.
        external: What acts from outside at each step; nothing where not given. `loaded` puts the
            same on all steps.
    """

    tension: np.ndarray
    stroke: np.ndarray
    base_rotation: np.ndarray = field(default_factory=lambda: np.zeros(3))
    external: tuple[ExternalLoad, ...] = ()

    def __post_init__(self) -> None:
        """Check shapes and numbers."""
        tension = np.atleast_2d(table(self.tension, "tension"))
        stroke = np.atleast_2d(table(self.stroke, "stroke"))
        base_rotation = np.array(vector(self.base_rotation, *BASE_TURN))
        if tension.shape != stroke.shape or tension.ndim != 2:
            raise InputError.WRONG_SHAPE(
                f"a load path needs tension and stroke of one shape, steps by tendons; "
                f"got {tension.shape} and {stroke.shape}"
            )
        object.__setattr__(self, "tension", tension)
        object.__setattr__(self, "stroke", stroke)
        object.__setattr__(self, "base_rotation", base_rotation)
        object.__setattr__(self, "external", _for_steps(self.external, len(tension)))
        if tension.size and np.isnan(stroke).all() and 0.0 <= tension.min() < np.inf:
            return  # nothing but tensions that a tendon can have
        if len(tension) == 0:
            raise InputError.NO_DATA("a load path needs at least one step; got none")
        if np.isinf(tension).any() or np.isinf(stroke).any():
            raise InputError.NOT_FINITE(
                "a tension or stroke is infinite; give finite numbers (N, mm)"
            )
        if (tension < 0).any():
            raise InputError.OUT_OF_RANGE(
                f"a tendon can only pull: got a tension of {np.nanmin(tension):g} N, give 0 or more"
            )
        if (~np.isnan(tension) & ~np.isnan(stroke)).any():
            raise InputError.CONFLICT(
                "tension and stroke are both given for one tendon in one step; give one of them"
            )

    @classmethod
    def checked(
        cls,
        tension: np.ndarray,
        stroke: np.ndarray,
        base_rotation: np.ndarray,
        external: tuple[ExternalLoad, ...],
    ) -> LoadPath:
        """A path of what needs no check any more; a control loop makes one for every solve."""
        made = object.__new__(cls)
        vars(made).update(
            tension=tension, stroke=stroke, base_rotation=base_rotation, external=external
        )
        return made

    def __len__(self) -> int:
        """Number of steps."""
        return len(self.tension)

    def __getitem__(self, step: int) -> Load:
        """Return the load of one step, counted from 0.

        Raises:
            IndexError: There is no such step.

        Example:
            >>> from notchflex import pull
            >>> pull(0.0, 3.0, steps=31)[10]
            Load(tension=1.0)
        """
        if not -len(self) <= step < len(self):
            raise IndexError(f"step {step} of a load path of {len(self)} steps")
        return Load(
            _as_given(self.tension[step]),
            _as_given(self.stroke[step]),
            tuple(self.base_rotation.tolist()),
            **{name: getattr(self.external[step], name) for name in EXTERNAL},
        )

    def _summary(self) -> Summary:
        from notchflex.loads.summary import load_path_summary

        return load_path_summary(self)

    @cached_property
    def different(self) -> list[ExternalLoad]:
        """What acts from outside, each different load once, in order."""
        if len(self.external) == 1:
            return list(self.external)
        return list(dict.fromkeys(self._by_identity.values()))

    @cached_property
    def which(self) -> Int[np.ndarray, " s"]:
        """Which of the different loads acts at each step."""
        number = {one: i for i, one in enumerate(self.different)}
        seen = {identity: number[one] for identity, one in self._by_identity.items()}
        return np.array([seen[id(one)] for one in self.external])

    @property
    def _by_identity(self) -> dict[int, ExternalLoad]:
        """Usually all steps carry the very same, which is sooner seen than that they are equal."""
        return {id(one): one for one in self.external}

    def release(self) -> LoadPath:
        """The same way there and back, the peak twice.

        Example:
            >>> from notchflex import pull
            >>> len(pull(0.0, 3.0, steps=31).release())
            62
        """
        return replace(
            self,
            tension=np.concatenate([self.tension, self.tension[::-1]]),
            stroke=np.concatenate([self.stroke, self.stroke[::-1]]),
            external=self.external + self.external[::-1],
        )

    def then(self, following: LoadPath) -> LoadPath:
        """This path and another after it; a tendon that one of them does not name is slack in it.

        Raises:
            InputError: What follows is no path.

        Example:
            >>> from notchflex import pull
            >>> pull(0.0, 1.0, steps=2).then(pull(1.0, 1.0, steps=1, tendon=2)).tension.tolist()
            [[0.0, nan], [1.0, nan], [nan, 1.0]]
        """
        if not isinstance(following, LoadPath):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError.WRONG_TYPE(
                f"a load path goes on with another notchflex.LoadPath; got {shown(following)}"
            )
        count = max(self.tension.shape[1], following.tension.shape[1])
        first, second = self.for_tendons(count), following.for_tendons(count)
        return replace(
            self,
            tension=np.concatenate([first.tension, second.tension]),
            stroke=np.concatenate([first.stroke, second.stroke]),
            external=self.external + following.external,
        )

    def part(self, start: int, steps: int) -> LoadPath:
        """Some of its steps, from one on."""
        own = slice(start, start + steps)
        return replace(
            self, tension=self.tension[own], stroke=self.stroke[own], external=self.external[own]
        )

    def loaded(
        self,
        *,
        tip_force: Sequence[float] | None = None,
        tip_moment: Sequence[float] | None = None,
        tip_point: Sequence[float] | None = None,
        following: bool | None = None,
        body_forces: Sequence[BodyForce] | None = None,
        tip_mass: float | None = None,
        gravity: Sequence[float] | None = None,
    ) -> LoadPath:
        """The same path with external loads on all its steps.

        Args:
            tip_force: Force at the tip, N; this and all others as in `Load`.
            tip_moment: Moment at the tip, N mm.
            tip_point: Where the tip force acts and the tip mass hangs, mm.
            following: Whether tip force and tip moment turn with the tip.
            body_forces: Forces and moments on single bodies.
            tip_mass: Mass that hangs at the tip point, g.
            gravity: Acceleration of gravity in the world, m/s^2.

        What is not given stays as it is.

        Raises:
            InputError: A value is not of its form.

        Example:
            >>> from notchflex import pull
            >>> path = pull(0.0, 1.0, steps=2).loaded(tip_force=(0.0, 0.1, 0.0))
            >>> [one.tip_force for one in path.release().external]
            [(0.0, 0.1, 0.0), (0.0, 0.1, 0.0), (0.0, 0.1, 0.0), (0.0, 0.1, 0.0)]
        """
        every: dict[str, Any] = {
            "tip_force": tip_force,
            "tip_moment": tip_moment,
            "tip_point": tip_point,
            "following": following,
            "body_forces": body_forces,
            "tip_mass": tip_mass,
            "gravity": gravity,
        }
        given = {name: value for name, value in every.items() if value is not None}
        # Usually all steps carry the same: each different load is made and checked once.
        changed = [replace(one, **given) for one in self.different]
        return replace(self, external=tuple(changed[number] for number in self.which.tolist()))

    def for_tendons(self, count: int) -> LoadPath:
        """The same path for a robot of so many tendons; tendons not named hang slack."""
        given = self.tension.shape[1]
        if given == count:
            return self
        if given > count:
            raise InputError.WRONG_SHAPE(
                f"the load commands {given} tendons, but the robot has {count}; "
                f"give at most {count}"
            )
        added = np.full((len(self), count - given), np.nan)
        return replace(
            self,
            tension=np.concatenate([self.tension, added], axis=1),
            stroke=np.concatenate([self.stroke, added], axis=1),
        )


def joined_paths(paths: Sequence[LoadPath]) -> LoadPath:
    """Paths for equally many tendons one after the other, as one.

    Raises:
        InputError: Their bases are turned differently.
    """
    if any((path.base_rotation != paths[0].base_rotation).any() for path in paths):
        raise InputError.CONFLICT("base_rotation must be the same for all paths of a batch")
    return LoadPath(
        np.concatenate([path.tension for path in paths]),
        np.concatenate([path.stroke for path in paths]),
        paths[0].base_rotation,
        tuple(external for path in paths for external in path.external),
    )


def _as_given(values: np.ndarray) -> float | list[float | None] | None:
    """Return one entry per tendon as a `Load` takes them: a number for a single tendon."""
    entries = [None if isnan(value) else value for value in values.tolist()]
    if all(entry is None for entry in entries):
        return None
    return entries[0] if len(entries) == 1 else entries


def _for_steps(external: Any, steps: int) -> tuple[ExternalLoad, ...]:
    """What acts from outside, one entry per step."""
    try:
        given = tuple(external)
        different = {id(one): one for one in given}
        if not all(isinstance(one, ExternalLoad) for one in different.values()):
            raise TypeError
    except TypeError:
        raise InputError.WRONG_TYPE(
            "external of a load path must hold one ExternalLoad per step; "
            f"got {shown(external)}; LoadPath.loaded(tip_force=...) puts a load on all steps"
        ) from None
    if given and len(given) != steps:
        raise InputError.WRONG_SHAPE(
            f"external of a load path has {len(given)} entries, but there are {steps} steps; "
            "give one per step"
        )
    if any(isinstance(one, Load) for one in different.values()):
        given = tuple(one.external for one in given)
    return given or (NOTHING,) * steps


__all__ = ["LoadPath", "joined_paths"]
