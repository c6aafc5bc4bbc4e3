"""External loads in a picture: their points and directions on the bent robot."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.style import GREY, PURPLE, SKY

if TYPE_CHECKING:
    from notchflex.plotting.shapes.robot_shape import RobotShape
    from notchflex.results import EquilibriumPath

DEAD, FOLLOWING, WEIGHT = "", ", following", ", weight"
COLOUR = {DEAD: PURPLE, FOLLOWING: SKY, WEIGHT: GREY}


class AppliedLoad(NamedTuple):
    """One "force" [N] or "moment" [N mm] in the frame of the base, and its point of action [mm]."""

    name: str
    kind: str  # one of `DEAD`, `FOLLOWING`, `WEIGHT`
    point: NDArray[np.float64]
    vector: NDArray[np.float64]

    @property
    def size(self) -> float:
        """Magnitude [N or N mm]."""
        return float(np.linalg.norm(self.vector))

    @property
    def label(self) -> str:
        """Legend entry."""
        unit = "N" if self.name == "force" else "N mm"
        return f"{self.name} {self.size:.3g} {unit}{self.kind}"


def applied_loads(path: EquilibriumPath, step: int, shape: RobotShape) -> list[AppliedLoad]:
    """Return the forces and moments on a robot at one step of a path; a hung mass as its weight.

    Gravity on the robot's own mass is distributed and not included.
    """
    return [one for one in _every(path, step, shape) if one.size > 0.0]


def _every(path: EquilibriumPath, step: int, shape: RobotShape) -> Iterator[AppliedLoad]:
    load = path.load.external[step]
    world = path.body_rotation[step, 0]

    def carried(vector: object, body: int, following: bool) -> NDArray[np.float64]:
        stated = np.asarray(vector, float)
        return shape.rotation[body] @ stated if following else stated @ world

    kind = FOLLOWING if load.following else DEAD
    point = shape.on_body(-1, np.array([0.0, 0.0, shape.body_length[-1]]) + load.tip_point)
    yield AppliedLoad("force", kind, point, carried(load.tip_force, -1, load.following))
    yield AppliedLoad("moment", kind, shape.tip, carried(load.tip_moment, -1, load.following))
    weight = np.asarray(load.weight(load.tip_mass), float)
    yield AppliedLoad("force", WEIGHT, point, weight @ world)
    for one in load.body_forces:
        kind = FOLLOWING if one.following else DEAD
        point = shape.on_body(one.body, one.point)
        yield AppliedLoad("force", kind, point, carried(one.force, one.body, one.following))
        yield AppliedLoad("moment", kind, point, carried(one.moment, one.body, one.following))


def out_of_plane(path: EquilibriumPath, step: int, shape: RobotShape, view: float) -> float:
    """Return the largest fraction of a load that a view does not show.

    A view shows the part of a force in its plane, and the part of a moment normal to it.
    """
    normal = np.array([-np.sin(view), np.cos(view), 0.0])
    hidden = [0.0]
    for one in applied_loads(path, step, shape):
        beside = float(abs(one.vector @ normal)) / one.size
        hidden.append(beside if one.name == "force" else np.sqrt(max(0.0, 1.0 - beside**2)))
    return max(hidden)
