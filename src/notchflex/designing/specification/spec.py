"""A whole design file: loads, options, and all tables together."""

from dataclasses import KW_ONLY
from typing import Annotated

from pydantic import Field, model_validator

from notchflex.designing.specification.asked import DesignConstraint, DesignObjective, TargetCurve
from notchflex.designing.specification.chosen import DesignVariable, Stock
from notchflex.designing.specification.fields import (
    REFUSE,
    WANTED,
    Commanded,
    Name,
    Numbers,
    Vector,
    number,
)
from notchflex.robot.part import Float, Int, ProblemError, part
from notchflex.robot.tolerance import Tolerances


@part(kw_only=True, refuse=REFUSE)
class DesignState:
    """A load under which quantities of the robot are asked.

    Args:
        name: What objectives and constraints call it.
        tension: Tension of the first tendon, or of each, N; `nan` where not commanded.
        stroke: Stroke of the first tendon, or of each, mm; `nan` where not commanded.
        after: The state that comes before, with its friction; from rest where not given.
        steps: Number of equal steps from the state before.
        tip_force: Force at the tip, N.
        tip_moment: Moment at the tip, N mm.
        tip_mass: Mass that hangs at the tip, g.
    """

    name: Annotated[Name, Field(description="name of the state")]
    tension: Annotated[
        Commanded | None, Field(description="tension of the first tendon, or of each, in N")
    ] = None
    stroke: Annotated[
        Commanded | None, Field(description="stroke of the first tendon, or of each, in mm")
    ] = None
    after: Annotated[str | None, Field(description="the state that comes before")] = None
    steps: Annotated[Int, Field(ge=1, le=200, description="steps from the state before")] = 5
    tip_force: Annotated[Vector, Field(description="force at the tip, three numbers in N")] = (
        0.0,
        0.0,
        0.0,
    )
    tip_moment: Annotated[Vector, Field(description="moment at the tip, three numbers in N mm")] = (
        0.0,
        0.0,
        0.0,
    )
    tip_mass: Annotated[Float, number("mass at the tip, in g", ge=0.0, le=1e6)] = 0.0


@part(kw_only=True, refuse=REFUSE)
class SearchOptions:
    """Effort of the search.

    Args:
        starts: Number of starts, of which the robot as it is is one.
        candidates: Number of robots from which the other starts are taken.
        seed: Seed of the random numbers.
        iterations: Most iterations of each search.
    """

    starts: Annotated[Int, Field(ge=1, le=1000, description="number of starts")] = 6
    candidates: Annotated[
        Int, Field(ge=1, le=100_000, description="robots from which starts are taken")
    ] = 64
    seed: Annotated[Int, Field(ge=0, le=2**31, description="seed of the random numbers")] = 0
    iterations: Annotated[Int, Field(ge=1, le=10_000, description="most iterations")] = 150


@part(kw_only=True, refuse=REFUSE)
class RobustOptions:
    """Yield of robots within tolerances.

    Args:
        wanted_yield: Part of the robots that must meet all limits. Without it, and where no
            constraint has one of its own, the yield is made as great as possible, instead of the
            objectives.
        draws: About how many robots the yield is counted of.
        seed: Seed of the draws.
    """

    wanted_yield: Annotated[Float | None, WANTED] = None
    draws: Annotated[Int, Field(ge=100, le=1_000_000, description="robots that are drawn")] = 4000
    seed: Annotated[Int, Field(ge=0, le=2**31, description="seed of the draws")] = 0


@part(refuse=REFUSE, kw_only=True)
class DesignSpec:
    """Specification of a design.

    Args:
        robot: Name of a ready robot, or path of a robot file, beside the design file.
        name: What tables and pictures call the design.
        number_of_notches: Numbers of equal notches to try; as in the robot where not given.
        variable: The variables.
        stock: Sizes that can be bought.
        state: The states.
        objective: The objectives; none means the smallest change of the robot.
        constraint: The constraints.
        curve: The curves to be followed.
        search: How hard the search tries.
        tolerance: Within what robots are made, as in a robot file; where not given, the tolerances
            of the robot, and assumed ones.
        robust: How robots made within the tolerances are to meet the limits.
    """

    _: KW_ONLY
    robot: Annotated[str, Field(min_length=1, description="ready robot, or robot file")]
    name: Annotated[str, Field(min_length=1, max_length=200, description="name of the design")] = (
        "design"
    )
    number_of_notches: Annotated[
        Numbers, Field(max_length=100, description="numbers of notches to try")
    ] = ()
    variable: Annotated[
        tuple[DesignVariable, ...], Field(max_length=500, description="numbers to be chosen")
    ] = ()
    stock: Annotated[tuple[Stock, ...], Field(max_length=5, description="sizes to be bought")] = ()
    state: Annotated[tuple[DesignState, ...], Field(max_length=100, description="loads")] = ()
    objective: Annotated[
        tuple[DesignObjective, ...], Field(max_length=50, description="what is to be small")
    ] = ()
    constraint: Annotated[
        tuple[DesignConstraint, ...], Field(max_length=500, description="what must hold")
    ] = ()
    curve: Annotated[tuple[TargetCurve, ...], Field(max_length=20, description="curves")] = ()
    search: Annotated[SearchOptions, Field(description="how hard the search tries")] = (
        SearchOptions()
    )
    tolerance: Annotated[Tolerances, Field(description="how far values may lie from these")] = ()
    robust: Annotated[
        RobustOptions | None, Field(description="what robots made within the tolerances must meet")
    ] = None

    @property
    def is_robust(self) -> bool:
        """Whether tolerances count."""
        return self.robust is not None or any(one.wanted_yield for one in self.constraint)

    @model_validator(mode="after")
    def _something(self) -> "DesignSpec":
        if not (self.variable or self.stock or self.number_of_notches):
            raise ProblemError([("variable", "is missing; give at least one [[variable]] table.")])
        if not (self.objective or self.constraint or self.curve):
            text = "is missing, and so are [[constraint]] and [[curve]]; give at least one of them."
            raise ProblemError([("objective", text)])
        return self
