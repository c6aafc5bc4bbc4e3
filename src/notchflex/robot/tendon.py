"""A tendon that runs along the tube and ends in one of its bodies."""

import math
from typing import Annotated, Literal

from pydantic import Field

from notchflex.robot.part import Float, FloatOrInf, Int, part, quantity


@part
class Tendon:
    """A tendon parallel to the tube axis, pulled at the base.

    Args:
        radius: Distance of the tendon from the tube axis [mm], at most the outer radius.
        direction_deg: Side of the tube on which it runs [deg]; 0 is the side toward which a notch
            of direction 0 bends, counted about the tube axis from the base x axis to y.
        end_body: Body in which it ends, 1 after the first notch ... n after the last;
            None is the last body.
        axial_stiffness: E A of the tendon [N]; infinite is an inextensible tendon.
        path: How it crosses a notch: "wall-arc" lies on the concentric arc of the wall
            (Pacheco 2021, eq. 3), "straight" is the chord between the edges.  Two more readings of
            a straight tendon pull on the body beyond a gap not along that chord but parallel to
            the channel of the body before the gap ("straight-dead") or of the body beyond it
            ("straight-follower"); Liu 2022 leaves the choice open.
        free_length: Length between the drive and the base [mm]; counts for stretch only.
        diameter: Its diameter [mm]; None is not known. It changes no result: a tendon that would
            cross the inner or outer surface of the tube is refused.

    Example:
        >>> Tendon(0.70, direction_deg=180.0).path
        'wall-arc'
    """

    radius: Annotated[
        Float,
        quantity("mm", "distance of the tendon from the tube axis", above=0, usual=(0.02, 25)),
    ]
    direction_deg: Annotated[
        Float, quantity("deg", "side of the tube on which the tendon runs")
    ] = 0.0
    end_body: Annotated[
        Int | None,
        Field(ge=1, description="body in which the tendon ends, from 1; left out: the last"),
    ] = None
    axial_stiffness: Annotated[
        FloatOrInf, quantity("N", "E A of the tendon; inf is inextensible", above=0)
    ] = math.inf
    path: Annotated[
        Literal["wall-arc", "straight", "straight-dead", "straight-follower"],
        Field(
            description='"wall-arc" (along the arc of the wall), "straight" (across the notch), '
            '"straight-dead" or "straight-follower" (across it, the pull parallel to the channel '
            "of the body before or beyond it)"
        ),
    ] = "wall-arc"
    free_length: Annotated[
        Float, quantity("mm", "length between the drive and the base", at_least=0)
    ] = 0.0
    diameter: Annotated[
        Float | None,
        quantity("mm", "diameter of the tendon, which must fit the lumen or the wall", above=0),
    ] = None
