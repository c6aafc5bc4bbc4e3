"""The tables of a design file: objectives, constraints, curves."""

import itertools
from typing import Annotated, Literal

from pydantic import Field, model_validator

from notchflex.designing.specification.fields import (
    REFUSE,
    WANTED,
    Name,
    Numbers,
    Vector,
    check_order,
    number,
)
from notchflex.robot.part import Float, ProblemError, part, quantity

# A coordinate beyond is in another unit, mm.
_MAX_COORDINATE = 1e4


@part(kw_only=True, refuse=REFUSE)
class Measured:
    """A quantity of a robot at a state, or a value of the robot file.

    Args:
        quantity: Name of a quantity, or path of the robot file.
        state: The state.
        minus: Another state, whose value is subtracted: the width of a hysteresis.
        notch: Only these notches, from 1.
        tendon: Only these tendons, from 1.
        axis: Only this coordinate.
        direction: Direction of the tip compliance, in the world.
        take: How several numbers are made one.
    """

    quantity: Annotated[str, Field(description="name of a quantity, or path of the robot file")]
    state: Annotated[str | None, Field(description="name of a state")] = None
    minus: Annotated[str | None, Field(description="state whose value is subtracted")] = None
    notch: Annotated[Numbers | None, Field(description="only these notches, from 1")] = None
    tendon: Annotated[Numbers | None, Field(description="only these tendons, from 1")] = None
    axis: Annotated[
        Literal["x", "y", "z"] | None, Field(description='only this coordinate: "x", "y" or "z"')
    ] = None
    direction: Annotated[
        Vector | None, Field(description="direction of the tip compliance, three numbers")
    ] = None
    take: Annotated[
        Literal["each", "largest", "smallest", "sum", "mean", "range", "steps", "rms"] | None,
        Field(description='how several numbers are made one: "largest", "sum", "range", ...'),
    ] = None

    @model_validator(mode="after")
    def _two_states(self) -> "Measured":
        if self.minus is not None and self.minus == self.state:
            raise ProblemError([("minus", "is the state itself; give another state.")])
        return self


@part(kw_only=True, refuse=REFUSE)
class DesignObjective(Measured):
    """An objective: a quantity to minimise, maximise or bring near a value.

    Args:
        goal: "minimise" or "maximise"; not with `target`.
        target: The value to come near to, by least squares.
        weight: Its weight beside other objectives, each in its own unit.
    """

    goal: Annotated[
        Literal["minimise", "maximise"] | None, Field(description='"minimise" or "maximise"')
    ] = None
    target: Annotated[Float | None, number("value to come near to")] = None
    weight: Annotated[Float, number("weight beside other objectives", ge=1e-9)] = 1.0

    @model_validator(mode="after")
    def _one_goal(self) -> "DesignObjective":
        if (self.goal is None) == (self.target is None):
            text = 'is needed, or `target`, but not both; write goal = "minimise", for example.'
            raise ProblemError([("goal", text)])
        return self


@part(kw_only=True, refuse=REFUSE)
class DesignConstraint(Measured):
    """A constraint.

    Args:
        equal: The value it must have.
        lower: The least value.
        upper: The greatest value.
        order: Along the notches the value must fall ("tip-first": the tip closes first) or rise
            ("base-first").
        margin: By how much at least, from one notch to the next.
        wanted_yield: Part of the robots made within the tolerances that must meet it; without it
            the robot of the drawing must.
    """

    equal: Annotated[Float | None, number("value it must have")] = None
    lower: Annotated[Float | None, number("least value")] = None
    upper: Annotated[Float | None, number("greatest value")] = None
    order: Annotated[
        Literal["tip-first", "base-first"] | None,
        Field(description='"tip-first" or "base-first"'),
    ] = None
    margin: Annotated[Float, number("difference from notch to notch", ge=0.0)] = 0.0
    wanted_yield: Annotated[Float | None, WANTED] = None

    @model_validator(mode="after")
    def _asks_one_thing(self) -> "DesignConstraint":
        limits = self.lower is not None or self.upper is not None
        if [self.equal is not None, limits, self.order is not None].count(True) != 1:
            text = "asks for nothing, or for too much; give `equal`, `lower` and/or `upper`, or "
            raise ProblemError([("", f"{text}`order`.")])
        if self.equal is not None and self.wanted_yield is not None:
            text = "is for limits: no robot with tolerances meets `equal`; give `lower` and `upper`"
            raise ProblemError([("wanted_yield", f"{text}.")])
        if self.lower is not None and self.upper is not None:
            check_order(self.lower, self.upper, "use `equal`")
        return self


@part(kw_only=True, refuse=REFUSE)
class TargetCurve:
    """A curve in the frame of the base that the tube axis must follow at a state.

    Args:
        name: `curve.NAME` is the quantity: distance of every point from the axis, mm; the last
            point is that of the tip.
        state: The state.
        points: Points, three numbers each, mm.
        curvature: Instead of points: pairs of arc length (mm, rising from 0) and curvature (1/mm,
            positive toward x) in the plane of x and z, straight lines between.
        within: Distance from the axis up to which a point counts as reached, mm.
    """

    name: Annotated[Name, Field(description="name of the curve")]
    state: Annotated[str, Field(description="name of a state")]
    points: Annotated[
        tuple[Vector, ...] | None, Field(min_length=2, max_length=1000, description="points, in mm")
    ] = None
    curvature: Annotated[
        tuple[Annotated[tuple[Float, ...], Field(min_length=2, max_length=2)], ...] | None,
        Field(min_length=2, max_length=1000, description="pairs of arc length and curvature"),
    ] = None
    within: Annotated[Float, quantity("mm", "distance up to which a point is reached", above=0)] = (
        0.2
    )

    @model_validator(mode="after")
    def _one_form(self) -> "TargetCurve":
        if (self.points is None) == (self.curvature is None):
            raise ProblemError([("points", "or `curvature` is needed; give one of them.")])
        far = max((abs(x) for one in self.points or () for x in one), default=0.0)
        if far > _MAX_COORDINATE:
            text = f"has a coordinate of {far:g}; give mm, at most {_MAX_COORDINATE:g} mm."
            raise ProblemError([("points", text)])
        if self.curvature is not None:
            lengths = [one[0] for one in self.curvature]
            rises = all(a < b for a, b in itertools.pairwise(lengths))
            if lengths[0] != 0.0 or not rises:
                text = "must begin at an arc length of 0 mm, and rise from pair to pair."
                raise ProblemError([("curvature", text)])
        return self
