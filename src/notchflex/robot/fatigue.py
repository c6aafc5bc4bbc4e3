"""Limit lines of fatigue: the strain amplitude that the literature, or a user, allows at a mean."""

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import Field

from notchflex.robot.kinds import PRINTABLE, celsius
from notchflex.robot.part import MOST_STRAIN, Float, Problems, part, positive, quantity

_Strains = Annotated[
    tuple[Annotated[Float, quantity("", "strain", at_least=0, at_most=MOST_STRAIN)], ...],
    Field(min_length=2, max_length=100),
]
_Words = Annotated[str, Field(strict=True, max_length=200), PRINTABLE] | None


@part(kw_only=True)
class Fatigue:
    """A limit line over the mean strain, straight between its points; beyond them it is not known.

    It is for so many cycles and says nothing of others: no number of cycles is predicted.

    Args:
        line: A line of the literature: "cao2020" or "pelton2003", which contradict each other.
        mean: Mean strains of a line of your own, rising from 0 or more.
        amplitude: Strain amplitude that is allowed at each of them.
        cycles: Number of cycles that it is for.
        reliability: Part of all specimens that survive them.
        temperature: Temperature of its tests [deg C].
        surface: Surface of its specimens.
        source: Where it is from.
        corner_factor: Strain at the corners of the cut over that of the section (K_t); without it
            and `corner_radius` the concentration is left out. Round backbones have no corners.
        corner_radius: Radius of these corners [mm], from which the factor of cuts "on-axis" is
            known by finite elements; beyond their range a notch has no margin.

    Raises:
        InputError: A value is not allowed, or both a line of the literature and one of your own.

    Example:
        >>> Fatigue(line="cao2020").facts["cycles"]
        400000000.0
    """

    line: Annotated[
        Literal["cao2020", "pelton2003"] | None,
        Field(description='limit line of the literature, "cao2020" or "pelton2003"'),
    ] = None
    mean: Annotated[_Strains | None, Field(description="mean strains of a line, rising")] = None
    amplitude: Annotated[
        _Strains | None, Field(description="strain amplitude allowed at each of them")
    ] = None
    cycles: Annotated[Float | None, positive("", "cycles of the line", at_most=1e15)] = None
    reliability: Annotated[
        Float | None, positive("", "part of the specimens that survive", at_most=1)
    ] = None
    temperature: Annotated[Float | None, celsius("temperature of the tests")] = None
    surface: Annotated[_Words, Field(description="surface of the specimens")] = None
    source: Annotated[_Words, Field(description="where the line is from")] = None
    corner_factor: Annotated[
        Float | None,
        quantity("", "strain at the corners of the cut over that of the section", at_least=1.0),
    ] = None
    corner_radius: Annotated[Float | None, positive("mm", "radius of the corners of the cut")] = (
        None
    )

    def conflicts(self) -> Problems:
        """Find a line that is given twice or by half, and means that do not rise."""
        given = [key for key in LINES["cao2020"] if getattr(self, key) is not None]
        if self.line is not None and given:
            yield "line", f'is "{self.line}", which has its own `{given[0]}`; give one of the two.'
        if self.corner_factor is not None and self.corner_radius is not None:
            yield (
                "corner_factor",
                "stands beside `corner_radius`, from which it is computed; give one.",
            )
        mean, amplitude = self.mean, self.amplitude
        if (mean is None) != (amplitude is None) or len(mean or ()) != len(amplitude or ()):
            yield "amplitude", "must have one number for each of `mean`."
        if any(second <= first for first, second in pairwise(mean or ())):
            yield "mean", "must rise from each number to the next."

    @property
    def facts(self) -> dict[str, Any]:
        """The line that holds: its points, and what is known of its tests; {} without a line."""
        if self.line is not None:
            return LINES[self.line]
        return {key: getattr(self, key) for key in LINES["cao2020"]} if self.mean else {}


LINES: dict[str, dict[str, Any]] = {
    "cao2020": {
        "mean": (0.0, 0.03, 0.07),
        "amplitude": (0.0055, 0.0016, 0.0016),
        "cycles": 4e8,
        "reliability": 0.9,
        "temperature": 37.0,
        "surface": "electropolished, in bending",
        "source": "Cao, Wu, Zhou, McMeeking, Ritchie, doi:10.34657/3724 (95 % confidence); "
        "between 0 and 3 % a straight line is assumed",
    },
    "pelton2003": {
        "mean": (0.0, 0.015),
        "amplitude": (0.004, 0.004),
        "cycles": 1e7,
        "reliability": None,
        "temperature": None,
        "surface": "diamond specimens",
        "source": "Pelton et al. 2003, as commonly cited; beyond a mean of 1.5 % life rises, but "
        "no line is taken here",
    },
}
"""Limit lines of the literature by name."""
