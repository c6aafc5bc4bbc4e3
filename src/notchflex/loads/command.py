"""Commands: the loads of a path as the arrays that the solver takes.

With R the rotation of a body against the base, a force f of constant direction in the base acts on
the body's frame as R^T f, at a point p of the body with the moment p x R^T f about its origin. Of
many such forces only three sums are needed whatever R is: f, the moments, and the products p f^T.
Forces that turn with the body are constant in its frame.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from enum import IntFlag
from math import hypot, pi, radians
from typing import Any, NamedTuple, cast

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from notchflex._arrays import xp
from notchflex._jax import constant, jax, jnp
from notchflex.errors import InputError, InputWarning
from notchflex.loads.load import HANGING, NO_VECTOR, NOTHING, ExternalLoad
from notchflex.loads.load_path import LoadPath
from notchflex.mechanics.chain import Chain, bending_normal
from notchflex.mechanics.motion import IN_PLANE, turned, unskew
from notchflex.robot import Robot
from notchflex.robot.kinds import Transforming
from notchflex.robot.problems import too_cold, unlikely

# Tolerance of a vector's component out of a plane.
_ROUNDING = 1e-12


class BodyLoads(NamedTuple):
    """External loads on the bodies, base first; loads as leading axis. Units N, N mm.

    Attributes:
        dead_force: Sum of the forces of constant direction, in the base frame.
        dead_moment: Sum of the moments of constant direction, in the base frame.
        dead_arm: Sum of the products p f^T of the points where those forces act (in the body's
            frame) and the forces (in the base frame).
        following: Moment and force of loads that turn with a body, about its origin, in its frame.
        rise: Temperature above that of the robot, K, the same for all bodies; None where the
            material does not depend on it.
    """

    dead_force: Float[Array, "*s bodies d"]
    dead_moment: Float[Array, "*s bodies a"]
    dead_arm: Float[Array, "*s bodies d d"]
    following: Float[Array, "*s bodies w"]
    rise: Float[Array, "*s bodies"] | None = None


def applied(
    load: LoadPath,
    chain: Chain,
    steps: Int[np.ndarray, "*k s"],
    bodies: tuple[Any, ...] | None = None,
    tip: Float[np.ndarray, "all 6"] | None = None,
) -> BodyLoads:
    """Sum the external loads on each body; the axes of `steps` are the leading ones of the sums."""
    # Masses, their moments, the distance of the tip and the temperature (`body_numbers`) may have
    # the rows of `steps` as leading axis; the sums are linear in them. `tip` acts besides the loads
    # of the path. Of a flat chain they are the sums in the plane that x and z of its frame span.
    along, about = (np.eye(3),) * 2 if chain.frame is None else _of_plane(chain.frame)
    turn, (*masses, warm) = load.base_to_world, bodies or body_numbers(chain)
    world_along, world_about = (along, about) if turn is None else (turn @ along, turn @ about)
    axes = along, about, world_along, world_about
    by_row = masses[2].ndim
    fields: list[np.ndarray] = []
    rise = np.zeros((steps.size, masses[0].shape[-1]))
    for external, places, at_tip in _each(load, steps, tip):
        rows = places // steps.shape[-1] if by_row else np.s_[...]
        if external.temperature is not None:
            rise[places] = external.temperature - warm[rows][..., None]
        sums = _sums(external, axes, *(each[rows] for each in masses), at_tip=at_tip)
        shapes = [values.shape[by_row if tip is None else 1 :] for values in sums]
        fields = fields or [np.empty((steps.size, *shape)) for shape in shapes]
        for field, values in zip(fields, sums, strict=True):
            field[places] = values
    if warm is not None:
        fields.append(rise)
    return BodyLoads(*(constant(field.reshape(*steps.shape, *field.shape[1:])) for field in fields))


def body_numbers(chain: Chain) -> tuple[Any, ...]:
    """Return what loads take of a robot: masses, their moments, place of the tip, temperature."""
    mass = np.asarray(chain.body_mass)
    moment = mass[..., None] * np.asarray(chain.body_centre)
    return mass, moment, np.asarray(chain.body_length)[..., -1], chain.temperature


def load_slopes(load: LoadPath, chain: Chain, change: Chain) -> BodyLoads:
    """Differentiate the external loads along changes of a chain, the leading axis of its bodies."""
    mass, centre = np.asarray(chain.body_mass), np.asarray(chain.body_centre)
    by_mass = np.asarray(change.body_mass)
    by_moment = by_mass[..., None] * centre + mass[:, None] * np.asarray(change.body_centre)
    by_tip = np.asarray(change.body_length)[..., -1]
    steps = np.broadcast_to(np.arange(len(load)), (len(by_tip), len(load)))
    by = by_mass, by_moment, by_tip, change.temperature
    none = jax.tree.map(np.zeros_like, by)
    changed, still = (applied(load, chain, steps, bodies) for bodies in (by, none))
    return jax.tree.map(operator.sub, changed, still)


def in_space(loads: BodyLoads, frame: Float[Array, "3 3"], *, reduce: bool = False) -> BodyLoads:
    """Expand loads of the plane that x and z of a frame span to space, or reduce those of space."""
    along, about = _of_plane(frame)
    if not reduce:
        along, about = along.T, about.T
    force, moment, arm, following = map(np.asarray, loads[:4])
    axes = about.shape[0]
    turning = [following[..., :axes] @ about, following[..., axes:] @ along]
    return BodyLoads(
        constant(force @ along),
        constant(moment @ about),
        constant(along.T @ arm @ along),
        constant(np.concatenate(turning, axis=-1)),
        loads.rise,
    )


def body_wrench(rotation: Float[Array, "d d"], loads: BodyLoads) -> Float[Array, " w"]:
    """Return the wrench (moment, force) of the loads on one body, about its origin, in its frame.

    Example:
        >>> at_side = BodyLoads(np.eye(3)[2], np.zeros(3), np.outer([2.0, 0, 0], [0, 0, 1.0]), 0.0)
        >>> body_wrench(np.eye(3), at_side).tolist()
        [0.0, -2.0, 0.0, 0.0, 0.0, 1.0]
    """
    # The vector of the skew part of p f^T is minus half of p x f.
    moment = turned(rotation.T, loads.dead_moment) - 2.0 * unskew(loads.dead_arm @ rotation)
    return xp.concatenate([moment, loads.dead_force @ rotation]) + loads.following


def is_unloaded(load_path: LoadPath) -> bool:
    """Return whether no external load acts in any step."""
    return all(load is NOTHING or load.is_nothing for load in load_path.different)


def follows(load_path: LoadPath) -> bool:
    """Return whether an external load turns with a body in any step."""
    return any(external.follows for external in load_path.different)


def is_planar(load_path: LoadPath, robot: Robot) -> bool:
    """Return whether every external load stays in the robot's plane of bending, to rounding."""
    # It does where each force lies in the plane and acts at a point of it, and each moment turns
    # about its normal. A robot's weight counts as acting on the tube axis. A robot whose notches
    # bend in several planes has no such plane.
    turn = load_path.base_to_world
    return not any(_sideways(external, robot, turn) for external in load_path.different)


def _sideways(
    external: ExternalLoad,
    robot: Robot,
    turn: Float[np.ndarray, "3 3"] | None,
    at_tip: Sequence[Any] = (),
) -> Any:
    """Return whether external loads, and others at the tip (see `_forces`), leave the plane."""
    normal = bending_normal(robot)
    if normal is None:
        return True
    turned_normal = (normal if turn is None else turn @ normal).tolist()
    # Only directions matter here, not the mass or its position on the tube axis.
    forces = list(_forces(external, 0, at_tip))
    if external.gravity is not None:
        forces.append((0, external.weight(1.0), NO_VECTOR, NO_VECTOR, False, False))
    leaves = False
    normal = normal.tolist()
    for _, force, moment, point, following, _ in forces:
        # A force or its point leaves the plane, or the axis of a moment is not its normal.
        normal_of_load = normal if following else turned_normal
        leaves |= (
            (abs(_dot(force, normal_of_load)) > _ROUNDING * _norm(force))
            | (_norm(_cross(moment, normal_of_load)) > _ROUNDING * _norm(moment))
            | ((_norm(force) > 0.0) & (abs(_dot(point, normal)) > _ROUNDING * _norm(point)))
        )
    return leaves


def _dot(first: Sequence[Any], second: Sequence[Any]) -> Any:
    (a, b, c), (x, y, z) = first, second
    return a * x + b * y + c * z


def _norm(vector: Sequence[Any]) -> Any:
    return _dot(vector, vector) ** 0.5


def _cross(first: Sequence[Any], second: Sequence[Any]) -> list[Any]:
    (a, b, c), (x, y, z) = first, second
    return [b * z - c * y, c * x - a * z, a * y - b * x]


class LoadKind(IntFlag):
    """What acts in a step of a path: external loads, some out of the plane or turning, strokes."""

    LOADED = 1
    SIDEWAYS = 2
    FOLLOWING = 4
    DRAWN = 8


def acting(
    load: LoadPath,
    robot: Robot,
    steps: Int[np.ndarray, "*k"],
    tip: Float[np.ndarray, "s 6"] | None = None,
) -> Int[np.ndarray, "*k"]:
    """Return what acts in some steps of a path, as bits of `LoadKind`."""
    tendons = robot.number_of_tendons
    commands = load.tension, load.stroke
    if any(not np.isnan(table[steps, tendons:]).all() for table in commands):
        raise InputError.WRONG_SHAPE(
            f"a load commands more tendons than {robot.name} has: {tendons}"
        )
    kinds = LoadKind.DRAWN * ~np.isnan(load.stroke[steps]).all(axis=-1).ravel()
    for external, places, at_tip in _each(load, steps, tip):
        check_external(external, robot)
        pushed = np.any(at_tip, axis=0)
        kinds[places] += (
            LoadKind.LOADED * (pushed | (not external.is_nothing))
            + LoadKind.SIDEWAYS * _sideways(external, robot, load.base_to_world, at_tip)
            + LoadKind.FOLLOWING * (pushed & external.following | external.follows)
        )
    return kinds.reshape(steps.shape)


def _each(
    load: LoadPath, steps: Int[np.ndarray, ...], tip: Float[np.ndarray, "s 6"] | None
) -> Iterator[tuple[ExternalLoad, np.ndarray, list[np.ndarray]]]:
    """Yield distinct loads, their places among steps, and what acts at the tip there besides."""
    if len(load.different) == 1 and tip is None:
        yield load.different[0], np.arange(steps.size), []
        return
    numbers = load.which[steps]
    order = np.argsort(numbers, axis=None, kind="stable")
    distinct, first = np.unique(numbers.ravel()[order], return_index=True)
    for number, places in zip(distinct.tolist(), np.split(order, first[1:]), strict=True):
        at_tip = [] if tip is None else [*tip[steps.ravel()[places]].T]
        yield load.different[number], places, at_tip


def row_commands(
    load: LoadPath,
    steps: Int[np.ndarray, "k s"],
    chain: Chain,
    tip: Float[np.ndarray, "all 6"] | None,
    *,
    draws: bool,
) -> Command:
    """Return the commands of k rows, each with s of the steps of all paths, by their numbers."""
    # Masses and lengths of the bodies of the chain may have the rows as leading axis.
    commanded = steps, slice(chain.tendons)
    draws, bends = draws or chain.sheath is not None, _bends(load, chain)
    by_stroke: Any = ~np.isnan(load.stroke[commanded]) if draws else None
    target: Any = load.target[commanded]
    loads = applied(load, chain, steps, tip=tip) if chain.loaded else None
    return Command(target, by_stroke, loads, bends if bends is None else bends[steps])


def _bends(load: LoadPath, chain: Chain) -> Any:
    """Return the bend of the sheaths in every step, as `Command` has it."""
    if chain.sheath is not None:
        bends = (external.sheath_bend_deg for external in load.different)
        return np.array([-1.0 if bend is None else radians(bend) for bend in bends])[load.which]
    for external in load.different:  # every solve comes by
        if external.sheath_bend_deg is not None:
            raise InputError.UNSUPPORTED(
                "sheath_bend_deg has no effect: no tendon of the robot runs through a sheath; give "
                "tendon.sheath_length (mm) and tendon.sheath_friction, or leave the bend out"
            )
    return None


def _of_plane(frame: Float[Array, "3 3"]) -> tuple[np.ndarray, np.ndarray]:
    """Return x and z of a frame, and the axis about which its plane turns, as columns."""
    axes = np.asarray(frame)
    return axes[:, IN_PLANE], axes[:, 1:2]


def check_external(external: ExternalLoad, robot: Robot) -> None:
    """Refuse external loads that have nothing to act on in a robot."""
    last = robot.number_of_notches
    if external.temperature is not None:
        made_of = {notch.made_of(robot.material) for notch in robot.notches}
        warm: list[Any] = [each for each in made_of if isinstance(each, Transforming)]
        if len(warm) > 1:
            raise InputError.UNSUPPORTED(
                f"a load cannot give {robot.name} a temperature, as several of its materials have "
                "one; give each its own in the robot file (material.temperature, "
                "notch.material.temperature)"
            )
        if not warm or warm[0].reference_temperature is None:
            raise InputError.UNSUPPORTED(
                f"temperature has no effect on {robot.name}: it is not known at which temperature "
                "its material was measured; give material.reference_temperature (deg C), which "
                "nitinol and superelastic have"
            )
        replace(warm[0], temperature=external.temperature)  # raises if too cold
    for force in external.body_forces:
        if force.body > last:
            raise InputError.OUT_OF_RANGE(
                f"there is no body {force.body}; {robot.name} has the bodies 0 (the base) to "
                f"{last}, one after each notch"
            )
    masses = external.tip_mass, *(notch.mass for notch in robot.notches)
    if any(external.gravity or ()) and robot.densities is None and not any(masses):
        raise InputError.UNSUPPORTED(
            f"gravity has nothing to act on: the density of {robot.name} is not known and no mass "
            "hangs at its tip or stands in it; give material.density (kg/m3) or a tip_mass (g)"
        )


_Force = tuple[int, Sequence[float], Sequence[float], Sequence[float], bool, bool]


def _forces(external: ExternalLoad, last: int, at_tip: Sequence[Any]) -> Iterator[_Force]:
    """List all loads but weight: body, force, moment, point, if it follows, if at the tip."""
    # Points at the tip are relative to it. Six more components of force and moment there may be
    # arrays, of many loads.
    for load in external.body_forces:
        yield load.body, load.force, load.moment, load.point, load.following, False
    point = external.tip_point
    if at_tip:
        yield last, at_tip[:3], at_tip[3:], point, external.following, True
    if any(external.tip_force) or any(external.tip_moment):
        yield last, external.tip_force, external.tip_moment, point, external.following, True
    if external.tip_mass:
        yield last, external.weight(external.tip_mass), NO_VECTOR, point, False, True


# Axes of forces and of moments, as columns: in the frame of the bodies, then in the world.
_Axes = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _sums(
    external: ExternalLoad,
    axes: _Axes,
    body_mass: Float[np.ndarray, "*rows bodies"],
    mass_moment: Float[np.ndarray, "*rows bodies 3"],
    tip: Float[np.ndarray, "*rows"],
    at_tip: Sequence[Any] = (),
) -> tuple[np.ndarray, ...]:
    """Return the sums for all bodies; the tip is `tip` (mm) beyond the origin of the last one."""
    along, about, world_along, world_about = axes
    *rows, count = body_mass.shape
    bodies = (*np.broadcast_shapes(tuple(rows), np.shape(at_tip)[1:]), count)
    d, a = along.shape[1], about.shape[1]
    dead_force, dead_moment = np.zeros((*bodies, d)), np.zeros((*bodies, a))
    dead_arm, turning = np.zeros((*bodies, d, d)), np.zeros((*bodies, a + d))
    for body, force, moment, point, follows, is_at_tip in _forces(external, count - 1, at_tip):
        x, y, z = point
        place = (x, y, z + tip if is_at_tip else z)
        if follows:
            about_origin = map(operator.add, moment, _cross(place, force))
            turning[..., body, :a] += _projected(about_origin, about)
            turning[..., body, a:] += _projected(force, along)
        else:
            dead = _projected(force, world_along)
            dead_force[..., body, :] += dead
            dead_moment[..., body, :] += _projected(moment, world_about)
            dead_arm[..., body, :, :] += _projected(place, along)[..., None] * dead[..., None, :]
    if external.gravity is not None:
        weight = _projected(external.weight(1.0), world_along)
        dead_force += body_mass[..., None] * weight
        dead_arm += (mass_moment @ along)[..., None] * weight
    return dead_force, dead_moment, dead_arm, turning


def _projected(components: Iterable[Any], axes: np.ndarray) -> np.ndarray:
    """Return the components along other axes of vectors, whose components may be arrays."""
    return sum(map(np.multiply.outer, components, axes), start=np.zeros(axes.shape[1]))


class Command(NamedTuple):
    """Targets of all tendons, and the external loads; loads may be leading axis.

    Attributes:
        target: Tension (N) or stroke (mm).
        by_stroke: Whether it is a stroke; None where all are tensions.
        applied: External loads on the bodies; None for a chain assembled for tendons alone.
        bend: Total bend angle of the sheaths, rad, -1 where it is that of the robot; None where
            there are none.
    """

    target: Float[Array, " t"]
    by_stroke: Bool[Array, " t"] | None
    applied: BodyLoads | None
    bend: Any = None

    def packed(self) -> Float[np.ndarray, "s command"]:
        """Return a row for each load: all its numbers, in the order of the fields."""
        fields: Any = (self.target, self.by_stroke, *(self.applied or ()), self.bend)
        rows = [field.reshape(len(field), -1) for field in fields if field is not None]
        return rows[0].copy() if len(rows) == 1 else np.concatenate(rows, axis=1, dtype=float)

    def either(self, by_stroke: Array, by_tension: Array) -> Array:
        """Select per tendon the value for a stroke or that for a tension."""
        if self.by_stroke is None:
            return by_tension
        return jnp.where(self.by_stroke, by_stroke, by_tension)


def tension_commands(tension: Float[np.ndarray, "s t"], chain: Chain) -> Command:
    """Return commands of tensions alone (N), loads as leading axis."""
    none: Any = None if chain.sheath is None else np.zeros(tension.shape, bool)
    return Command(constant(tension), none, None, none if none is None else -np.ones(len(tension)))


def make_commands(load: LoadPath, robot: Robot, chain: Chain) -> Command:
    """Return the commands of a path; a tendon without one is slack (0 N)."""
    draws, external = load.draws or chain.sheath is not None, None
    by_stroke = ~np.isnan(load.stroke) if draws else None
    if chain.loaded:
        for distinct in load.different:
            check_external(distinct, robot)
        external = applied(load, chain, np.arange(len(load)))
    return Command(cast("Any", load.target), cast("Any", by_stroke), external, _bends(load, chain))


# Loads that were probably not meant, such as mN typed as N.

# Largest usual forces in forces that close a notch, and strokes in lengths of the robot: far more
# than any use, and less than a slip of the unit. What is less has a reason if it fails.
_MOST_FORCES, _MOST_LENGTHS = 100.0, 5.0
_MOST_GRAVITY = 100.0  # m/s2
_ONE_TURN = 2.0 * pi * (1.0 + 1e-9)  # rad, and what rounding adds


def usual_loads(chain: Chain) -> dict[str, tuple[float, str]]:
    """Return the largest usual size of each kind of load, and its unit."""
    force = _MOST_FORCES * float(chain.closing_force)
    length = float(np.sum(chain.body_length) + np.sum(chain.rods.length))
    mass = 1e3 * force / abs(HANGING[2])
    return {
        "tension": (force, "N"),
        "stroke": (_MOST_LENGTHS * length, "mm"),
        "tip_force": (force, "N"),
        "tip_moment": (force * length, "N mm"),
        "body_forces": (force, "N"),
        "tip_mass": (mass, "g"),
        "gravity": (_MOST_GRAVITY, "m/s2"),
        "base_rotation": (_ONE_TURN, "rad"),
    }


def unlikely_loads(
    load: LoadPath, robot: Robot, usual: Mapping[str, tuple[float, str]]
) -> list[InputWarning]:
    """Return a warning for each kind of load that is far beyond a robot (`usual_loads`)."""
    # Every solve comes by: lists are faster than arrays of one number; NaN is never above a limit.
    largest = {
        "tension": max([0.0, *load.tension.ravel().tolist()]),
        "base_rotation": hypot(*load.base_rotation.tolist()),
    }
    if load.draws:
        largest["stroke"] = max([0.0, *map(abs, load.stroke.ravel().tolist())])
    cold: list[InputWarning] = []
    for external in load.different:
        if external is not NOTHING:
            if external.temperature is not None and not cold:
                for material in dict.fromkeys(robot.materials[1:]):
                    cold += too_cold(material, "temperature", external.temperature)
            sizes = {
                "tip_force": hypot(*external.tip_force),
                "tip_moment": hypot(*external.tip_moment),
                "body_forces": max(
                    (hypot(*body.force) for body in external.body_forces), default=0.0
                ),
                "tip_mass": external.tip_mass,
                "gravity": hypot(*(external.gravity or NO_VECTOR)),
            }
            for name, size in sizes.items():
                largest[name] = max(largest.get(name, 0.0), size)
    return [
        unlikely(name, float(size), (0.0, float(f"{usual[name][0]:.2g}")), usual[name][1])
        for name, size in largest.items()
        if size > usual[name][0]
    ] + cold
