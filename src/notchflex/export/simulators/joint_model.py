"""A robot as rigid bodies, hinges with springs and friction, and tendons through holes.

While a notch turns at tension T, the tendon pulls at its hinge with T times the lever. Friction
before the notch leaves more of it on unloading than on loading, so that the hinge must answer with
S(q) + F(q) while the angle q rises and with S(q) - F(q) while it falls. Both parts follow from one
linear least-squares fit over both branches. A notch that stands is held between the two.

Beyond the hinge the distal body turns on a circle. A flexure moves it on another curve; the hinge
lies where the circle comes closest to it, and the free robot keeps its shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from notchflex import InputError, Robot, closing, pull, simulate
from notchflex.export.cuts import Hole, tendon_holes
from notchflex.support import check_number

_POWERS = np.array([1, 2, 3])
_KNOT_POWERS = np.array([1, 2])
# Where further springs may begin between the free robot and the largest angle, how many at
# most, how far apart, and the error of the angle that is good enough, all as parts of the
# range.
_PLACES = np.linspace(0.05, 0.95, 28)
_MAX_KNOTS = 6
_APART = 0.06
_WORTH = 0.95  # of the error before; a knot that leaves more is not worth its spring
_MAX_MISFIT = 5e-4
# No sample weighs more than that of a flexure softer than the free one by this factor.
_SOFTEST = 50.0
# Friction below this part of the elastic moment is none.
_ROUNDING = 1e-3
_FRICTION_POWERS = np.array([2, 3, 4])  # a joint equality has powers up to 4
_MIN_TURN = 1e-4  # rad; a flexure that turns less is given its stiffness in the free robot


@dataclass(frozen=True)
class HingeSpring:
    """The moment of one hinge. Units N mm, rad.

    Attributes:
        low: Smallest angle of the samples, from the free robot.
        high: Largest angle.
        knots: Angles from which further springs act outwards; (k,).
        stiffness: Coefficients of x, x², x³ of the joint; (3,).
        further: Coefficients of x, x² of each further spring, x from its knot; (k, 2).
        friction: Coefficients of q², q³, q⁴ in the potential whose slope is the friction moment.
    """

    low: float
    high: float
    knots: Float[np.ndarray, " k"]
    stiffness: Float[np.ndarray, " 3"]
    further: Float[np.ndarray, "k 2"]
    friction: Float[np.ndarray, " 3"]

    def moment(self, angle: Float[np.ndarray, " s"]) -> Float[np.ndarray, " s"]:
        """Return the elastic moment at hinge angles, N·mm."""
        return _elastic(angle, self.knots) @ np.append(self.stiffness, self.further)

    def friction_moment(self, angle: Float[np.ndarray, " s"]) -> Float[np.ndarray, " s"]:
        """Return the friction moment during loading at hinge angles, N·mm, with their sign."""
        return np.sign(angle) * (_friction(angle) @ self.friction)

    @property
    def range(self) -> Float[np.ndarray, " s"]:
        """Angles over the whole range."""
        return np.linspace(self.low, self.high, 201)

    @property
    def largest_stiffness(self) -> float:
        """Largest slope of the elastic moment over the range."""
        return float(np.abs(np.gradient(self.moment(self.range), self.range)).max())

    @property
    def largest_friction(self) -> float:
        """Largest friction moment over the range; 0 for rounding."""
        friction = np.abs(self.friction_moment(self.range)).max()
        elastic = np.abs(self.moment(self.range)).max()
        return float(friction) if friction > _ROUNDING * elastic else 0.0

    @property
    def potential_range(self) -> float:
        """Range of the friction potential over that of the hinge, N mm."""
        return float(np.abs(self.range[:, None] ** _FRICTION_POWERS @ self.friction).max())


def fit_spring(
    angle: Float[np.ndarray, " s"],
    moment: Float[np.ndarray, " s"],
    rising: Float[np.ndarray, " s"],
    stiffness: float,
) -> HingeSpring:
    """Fit both parts to samples of a slipping hinge.

    Args:
        angle: Angles from the free robot, rad.
        moment: Moments that the hinge answers with, N mm.
        rising: 1 where the angle moves away from that of the free robot, -1 where it comes back.
        stiffness: Stiffness of the free flexure, N mm/rad, where the samples say nothing.
    """
    low, high = float(angle.min(initial=0.0)), float(angle.max(initial=0.0))
    # Rounding is not a motion to a side.
    low, high = (0.0 if abs(end) < _MIN_TURN else end for end in (low, high))
    if high - low < _MIN_TURN:
        # A flexure that no tendon bends: without friction.
        first = np.array([stiffness, 0.0, 0.0])
        return HingeSpring(-0.1, 0.1, np.zeros(0), first, np.zeros((0, 2)), np.zeros(3))
    slope = (rising * np.sign(angle))[:, None] * _friction(angle)
    weight = _weights(angle, moment, rising, stiffness)
    goal = _MAX_MISFIT * (high - low)
    sides = [end * _PLACES for end in (low, high) if abs(end) > _MIN_TURN]
    knots = np.sort(np.concatenate(sides))
    # The columns of all candidates, once: a fit with some of them is one to this triangle.
    columns = np.concatenate([_elastic(angle, knots), slope, moment[:, None]], axis=1)
    weight /= np.sqrt(len(angle))
    triangle = np.asarray(np.linalg.qr(columns * weight[:, None], mode="r"))
    best = _least_squares(triangle, [])
    for _ in range(_MAX_KNOTS):
        # A superelastic notch yields somewhere: the knot that helps most is found by trying.
        away = np.abs(knots[:, None] - knots[best.knots]).min(axis=1, initial=np.inf)
        free = np.flatnonzero(away > _APART * (high - low))
        if best.error < goal or not len(free):
            break
        trials = [_least_squares(triangle, sorted([*best.knots, at])) for at in free.tolist()]
        better = min(trials, key=lambda trial: trial.error)
        if better.error > _WORTH * best.error:
            break
        best = better
    own, further, friction = np.split(best.found, [3, 3 + 2 * len(best.knots)])
    return HingeSpring(low, high, knots[best.knots], own, further.reshape(-1, 2), friction)


class _Trial(NamedTuple):
    """A fit with some of the candidate knots, and its root mean square error as an angle, rad."""

    knots: list[int]
    found: Float[np.ndarray, " m"]
    error: float


def _least_squares(triangle: Float[np.ndarray, "r columns"], knots: list[int]) -> _Trial:
    further = [3 + 2 * knot + power for knot in knots for power in (0, 1)]
    matrix = triangle[:, [0, 1, 2, *further, -4, -3, -2]]
    scale = np.linalg.norm(matrix, axis=0)
    scale[scale == 0.0] = 1.0
    coefficients = np.linalg.lstsq(matrix / scale, triangle[:, -1], rcond=1e-10)[0] / scale
    error = matrix @ coefficients - triangle[:, -1]
    return _Trial(knots, coefficients, float(np.linalg.norm(error)))


def _weights(
    angle: Float[np.ndarray, " s"],
    moment: Float[np.ndarray, " s"],
    rising: Float[np.ndarray, " s"],
    stiffness: float,
) -> Float[np.ndarray, " s"]:
    """Angle per moment along the branches: what is to be small is the error of the angle."""
    weight = np.full(len(angle), 1.0 / stiffness)
    for branch in np.unique(np.stack([rising, np.sign(angle)]), axis=1).T:
        rows = np.flatnonzero((rising == branch[0]) & (np.sign(angle) == branch[1]))
        if len(rows) > 2:
            rows = rows[np.argsort(moment[rows], kind="stable")]
            change = np.abs(np.gradient(moment[rows]))
            step = np.abs(np.gradient(angle[rows]))
            moves = change > 0.0  # two pulls may turn a hinge by the same to the last digit
            ratio = np.divide(step, change, out=weight[rows], where=moves)
            weight[rows] = np.minimum(ratio, _SOFTEST / stiffness)
    return weight


def _elastic(
    angle: Float[np.ndarray, " s"], knots: Float[np.ndarray, " k"]
) -> Float[np.ndarray, "s m"]:
    """Powers of the angle, and of its way beyond every knot."""
    own = angle[:, None] ** _POWERS
    beyond = np.array(np.where(np.sign(knots) * (angle[:, None] - knots) > 0.0, 1.0, 0.0))
    further = (angle[:, None] - knots)[..., None] ** _KNOT_POWERS * beyond[..., None]
    return np.concatenate([own, further.reshape(len(angle), -1)], axis=1)


def _friction(angle: Float[np.ndarray, " s"]) -> Float[np.ndarray, "s 3"]:
    """Slopes of the powers of the friction potential."""
    return _FRICTION_POWERS * angle[:, None] ** (_FRICTION_POWERS - 1)


_STEPS = 121
_BEYOND_CLOSING = 1.1
# Far beyond the closing of all notches nearly all samples would be at rest.
_MAX_BEYOND = 3.0
# A notch that turns by less in one step does not slip there, rad.
_AT_REST = 1e-7


class PullSamples(NamedTuple):
    """States of a robot while one tendon is pulled and released (s steps, n notches).

    Attributes:
        tendon: Which tendon, from 0.
        tension: Its tension at the base, N.
        loading: Whether the tension rises.
        angle: Notch angles less those of the free robot, rad.
        position: Origins of the bodies, mm.
        rotation: Rotations of the bodies.
        tip: Tip position, mm.
        slips: Whether the notch turns in the step, so that the friction before it is at its limit
            and its lips are open.
    """

    tendon: int
    tension: Float[np.ndarray, " s"]
    loading: Bool[np.ndarray, " s"]
    angle: Float[np.ndarray, "s n"]
    position: Float[np.ndarray, "s bodies 3"]
    rotation: Float[np.ndarray, "s bodies 3 3"]
    tip: Float[np.ndarray, "s 3"]
    slips: Bool[np.ndarray, "s n"]


def load_range(robot: Robot, largest_tension: float | None = None) -> float:
    """Return the largest tension of the range that joints are fitted over, N.

    Args:
        robot: The robot.
        largest_tension: The tension that the user asks for, N. None for 1.1 times the tension that
            closes the last notch or, where some notch never closes, the one that closes the first.

    Raises:
        InputError: The tension is not positive, or none is given and no notch closes.
    """
    if largest_tension is not None:
        top = check_number(largest_tension, "the largest tension")
        if not (np.isfinite(top) and top > 0.0):
            raise InputError.OUT_OF_RANGE(
                f"the largest tension must be positive and finite; got {top:g}, give it in N"
            )
        return top
    tension = closing(robot).tension
    closes = tension > 0.0  # neither NaN nor what no pull can do
    if not closes.any():
        raise InputError.MISSING_VALUE(
            f"no notch of {robot.name} closes, so the export needs the largest tension in N"
        )
    return float(_BEYOND_CLOSING * tension.max() if closes.all() else tension[closes].min())


def pull_samples(robot: Robot, tendon: int, top: float, steps: int = _STEPS) -> PullSamples:
    """Pull one tendon from rest to a tension and release it.

    Args:
        robot: The robot.
        tendon: Which tendon, from 0.
        top: Largest tension, N.
        steps: Steps up, and as many down.

    Raises:
        InputError: A step did not converge.
    """
    path = simulate(robot, pull(0.0, top, steps, tendon=tendon + 1).release())
    if not path.converged.all():
        last = float(path.commanded_tension[path.converged, tendon].max(initial=0.0))
        raise InputError.NOT_CONVERGED(
            f"tendon {tendon + 1} of {robot.name} has no equilibrium found beyond {last:.4g} N: "
            f"give a smaller largest tension than {top:.4g} N"
        )
    closed_from = np.flatnonzero(path.closed[:steps].all(axis=1))
    if len(closed_from) and _MAX_BEYOND * path.tension[closed_from[0], tendon] < top:
        all_closed = float(path.tension[closed_from[0], tendon])
        raise InputError.OUT_OF_RANGE(
            f"every notch of {robot.name} has closed at {all_closed:.4g} N: the largest tension "
            f"may be at most {_MAX_BEYOND * all_closed:.4g} N; got {top:g} N"
        )
    angle = path.notch_angle - path.notch_angle[0]
    turned = np.abs(np.diff(angle, axis=0, prepend=angle[:1])) > _AT_REST
    return PullSamples(
        tendon=tendon,
        tension=np.concatenate([np.linspace(0.0, top, steps), np.linspace(top, 0.0, steps)]),
        loading=np.arange(2 * steps) < steps,
        angle=angle,
        position=path.body_position,
        rotation=path.body_rotation,
        tip=path.tip_position,
        slips=turned & ~path.closed,
    )


# Without any turn the place of a hinge is not determined: half way along the flexure.
_NO_TURN = 1e-6


@dataclass(frozen=True)
class HingeChain:
    """Bodies 0 (the base) to n joined by n hinges. Units mm, rad.

    Attributes:
        axis: Axis of every hinge, in the frames of both bodies, (n, 3).
        offset: Origin of the distal body in the frame of the proximal one, free robot, (n, 3).
        free_rotation: Rotation of the distal body in the proximal one, free robot, (n, 3, 3).
        lever: From the hinge to the origin of the distal body, frame of the proximal one, (n, 3).
    """

    axis: Float[np.ndarray, "n 3"]
    offset: Float[np.ndarray, "n 3"]
    free_rotation: Float[np.ndarray, "n 3 3"]
    lever: Float[np.ndarray, "n 3"]

    def bodies(
        self, angle: Float[np.ndarray, "s n"]
    ) -> tuple[Float[np.ndarray, "s bodies 3"], Float[np.ndarray, "s bodies 3 3"]]:
        """Return origins (mm) and rotations of the bodies for angles from the free robot, rad."""
        steps, count = angle.shape
        position = np.zeros((steps, count + 1, 3))
        rotation = np.broadcast_to(np.eye(3), (steps, count + 1, 3, 3)).copy()
        for j in range(count):
            turn = rotations(self.axis[j], angle[:, j])
            step = self.offset[j] - self.lever[j] + turn @ self.lever[j]
            position[:, j + 1] = position[:, j] + np.einsum("sab,sb->sa", rotation[:, j], step)
            rotation[:, j + 1] = rotation[:, j] @ turn @ self.free_rotation[j]
        return position, rotation


def rotations(
    axis: Float[np.ndarray, " 3"], angle: Float[np.ndarray, " s"]
) -> Float[np.ndarray, "s 3 3"]:
    """Return rotations about one axis by several angles."""
    return Rotation.from_rotvec(angle[:, None] * axis).as_matrix()


def fit_hinges(robot: Robot, pulls: Sequence[PullSamples]) -> HingeChain:
    """Place one hinge per flexure.

    Args:
        robot: The robot, n notches.
        pulls: Its states while tendons are pulled; the first state of each is the free robot.

    Returns:
        The hinges: a least-squares fit to the relative motions of neighbouring bodies.
    """
    direction = np.radians([notch.direction_deg for notch in robot.notches])
    axis = np.stack([-np.sin(direction), np.cos(direction), 0.0 * direction], axis=1)
    offset, free, lever = [], [], []
    for j in range(len(axis)):
        moved = np.concatenate([_relative(one, j) for one in pulls])
        angle = np.concatenate([one.angle[:, j] for one in pulls])
        start = pulls[0].rotation[0]
        offset.append(moved[0])
        free.append(start[j].T @ start[j + 1])
        lever.append(0.5 * moved[0])
        if np.ptp(angle) > _NO_TURN:
            matrix = (rotations(axis[j], angle) - np.eye(3)).reshape(-1, 3)
            right = (moved - moved[0]).reshape(-1)
            lever[-1] = np.linalg.lstsq(matrix, right, rcond=1e-9)[0]
    return HingeChain(axis, np.array(offset), np.array(free), np.array(lever))


def _relative(one: PullSamples, j: int) -> Float[np.ndarray, "s 3"]:
    """Origin of body j + 1 in the frame of body j."""
    way = one.position[:, j + 1] - one.position[:, j]
    return np.einsum("sba,sb->sa", one.rotation[:, j], way)


def tendon_levers(
    chain: HingeChain, holes: list[Hole], angle: Float[np.ndarray, "s n"]
) -> Float[np.ndarray, "s n"]:
    """Return by how much a tendon shortens per turn of every hinge, mm/rad.

    Args:
        chain: The hinges.
        holes: The points that the tendon runs through.
        angle: Angles of the hinges from the free robot, rad.
    """
    position, rotation = chain.bodies(angle)
    first = position[:, :-1] + np.einsum(
        "snab,nb->sna", rotation[:, :-1], chain.offset - chain.lever
    )
    axis = np.einsum("snab,nb->sna", rotation[:, :-1], chain.axis)
    points = [position[:, h.body] + rotation[:, h.body] @ h.place for h in holes]
    levers = np.zeros(angle.shape)
    for (a, start), (b, stop) in pairwise(zip(holes, points, strict=True)):
        along = stop - start
        along /= np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-300)
        for j in range(a.body, b.body):
            turned = np.cross(axis[:, j], stop - first[:, j])
            levers[:, j] -= np.einsum("sa,sa->s", along, turned)
    return levers


@dataclass(frozen=True)
class JointModel:
    """A robot of n hinges and t tendons for a simulator of rigid bodies. Units mm, N, g, rad.

    Attributes:
        robot: The robot.
        top: Largest tension of the range that the joints are fitted over, N.
        hinges: Where the hinges stand.
        springs: What each hinge answers with, N mm.
        limit: Angle from the free robot at which the lips of each notch meet, rad; infinite for one
            that does not close by turning.
        holes: The points that each tendon runs through.
        body_length: Length of each body on the tube axis, mm.
        body_mass: Mass of each body, g; 0 where the material has no density.
        body_centre: Its centre of mass in its frame, mm.
        pulls: The states of the robot that all this was fitted to, one entry per tendon.
    """

    robot: Robot
    top: float
    hinges: HingeChain
    springs: tuple[HingeSpring, ...]
    limit: Float[np.ndarray, " n"]
    holes: tuple[list[Hole], ...]
    body_length: Float[np.ndarray, " bodies"]
    body_mass: Float[np.ndarray, " bodies"]
    body_centre: Float[np.ndarray, "bodies 3"]
    pulls: tuple[PullSamples, ...]


def joint_model(robot: Robot, largest_tension: float | None = None) -> JointModel:
    """Fit a model of rigid bodies and hinges to the bending of a robot.

    Args:
        robot: The robot.
        largest_tension: Largest tension of the range, N; see `load_range`.

    Raises:
        InputError: The range is not usable, or a pull did not converge.

    Example:
        >>> from notchflex import load_robot
        >>> len(joint_model(load_robot("pacheco2021-a"), 2.0).springs)
        5
    """
    top = load_range(robot, largest_tension)
    pulls = tuple(pull_samples(robot, k, top) for k in range(len(robot.tendon)))
    hinges = fit_hinges(robot, pulls)
    holes = tuple(tendon_holes(robot, k) for k in range(len(robot.tendon)))
    geometry = robot.geometry
    return JointModel(
        robot=robot,
        top=top,
        hinges=hinges,
        springs=_springs(hinges, pulls, holes, geometry.notch_stiffness),
        limit=geometry.closing_angle - geometry.free_angle,
        holes=holes,
        body_length=geometry.body_length,
        body_mass=geometry.body_mass,
        body_centre=geometry.body_centre,
        pulls=pulls,
    )


def _springs(
    hinges: HingeChain,
    pulls: Sequence[PullSamples],
    holes: Sequence[list[Hole]],
    stiffness: Float[np.ndarray, " n"],
) -> tuple[HingeSpring, ...]:
    """Fit the moment of every hinge to all pulls together."""
    levers = [tendon_levers(hinges, holes[one.tendon], one.angle) for one in pulls]
    moments = [lever * one.tension[:, None] for lever, one in zip(levers, pulls, strict=True)]
    springs: list[HingeSpring] = []
    for j, own in enumerate(stiffness):
        rows = [one.slips[:, j] for one in pulls]
        angle = [one.angle[row, j] for one, row in zip(pulls, rows, strict=True)]
        moment = [each[row, j] for each, row in zip(moments, rows, strict=True)]
        rising = [
            np.where(one.loading[row], 1.0, -1.0) for one, row in zip(pulls, rows, strict=True)
        ]
        joined = [np.concatenate(each) for each in (angle, moment, rising)]
        springs.append(fit_spring(joined[0], joined[1], joined[2], float(own)))
    return tuple(springs)
