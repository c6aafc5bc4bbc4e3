"""Load paths: the loads on a robot step by step, as arrays over the steps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, overload

import numpy as np
from jaxtyping import Float, Int

from notchflex._summary import Displayed, Summary
from notchflex._values import ByValue, read_only
from notchflex.errors import InputError
from notchflex.loads.external import EXTERNAL, BodyForce, ExternalLoad, external_of_steps
from notchflex.loads.load import Load, check_turn, entries_of, rotation_of
from notchflex.loads.validation import (
    check_table,
    one_or_several,
    short_repr,
)

_TURNED = (
    "base_rotation must be the same for all loads of a path and for all paths of a batch; "
    "make a path or a batch for each"
)


@dataclass(frozen=True, repr=False, eq=False)
class LoadPath(ByValue, Displayed):
    """Loads step by step; its arrays are read-only copies.

    Args:
        tension: Commanded tensions, N, steps by tendons, NaN where not commanded; None for none.
        stroke: Commanded strokes, mm, in the same form; none by default.
        base_rotation: Rotation vector of the base in the world, rad.
        external: External loads, one per step; none by default. `loaded` puts the same on all.

    Attributes:
        different: The distinct external loads, in order.

    Raises:
        InputError: Unequal shapes, no step, a negative or infinite number, or both tension and
            stroke for one tendon.

    Example:
        >>> LoadPath([[0.0], [1.0]]) == LoadPath([[0.0], [0.5], [1.0]])[::2]
        True
    """

    tension: np.ndarray = None  # pyright: ignore[reportAssignmentType]
    stroke: np.ndarray = None  # pyright: ignore[reportAssignmentType]
    base_rotation: np.ndarray = field(default_factory=lambda: np.zeros(3))
    external: tuple[ExternalLoad, ...] = ()
    different: list[ExternalLoad] = field(init=False)

    def __post_init__(self) -> None:
        """Check shapes and numbers."""
        tension: Any = self.tension
        stroke: Any = self.stroke
        if tension is None and stroke is None:
            raise InputError.NO_DATA("a load path needs tensions (N) or strokes (mm); got neither")
        pairs: Any = (("tension", tension, stroke), ("stroke", stroke, tension))
        tension, stroke = (
            read_only(
                np.full(np.atleast_2d(other).shape, np.nan)
                if table is None
                else np.atleast_2d(check_table(table, name))
            )
            for name, table, other in pairs
        )
        base_rotation = read_only(check_turn(self.base_rotation))
        if tension.shape != stroke.shape or tension.ndim != 2:
            raise InputError.WRONG_SHAPE(
                f"a load path needs tension and stroke of one shape, steps by tendons; "
                f"got {tension.shape} and {stroke.shape}"
            )
        external = external_of_steps(self.external, len(tension))
        vars(self).update(vars(LoadPath.of_valid(tension, stroke, base_rotation, external)))
        if tension.size and not self.draws and 0.0 <= tension.min() < np.inf:
            return  # valid tensions alone: the common case
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
    def of_valid(
        cls,
        tension: np.ndarray,
        stroke: np.ndarray,
        base_rotation: np.ndarray,
        external: tuple[ExternalLoad, ...],
    ) -> LoadPath:
        """Make a path of valid values without checks, for control loops."""
        path = object.__new__(cls)
        fields = vars(path)
        fields["tension"], fields["stroke"], fields["base_rotation"] = (
            tension,
            stroke,
            base_rotation,
        )
        # Usually all steps share one object; identity is faster than equality.
        several = external if len(external) == 1 else {id(one): one for one in external}.values()
        fields["external"] = external
        fields["different"] = [*several] if len(several) == 1 else [*dict.fromkeys(several)]
        return path

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self.tension)

    @overload
    def __getitem__(self, step: int) -> Load: ...
    @overload
    def __getitem__(self, step: slice | Int[np.ndarray, " k"]) -> LoadPath: ...
    def __getitem__(self, step: int | slice | Int[np.ndarray, " k"]) -> Load | LoadPath:
        """Return the load of one step, counted from 0, or the path of some steps.

        Raises:
            IndexError: No such step.
            InputError: No step is left.

        Example:
            >>> from notchflex import pull
            >>> pull(0.0, 3.0, steps=31)[10]
            Load(tension=1.0)
        """
        if isinstance(step, slice | np.ndarray):
            which = range(len(self))[step] if isinstance(step, slice) else step.tolist()
            external = tuple([self.external[number] for number in which])
            return LoadPath(self.tension[step], self.stroke[step], self.base_rotation, external)
        if not -len(self) <= step < len(self):
            raise IndexError(f"step {step} of a load path of {len(self)} steps")
        return Load(
            entries_of(self.tension[step]),
            entries_of(self.stroke[step]),
            tuple(self.base_rotation.tolist()),
            **vars(self.external[step]),
        )

    def _summary(self) -> Summary:
        from notchflex.loads.summary import load_path_summary

        return load_path_summary(self)

    @property
    def base_to_world(self) -> Float[np.ndarray, "3 3"] | None:
        """Rotation matrix from the frame of the base to the world; None for the identity."""
        return rotation_of(tuple(self.base_rotation.tolist()))

    @cached_property
    def target(self) -> Float[np.ndarray, "s t"]:
        """Tension (N) or stroke (mm) of every tendon, 0 N where neither is commanded."""
        slack = np.where(np.isnan(self.tension), 0.0, self.tension)
        return read_only(np.where(np.isnan(self.stroke), slack, self.stroke))

    @cached_property
    def draws(self) -> bool:
        """Whether a stroke is commanded in any step."""
        return not np.isnan(self.stroke).all()

    @cached_property
    def which(self) -> Int[np.ndarray, " s"]:
        """Index of the distinct load of each step."""
        number = {one: i for i, one in enumerate(self.different)}
        seen = {id(one): one for one in self.external}
        by_identity = {identity: number[one] for identity, one in seen.items()}
        return np.array([by_identity[id(one)] for one in self.external])

    def release(self) -> LoadPath:
        """Return the path there and back, the peak twice.

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
        """Append another path; a tendon that one of them does not name is slack in it.

        Raises:
            InputError: `following` is not a path, or turns the base in another way.

        Example:
            >>> from notchflex import pull
            >>> pull(0.0, 1.0, steps=2).then(pull(1.0, 1.0, steps=1, tendon=2)).tension.tolist()
            [[0.0, nan], [1.0, nan], [nan, 1.0]]
        """
        if not isinstance(following, LoadPath):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError.WRONG_TYPE(
                f"a load path goes on with another notchflex.LoadPath; got {short_repr(following)}"
            )
        count = max(self.tension.shape[1], following.tension.shape[1])
        return join_paths([self.for_tendons(count), following.for_tendons(count)])

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
        """Return the path with external loads on all its steps.

        Args:
            tip_force: Force at the tip, N; this and all others as in `Load`.
            tip_moment: Moment at the tip, N mm.
            tip_point: Point of the tip force and the tip mass, mm.
            following: Whether tip force and tip moment turn with the tip.
            body_forces: Forces and moments on single bodies.
            tip_mass: Mass that hangs at the tip point, g.
            gravity: Acceleration of gravity in the world, m/s^2.

        Returns:
            The path; what is not given stays as it is.

        Raises:
            InputError: Invalid value.

        Example:
            >>> from notchflex import pull
            >>> path = pull(0.0, 1.0, steps=2).loaded(tip_force=(0.0, 0.1, 0.0))
            >>> [one.tip_force for one in path.release().external]
            [(0.0, 0.1, 0.0), (0.0, 0.1, 0.0), (0.0, 0.1, 0.0), (0.0, 0.1, 0.0)]
        """
        given = {n: v for n, v in locals().items() if n in EXTERNAL and v is not None}
        # Each distinct load is made and checked once.
        changed = [replace(one, **given) for one in self.different]
        return replace(self, external=tuple(changed[number] for number in self.which.tolist()))

    def for_tendons(self, count: int) -> LoadPath:
        """Return the path for a number of tendons; those added are slack."""
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


def join_paths(paths: Sequence[LoadPath]) -> LoadPath:
    """Join paths for equally many tendons to one.

    Raises:
        InputError: Their bases are turned differently.
    """
    if any((path.base_rotation != paths[0].base_rotation).any() for path in paths):
        raise InputError.CONFLICT(_TURNED)
    return LoadPath(
        np.concatenate([path.tension for path in paths]),
        np.concatenate([path.stroke for path in paths]),
        paths[0].base_rotation,
        tuple(external for path in paths for external in path.external),
    )


def load_path(loads: Load | LoadPath | Iterable[Any], tendons: int) -> LoadPath:
    """Convert loads of any form to a path for a robot with a number of tendons.

    Args:
        loads: A path, one load, or loads in order.
        tendons: Number of tendons of the robot.

    Returns:
        The path, with a column for every tendon.

    Raises:
        InputError: Too many entries, invalid numbers, different base rotations.
    """
    if isinstance(loads, LoadPath):
        return loads.for_tendons(tendons)
    several: list[Load] = one_or_several(
        loads, Load, "loads must be a notchflex.Load, a LoadPath or Loads in order"
    )
    if not several:
        raise InputError.NO_DATA("there are no loads; give at least one")
    tension: list[float | None] = []
    stroke: list[float | None] = []
    for load in several:
        if not isinstance(load, Load):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError.WRONG_TYPE(
                f"a load must be a notchflex.Load; got {type(load).__name__}"
            )
        if load.base_rotation != several[0].base_rotation:
            raise InputError.CONFLICT(_TURNED)
        tension += load.per_tendon("tension", tendons)
        stroke += load.per_tendon("stroke", tendons)
    target: list[float] = []
    valid = True
    for pull, length in zip(tension, stroke, strict=True):
        slack_or_pulled = 0.0 if pull is None else pull
        target.append(slack_or_pulled if length is None else length)
        valid = valid and (pull is None or (length is None and pull >= 0.0))
    tables = np.array([*tension, *stroke, *target], float).reshape(3, -1, tendons)
    tables.setflags(write=False)
    external = tuple([load.external for load in several])
    fields = tables[0], tables[1], _base_rotation(several[0].base_rotation), external
    if not valid:
        return LoadPath(*fields)  # raises the error
    path = LoadPath.of_valid(*fields)
    vars(path).update(target=tables[2], draws=stroke.count(None) < len(stroke))
    return path


_base_rotation = lru_cache(maxsize=64)(read_only)
"""Returns a rotation vector as an array, the same for the same vector."""
