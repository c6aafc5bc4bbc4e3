"""The tables of a design file that say what may be chosen: variables and stock."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from notchflex.designing.specification.fields import REFUSE, check_order, number
from notchflex.robot.part import Float, Int, ProblemError, part


@part(kw_only=True, refuse=REFUSE)
class DesignVariable:
    """A number that the search may choose.

    Args:
        value: Path of the robot file, such as `notch.depth`, or `state.NAME.tension[1]`.
        lower: Least value allowed, in the unit of the robot file.
        upper: Greatest value allowed.
        along: For a value of the notches: "all" have the same, "each" has its own, or "polynomial"
            along the tube.
        degree: Degree of the polynomial; 1 if not given.
    """

    value: Annotated[str, Field(description="path of the robot file, or state.NAME.tension[1]")]
    lower: Annotated[Float, number("least value allowed")]
    upper: Annotated[Float, number("greatest value allowed")]
    along: Annotated[
        Literal["all", "each", "polynomial"],
        Field(description='"all" notches have the same value, "each" its own, or "polynomial"'),
    ] = "all"
    degree: Annotated[
        Int | None, Field(ge=1, le=6, description="degree of the polynomial; 1 if not given")
    ] = None

    @model_validator(mode="after")
    def _in_order(self) -> "DesignVariable":
        check_order(self.lower, self.upper, "set the value in the robot file")
        if self.degree is not None and self.along != "polynomial":
            text = f'is for along = "polynomial", and along is "{self.along}"; change one of them.'
            raise ProblemError([("degree", text)])
        return self


@part(kw_only=True, refuse=REFUSE)
class Stock:
    """Sizes that can be bought: several values that change together.

    Args:
        values: Paths of the robot file.
        sizes: A list of sizes, each with one number for every path.
    """

    values: Annotated[
        tuple[str, ...], Field(min_length=1, max_length=20, description="paths of the robot file")
    ]
    sizes: Annotated[
        tuple[tuple[Float, ...], ...],
        Field(min_length=1, max_length=100, description="sizes, each with a number for every path"),
    ]

    @model_validator(mode="after")
    def _complete(self) -> "Stock":
        wrong = [one for one in self.sizes if len(one) != len(self.values)]
        if wrong:
            text = f"has a size of {len(wrong[0])} numbers for {len(self.values)} values; give "
            raise ProblemError([("sizes", f"{text}{len(self.values)} numbers for every size.")])
        return self
