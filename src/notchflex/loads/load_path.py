"""Load paths: the loads on a robot step by step, as arrays over the steps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, TypeGuard, overload

import numpy as np
from jaxtyping import Float, Int

from notchflex._load_words import MOST_STEPS
from notchflex._summary import MOST, Displayed, Summary, course, short, vector
from notchflex._values import ByValue, read_only
from notchflex.errors import InputError, InputWarning
from notchflex.loads.load import (
    EXTERNAL,
    BodyForce,
    ExternalLoad,
    Load,
    check_integer,
    check_number,
    check_table,
    check_turn,
    distinct_objects,
    entries_of,
    external_of_steps,
    one_or_several,
    rotation_of,
    short_repr,
)

TENDONS, TIP = ("tension", "stroke"), ("tip_force", "tip_moment")
"""Names of the numbers of a load that may vary: one for each tendon, and vectors."""

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
        tables = {
            name: np.atleast_2d(check_table(table, name))
            for name in TENDONS
            if (table := getattr(self, name)) is not None
        }
        if not tables:
            raise InputError.NO_DATA("a load path needs tensions (N) or strokes (mm); got neither")
        nothing = np.full(next(iter(tables.values())).shape, np.nan)
        tension, stroke = (read_only(tables.get(name, nothing)) for name in TENDONS)
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
        # Usually all steps share one object; identity is faster than equality.
        several = external if len(external) == 1 else distinct_objects(external).values()
        vars(path).update(
            tension=tension,
            stroke=stroke,
            base_rotation=base_rotation,
            external=external,
            different=[*several] if len(several) == 1 else [*dict.fromkeys(several)],
        )
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
            steps = np.arange(len(self))[step].tolist()
            external = tuple([self.external[number] for number in steps])
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
        rows: list[tuple[str, str]] = []
        for name, unit, values in (("tension", "N", self.tension), ("stroke", "mm", self.stroke)):
            rows += tendon_rows(name, unit, values, commanded=True)
        rows += external_rows(self)
        if self.base_rotation.any():
            rows.append(("base rotation", f"{vector(self.base_rotation)} rad"))
        steps = f"{len(self)} step{'s' * (len(self) != 1)}"
        return Summary(f"Load path of {steps}", rows)

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
        number = {load: i for i, load in enumerate(self.different)}
        # Usually many steps share an object; identity is faster than equality.
        by_identity = {key: number[load] for key, load in distinct_objects(self.external).items()}
        return np.array([by_identity[id(load)] for load in self.external])

    def numbers(self, name: str) -> Float[np.ndarray, "s k"]:
        """Return the numbers of a name of `TENDONS` (0 where not commanded) or `TIP`, by steps.

        Raises:
            InputError: No tendon is commanded so.
        """
        if name in TIP:
            return np.array([getattr(load, name) for load in self.external])
        commanded = getattr(self, name)
        if np.isnan(commanded).all():
            raise InputError.NO_DATA(f"the loads give no {name} that could vary")
        return np.nan_to_num(commanded)

    def replaced(self, names: Iterable[str]) -> list[InputWarning]:
        """Tell of temperatures of the robot among some names, where all loads give their own."""
        given = [external.temperature for external in self.different]
        return [
            InputWarning(
                f"`{name}` has no effect: every load gives a temperature of its own; leave "
                "`temperature` out of the loads to vary that of the robot.",
                name,
                given[0] or 0.0,
                None,
            )
            for name in names
            if name.endswith("material.temperature") and None not in given
        ]

    def commanding(self, values: Mapping[str, Any]) -> LoadPath:
        """Return the path with other numbers of its loads.

        Args:
            values: Numbers of every step by name, of which only those of `TENDONS`, where the path
                commands them, and of `TIP` count.

        Raises:
            InputError: A negative tension, or a number that is not finite.
        """
        tables = {
            name: np.asarray(table) for name, table in values.items() if name in (*TENDONS, *TIP)
        }
        changed: dict[str, Any] = {
            name: np.where(np.isnan(getattr(self, name)), np.nan, table)
            for name, table in tables.items()
            if name in TENDONS
        }
        if tip := {name: table.tolist() for name, table in tables.items() if name in TIP}:
            changed["external"] = tuple(
                replace(load, **{name: tuple(each[step]) for name, each in tip.items()})
                for step, load in enumerate(self.external)
            )
        return replace(self, **changed) if changed else self

    def release(self) -> LoadPath:
        """Return the path there and back, the peak twice.

        Example:
            >>> from notchflex import pull
            >>> len(pull(0.0, 3.0, steps=31).release())
            62
        """
        steps = np.arange(len(self))
        return self[np.concatenate([steps, steps[::-1]])]

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
        temperature: float | Sequence[float] | None = None,
        sheath_bend_deg: float | None = None,
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
            temperature: Temperature of the robot, deg C, or one for each step; a path of a single
                step is repeated for several.
            sheath_bend_deg: Total angle by which all sheaths are bent, deg.

        Returns:
            The path; what is not given stays as it is.

        Raises:
            InputError: Invalid value, or other numbers of temperatures and of steps.

        Example:
            >>> from notchflex import pull
            >>> path = pull(0.0, 1.0, steps=2).loaded(tip_force=(0.0, 0.1, 0.0))
            >>> [one.tip_force for one in path.release().external]
            [(0.0, 0.1, 0.0), (0.0, 0.1, 0.0), (0.0, 0.1, 0.0), (0.0, 0.1, 0.0)]
        """
        changes = {n: v for n, v in locals().items() if n in EXTERNAL and v is not None}
        if isinstance(temperature, Sequence | np.ndarray):
            try:
                steps, each = np.broadcast_arrays(np.arange(len(self)), temperature)
            except ValueError:
                raise InputError.WRONG_SHAPE(
                    f"there are {len(temperature)} temperatures for {len(self)} steps; give one, "
                    "or one for each step"
                ) from None
            path = self[steps]
            loads = (
                replace(load, **changes | {"temperature": value})
                for load, value in zip(path.external, each.tolist(), strict=True)
            )
            return replace(path, external=tuple(loads))
        # Each distinct load is made and checked once.
        changed = [replace(load, **changes) for load in self.different]
        return replace(self, external=tuple(changed[number] for number in self.which.tolist()))

    def for_tendons(self, count: int) -> LoadPath:
        """Return the path for a number of tendons; those added are slack."""
        commanded = self.tension.shape[1]
        if commanded == count:
            return self
        if commanded > count:
            raise InputError.WRONG_SHAPE(
                f"the load commands {commanded} tendons, but the robot has {count}; "
                f"give at most {count}"
            )
        added = (0, 0), (0, count - commanded)
        tables = (np.pad(getattr(self, name), added, constant_values=np.nan) for name in TENDONS)
        return replace(self, **dict(zip(TENDONS, tables, strict=True)))


def join_paths(paths: Sequence[LoadPath]) -> LoadPath:
    """Join paths for equally many tendons to one."""
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


# Summaries of loads: what `repr` and a notebook show of them.


def load_words(load: Load) -> str:
    """Return a load in words: what is commanded of every tendon, and the external loads.

    Example:
        >>> from notchflex import Load
        >>> load_words(Load(tension=2.0, tip_force=(0.0, 0.1, 0.0)))
        'tension 2 N, tip force (0, 0.1, 0) N'
    """
    words: list[str] = []
    for name, unit in (("tension", "N"), ("stroke", "mm")):
        commanded = getattr(load, name)
        several = commanded if isinstance(commanded, (list, tuple)) else [commanded]
        for tendon, value in enumerate(several, start=1):
            if value is not None:
                which = f"tendon {tendon} " if len(several) > 1 else ""
                words.append(f"{which}{name} {short(value)} {unit}")
    words += external_words(load)
    return ", ".join(words) or "none"


def external_words(load: ExternalLoad) -> list[str]:
    """Return the external loads of one step, each in words.

    Example:
        >>> from notchflex.loads import ExternalLoad
        >>> external_words(ExternalLoad(tip_force=(0.0, 0.1, 0.0), following=True, tip_mass=20.0))
        ['tip force (0, 0.1, 0) N following the tip', 'tip mass 20 g']
    """
    turning = " following the tip" if load.following else ""
    where = f" at {vector(load.tip_point)} mm from the tip" if any(load.tip_point) else ""
    where_of_mass = "" if any(load.tip_force) else where
    words = [
        (any(load.tip_force), f"tip force {vector(load.tip_force)} N{where}{turning}"),
        (any(load.tip_moment), f"tip moment {vector(load.tip_moment)} N mm{turning}"),
        (load.tip_mass, f"tip mass {short(load.tip_mass)} g{where_of_mass}"),
        (any(load.gravity or ()), f"gravity {vector(load.gravity or ())} m/s²"),
        (load.temperature is not None, f"temperature {short(load.temperature or 0.0)} °C"),
        (
            load.sheath_bend_deg is not None,
            f"sheath bent by {short(load.sheath_bend_deg or 0)} deg",
        ),
    ]
    for force in load.body_forces:
        point = f" at {vector(force.point)} mm" if any(force.point) else ""
        body = f"on body {force.body}"
        follows = " following it" if force.following else ""
        words += [
            (any(force.force), f"force {vector(force.force)} N {body}{point}{follows}"),
            (any(force.moment), f"moment {vector(force.moment)} N mm {body}{follows}"),
        ]
    return [text for acts, text in words if acts]


def external_rows(load: LoadPath) -> Iterator[tuple[str, str]]:
    """Yield the row of the external loads of a path; none where there are none."""
    different = [", ".join(external_words(external)) or "none" for external in load.different]
    if different == ["none"]:
        return
    more = f"; {len(different) - 1} other" if len(different) > 1 else ""
    yield ("external load", f"{different[0]}{more}")


def tendon_rows(
    name: str, unit: str, values: np.ndarray, *, commanded: bool = False
) -> Iterator[tuple[str, str]]:
    """Yield the course of every tendon; of many, the first that are not slack."""
    count = values.shape[1]
    moving = [i for i in range(count) if np.isfinite(values[:, i]).any()]
    shown = moving[: MOST - 2] if len(moving) > MOST - 1 else moving
    for index in shown:
        which = f" {index + 1}" if count > 1 else ""
        yield (f"tendon{which} {name}", f"{course(values[:, index])} {unit}")
    if len(moving) > len(shown):
        yield (f"tendon {name}", f"and {len(moving) - len(shown)} more tendons")
    if not moving and not commanded:
        yield (f"tendon {name}", "none")


# The usual load paths: one tendon pulled by tension or drawn by stroke, in equal steps.

_MAX_TENDONS = 1000
Ends = float | Sequence[float | None] | np.ndarray
"""Tension or stroke of one tendon, or of every tendon with None where it is slack."""


def pull(start: Ends, stop: Ends, steps: int = 31, *, tendon: int = 1) -> LoadPath:
    """Pull tendons by tension, from one value to another in equal steps.

    Args:
        start: First tension, N: of one tendon, or an entry per tendon with None where it is slack.
        stop: Last tension, N, in the same form.
        steps: Number of steps, both ends included.
        tendon: Which tendon a single number pulls, counted from 1.

    Returns:
        The path; `.release()` adds the way back, `.loaded(...)` external loads.

    Raises:
        InputError: Fewer than one step or more than a million, or one step between different
            tensions; a negative or infinite tension, no such tendon, ends of other tendons.

    Example:
        >>> pull(0.0, 3.0, steps=4).tension[:, 0].tolist()
        [0.0, 1.0, 2.0, 3.0]
        >>> pull((0.0, 0.5), (1.0, 0.5), steps=2).tension.tolist()
        [[0.0, 0.5], [1.0, 0.5]]
    """
    return _ramp("tension", start, stop, steps, tendon)


def stroke_path(start: Ends, stop: Ends, steps: int = 31, *, tendon: int = 1) -> LoadPath:
    """Prescribe the stroke of tendons, from one value to another in equal steps.

    Args:
        start: First stroke, mm: of one tendon, or an entry per tendon with None where it is slack.
        stop: Last stroke, mm, in the same form.
        steps: Number of steps, both ends included.
        tendon: Which tendon a single number draws, counted from 1.

    Returns:
        The path; `.release()` adds the way back, `.loaded(...)` external loads.

    Raises:
        InputError: Fewer than one step or more than a million, or one step between different
            strokes; an infinite stroke, no such tendon, ends of other tendons.

    Example:
        >>> stroke_path(0.0, 1.0, steps=3).stroke[:, 0].tolist()
        [0.0, 0.5, 1.0]
    """
    return _ramp("stroke", start, stop, steps, tendon)


def _ramp(what: str, start: Ends, stop: Ends, steps: int, tendon: int) -> LoadPath:
    steps, tendon = check_integer(steps, "steps"), check_integer(tendon, "tendon")
    if steps < 1:
        raise InputError.NO_DATA(f"a range needs at least one step; got {steps}")
    if steps > MOST_STEPS:
        raise InputError.OUT_OF_RANGE(
            f"a range has at most {MOST_STEPS:,} steps; got {steps:,}. Take fewer."
        )
    if not 1 <= tendon <= _MAX_TENDONS:
        raise InputError.OUT_OF_RANGE(
            f"tendons are counted from 1, to {_MAX_TENDONS} at most; got {tendon}"
        )
    alone = [*[None] * (tendon - 1), 0.0]
    several = next((ends for ends in (start, stop) if _is_several(ends)), alone)
    first, last = (
        end if _is_several(end) else [None if entry is None else end for entry in several]
        for end in (start, stop)
    )
    if len(first) != len(last):
        raise InputError.WRONG_SHAPE(
            f"a {what} range needs ends for equally many tendons; got {len(first)} and {len(last)}"
        )
    commanded = np.full((steps, len(first)), np.nan)
    for number, ends in enumerate(zip(first, last, strict=True)):
        if ends == (None, None):
            continue
        begin, end = (
            check_number(value, f"the {name} {what}")
            for value, name in zip(ends, ("first", "last"), strict=True)
        )
        if steps == 1 and begin != end:
            raise InputError.OUT_OF_RANGE(
                f"a range of one step cannot go from {begin:g} to {end:g}; give 2 steps or more"
            )
        with np.errstate(over="ignore", invalid="ignore"):
            commanded[:, number] = np.linspace(begin, end, steps)
        if not np.isfinite(commanded[:, number]).all():
            raise InputError.NOT_FINITE(
                f"a {what} range needs finite ends; got {begin:g} and {end:g}"
            )
    return LoadPath(commanded) if what == "tension" else LoadPath(stroke=commanded)


def _is_several(value: Ends) -> TypeGuard[Sequence[float | None]]:
    return isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes)
