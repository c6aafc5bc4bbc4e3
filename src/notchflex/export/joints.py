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
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from notchflex import EquilibriumPath, InputError, Robot, closing, pull, simulate
from notchflex.export.cuts import Hole, tendon_holes
from notchflex.support import check_number

Array = NDArray[np.float64]

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
    knots: Array
    stiffness: Array
    further: Array
    friction: Array

    def moment(self, angle: Array) -> Array:
        """Return the elastic moment at hinge angles, N·mm."""
        return _elastic(angle, self.knots) @ np.append(self.stiffness, self.further)

    def friction_moment(self, angle: Array) -> Array:
        """Return the friction moment during loading at hinge angles, N·mm, with their sign."""
        return np.sign(angle) * (_friction(angle) @ self.friction)

    @property
    def range(self) -> Array:
        """Angles over the whole range."""
        return np.linspace(self.low, self.high, 201)

    def drum(self) -> tuple[float, float, Array] | None:
        """Return the friction as that of a drum which the hinge turns by a polynomial of its angle.

        Returns:
            The moment at which the drum yields, N mm; the largest slope of the polynomial, and its
            coefficients. None where all friction is rounding.
        """
        angle = self.range
        friction, elastic = (
            float(np.abs(moment(angle)).max()) for moment in (self.friction_moment, self.moment)
        )
        if friction <= _ROUNDING * elastic:
            return None
        moment = float(np.abs(angle[:, None] ** _FRICTION_POWERS @ self.friction).max())
        return moment, friction / moment, np.concatenate([np.zeros(2), self.friction / moment])


def fit_spring(
    angle: Array,
    moment: Array,
    rising: Array,
    stiffness: float,
) -> HingeSpring:
    """Fit both parts to samples of a slipping hinge.

    Args:
        angle: Angles from the free robot, rad.
        moment: Moments that the hinge answers with, N mm.
        rising: 1 where the angle moves away from that of the free robot, -1 where it comes back.
        stiffness: Stiffness of the free flexure, N mm/rad, where the samples say nothing.
    """
    ends = float(angle.min(initial=0.0)), float(angle.max(initial=0.0))
    # Rounding is not a motion to a side.
    low, high = (0.0 if abs(end) < _MIN_TURN else end for end in ends)
    if low == high:  # a flexure that no tendon bends: without friction
        first = np.array([stiffness, 0.0, 0.0])
        return HingeSpring(-0.1, 0.1, np.zeros(0), first, np.zeros((0, 2)), np.zeros(3))
    places = np.sort(np.concatenate([end * _PLACES for end in (low, high) if end]))
    # The columns of all candidates, once: a fit with some of them is one to this triangle.
    slope = (rising * np.sign(angle))[:, None] * _friction(angle)
    columns = np.concatenate([_elastic(angle, places), slope, moment[:, None]], axis=1)
    # Angle per moment along the branches: what is to be small is the error of the angle.
    weight = np.full(len(angle), 1.0 / stiffness)
    for way, side in product((-1.0, 1.0), (-1.0, 0.0, 1.0)):
        rows = np.flatnonzero((rising == way) & (np.sign(angle) == side))
        if len(rows) > 2:
            rows = rows[np.argsort(moment[rows], kind="stable")]
            change, step = (np.abs(np.gradient(values[rows])) for values in (moment, angle))
            # Two pulls may turn a hinge by the same to the last digit.
            ratio = np.divide(step, change, out=weight[rows], where=change > 0.0)
            weight[rows] = np.minimum(ratio, _SOFTEST / stiffness)
    weight = weight / np.sqrt(len(angle))
    triangle = np.asarray(np.linalg.qr(columns * weight[:, None], mode="r"))
    knots: list[int] = []
    error, coefficients = _least_squares(triangle, knots)
    while len(knots) < _MAX_KNOTS and error >= _MAX_MISFIT * (high - low):
        # A superelastic notch yields somewhere: the knot that helps most is found by trying.
        away = np.abs(places[:, None] - places[knots]).min(axis=1, initial=np.inf)
        free = np.flatnonzero(away > _APART * (high - low)).tolist()
        trials = {knot: _least_squares(triangle, sorted([*knots, knot])) for knot in free}
        best = min(free, key=lambda knot: trials[knot][0], default=None)
        if best is None or trials[best][0] > _WORTH * error:
            break
        knots, (error, coefficients) = sorted([*knots, best]), trials[best]
    own, further, friction = np.split(coefficients, [3, 3 + 2 * len(knots)])
    return HingeSpring(low, high, places[knots], own, further.reshape(-1, 2), friction)


def _least_squares(triangle: Array, knots: Sequence[int]) -> tuple[float, Array]:
    """Fit with some knots; return the root mean square error as an angle (rad), coefficients."""
    further = [3 + 2 * knot + power for knot in knots for power in (0, 1)]
    matrix = triangle[:, [0, 1, 2, *further, -4, -3, -2]]
    scale = np.linalg.norm(matrix, axis=0)
    scale[scale == 0.0] = 1.0
    coefficients = np.linalg.lstsq(matrix / scale, triangle[:, -1], rcond=1e-10)[0] / scale
    return float(np.linalg.norm(matrix @ coefficients - triangle[:, -1])), coefficients


def _elastic(angle: Array, knots: Array) -> Array:
    """Powers of the angle, and of its way beyond every knot."""
    way = angle[:, None] - knots
    further = way[..., None] ** _KNOT_POWERS * (np.sign(knots) * way > 0.0)[..., None]
    return np.concatenate([angle[:, None] ** _POWERS, further.reshape(len(angle), -1)], axis=1)


def _friction(angle: Array) -> Array:
    """Slopes of the powers of the friction potential."""
    return _FRICTION_POWERS * angle[:, None] ** (_FRICTION_POWERS - 1)


STEPS = 121
"""Steps of a pull from rest to the largest tension, and as many back."""
_BEYOND_CLOSING = 1.1
# Far beyond the closing of all notches nearly all samples would be at rest.
_MAX_BEYOND = 3.0
# A notch that turns by less in one step does not slip there, rad.
_AT_REST = 1e-7


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
        if not 0.0 < top < np.inf:
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


def _pulled(robot: Robot, tendon: int, top: float) -> EquilibriumPath:
    """Pull one tendon (counted from 0) from rest to a tension and release it.

    Raises:
        InputError: A step did not converge.
    """
    path = simulate(robot, pull(0.0, top, STEPS, tendon=tendon + 1).release())
    if not path.converged.all():
        last = float(path.commanded_tension[path.converged, tendon].max(initial=0.0))
        raise InputError.NOT_CONVERGED(
            f"tendon {tendon + 1} of {robot.name} has no equilibrium found beyond {last:.4g} N: "
            f"give a smaller largest tension than {top:.4g} N"
        )
    all_closed = path.tension[:STEPS, tendon][path.closed[:STEPS].all(axis=1)]
    if len(all_closed) and _MAX_BEYOND * all_closed[0] < top:
        raise InputError.OUT_OF_RANGE(
            f"every notch of {robot.name} has closed at {all_closed[0]:.4g} N: the largest tension "
            f"may be at most {_MAX_BEYOND * all_closed[0]:.4g} N; got {top:g} N"
        )
    return path


def turned(path: EquilibriumPath) -> Array:
    """Return the notch angles of a path less those of its first state, rad."""
    return path.notch_angle - path.notch_angle[0]


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

    axis: Array
    offset: Array
    free_rotation: Array
    lever: Array

    def bodies(self, angle: Array) -> tuple[Array, Array]:
        """Return origins (mm) and rotations of the bodies for angles from the free robot, rad."""
        steps, count = angle.shape
        position = np.zeros((steps, count + 1, 3))
        rotation = np.broadcast_to(np.eye(3), (steps, count + 1, 3, 3)).copy()
        for j in range(count):
            turn = _rotations(self.axis[j], angle[:, j])
            step = self.offset[j] - self.lever[j] + turn @ self.lever[j]
            position[:, j + 1] = position[:, j] + np.einsum("sab,sb->sa", rotation[:, j], step)
            rotation[:, j + 1] = rotation[:, j] @ turn @ self.free_rotation[j]
        return position, rotation


def _rotations(axis: Array, angle: Array) -> Array:
    """Return rotations about one axis by several angles."""
    return Rotation.from_rotvec(angle[:, None] * axis).as_matrix()


def _hinges(robot: Robot, pulls: Sequence[EquilibriumPath]) -> HingeChain:
    """Place one hinge per flexure: a least-squares fit to the relative motions of its bodies.

    The first state of every pull is the free robot.
    """
    direction = np.radians([notch.direction_deg for notch in robot.notches])
    axis = np.stack([-np.sin(direction), np.cos(direction), 0.0 * direction], axis=1)
    position = np.concatenate([path.body_position for path in pulls])
    rotation = np.concatenate([path.body_rotation for path in pulls])
    angle = np.concatenate([turned(path) for path in pulls])
    # Origins of the distal bodies in the frames of the proximal ones.
    moved = np.einsum("snba,snb->nsa", rotation[:, :-1], np.diff(position, axis=1))
    lever = 0.5 * moved[:, 0]
    for j, way in enumerate(moved):
        if np.ptp(angle[:, j]) > _NO_TURN:
            matrix = (_rotations(axis[j], angle[:, j]) - np.eye(3)).reshape(-1, 3)
            lever[j] = np.linalg.lstsq(matrix, (way - way[0]).reshape(-1), rcond=1e-9)[0]
    free = np.swapaxes(rotation[0, :-1], 1, 2) @ rotation[0, 1:]
    return HingeChain(axis, moved[:, 0], free, lever)


def tendon_levers(chain: HingeChain, holes: Sequence[Hole], angle: Array) -> Array:
    """Return by how much a tendon shortens per turn of every hinge, mm/rad.

    Args:
        chain: The hinges.
        holes: The points that the tendon runs through.
        angle: Angles of the hinges from the free robot, rad.
    """
    position, rotation = chain.bodies(angle)
    place = np.einsum("snab,nb->sna", rotation[:, :-1], chain.offset - chain.lever)
    axis = np.einsum("snab,nb->sna", rotation[:, :-1], chain.axis)
    points = [position[:, hole.body] + rotation[:, hole.body] @ hole.place for hole in holes]
    levers = np.zeros(angle.shape)
    for (first, start), (second, stop) in pairwise(zip(holes, points, strict=True)):
        along = stop - start
        along /= np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-300)
        for j in range(first.body, second.body):
            way = np.cross(axis[:, j], stop - (position[:, j] + place[:, j]))
            levers[:, j] -= np.einsum("sa,sa->s", along, way)
    return levers


@dataclass(frozen=True)
class JointModel:
    """A robot of n hinges and t tendons for a simulator of rigid bodies. Units mm, N, rad.

    Attributes:
        robot: The robot.
        top: Largest tension of the range that the joints are fitted over, N.
        hinges: Where the hinges stand.
        springs: What each hinge answers with, N mm.
        holes: The points that each tendon runs through.
        pulls: The states of the robot that all this was fitted to, one path per tendon.
    """

    robot: Robot
    top: float
    hinges: HingeChain
    springs: tuple[HingeSpring, ...]
    holes: tuple[list[Hole], ...]
    pulls: tuple[EquilibriumPath, ...]

    @property
    def limit(self) -> Array:
        """Angle from the free robot at which each notch closes, rad; infinite for never."""
        return self.robot.geometry.closing_angle - self.robot.geometry.free_angle


def joint_model(robot: Robot, largest_tension: float | None = None) -> JointModel:
    """Fit a model of rigid bodies and hinges to the bending of a robot, pulled at its base.

    Sheaths are left out: they end at the base.

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
    bare = robot.replace(tendon=[tendon.without_sheath() for tendon in robot.tendon], drive=())
    return replace(_fitted(bare, load_range(bare, largest_tension)), robot=robot)


# MJCF, URDF and transmission table of one robot are often written together.
@lru_cache(maxsize=4)
def _fitted(robot: Robot, top: float) -> JointModel:
    tendons = range(robot.number_of_tendons)
    pulls = tuple(_pulled(robot, tendon, top) for tendon in tendons)
    if any(notch.is_round for notch in robot.notches) and pulls[0].chain.level == "space":
        raise InputError.UNSUPPORTED(
            f"the tendons of {robot.name} bend its backbone out of one plane, and a model of "
            "hinges has one for each gap; export a solid, or keep the tendons in its plane."
        )
    holes = tuple(tendon_holes(robot, tendon) for tendon in tendons)
    hinges = _hinges(robot, pulls)
    angle = np.concatenate([turned(path) for path in pulls])
    moment, slips = list[Array](), list[NDArray[np.bool_]]()
    for tendon, path in enumerate(pulls):
        way, tension = turned(path), path.commanded_tension[:, tendon, None]
        moment.append(tendon_levers(hinges, holes[tendon], way) * tension)
        # The friction before a notch that turns is at its limit, and its lips are open.
        turns = np.abs(np.diff(way, axis=0, prepend=way[:1])) > _AT_REST
        slips.append(turns & ~path.closed)
    rising = np.tile(np.repeat([1.0, -1.0], STEPS), len(pulls))
    samples = zip(
        angle.T,
        np.concatenate(moment).T,
        np.concatenate(slips).T,
        robot.geometry.notch_stiffness.tolist(),
        strict=True,
    )
    springs = tuple(
        fit_spring(turn[rows], answer[rows], rising[rows], stiffness)
        for turn, answer, rows, stiffness in samples
    )
    return JointModel(robot, top, hinges, springs, holes, pulls)
