"""Acceptance of a fit: the reason for a rejection, in one sentence."""

from __future__ import annotations

import math

import numpy as np

from notchflex.photographs.chain.camera import NUMBERS
from notchflex.photographs.chain.chain_table import Numbers
from notchflex.photographs.locating import Located
from notchflex.photographs.missing import missing

MIN_WIDTH = 25.0
"""Width of the tube below which angles are not measured, px."""

MAX_SPREAD = math.radians(0.5)
"""Standard deviation of one angle beyond which none is reported, rad."""

UNCERTAINTY = math.radians(0.11)
"""Root mean square of the standard deviations beyond which no angles are reported, rad."""

_MAX_NOISE = 1.0
_RIVAL = 12.0  # by how much the misfit of another shape must be larger
_OTHER = math.radians(0.7)  # by how much the angles of another shape differ
_MADE = 0.04  # of the outer diameter: how far notches may differ from the robot file


def rejection_reason(
    located: Located, deviation: Numbers, noise: float, uncertainty: float = math.inf
) -> str:
    """Return why the fit is rejected, or an empty string.

    Args:
        located: The best fit.
        deviation: Standard deviations of its angles, rad.
        noise: Robust spread of its edges, px.
        uncertainty: Root mean square of the deviations that is allowed, rad.
    """
    # Where parts are missing, view and cut are those of something else.
    reasons = (
        _of_scale(located),
        missing(located.model, located.fit),
        _of_view(located),
        _of_spread(located, deviation, noise),
        _of_uncertainty(deviation, uncertainty),
    )
    return next((reason for reason in reasons if reason), "")


def _of_scale(located: Located) -> str:
    numbers, prior = located.fit.numbers, located.model.prior
    width = 2.0 * located.model.table.outer * math.exp(numbers[3])
    if width < MIN_WIDTH:
        return f"the tube is {width:.0f} pixels wide; it needs {MIN_WIDTH:.0f} or more, go nearer"
    if prior.contradicted(numbers):
        more = 100.0 * math.expm1(numbers[3] - math.log(prior.scale))
        return (
            f"the outer diameter gives a scale {more:+.1f} % off the one that is given or that the "
            "board gives; check the diameter, and that the board lies in the plane of the robot"
        )
    return ""


def _of_view(located: Located) -> str:
    fit, table = located.fit, located.model.table
    roll, tilt, _, kerf, cut = fit.numbers[4:NUMBERS]
    if abs(math.remainder(roll, math.pi)) > math.radians(25) or abs(tilt) > math.radians(18):
        return "the robot is not seen from the side: it is rolled or tilted too far"
    if max(abs(kerf), abs(cut)) > 2.0 * _MADE * table.outer:
        return "the notches differ from the robot file; check its depths and heights"
    return ""


def _of_spread(located: Located, deviation: Numbers, noise: float) -> str:
    if noise > _MAX_NOISE:
        return f"edges lie {noise:.1f} pixels beside the outline"
    if not np.isfinite(deviation).all() or deviation.max() > MAX_SPREAD:
        worst = int(np.argmax(np.nan_to_num(deviation, nan=np.inf)))
        return (
            f"the angle of notch {worst + 1} is uncertain by {math.degrees(deviation[worst]):.1f} "
            "deg (standard deviation)"
        )
    for worse, differs in located.rival:
        if worse < _RIVAL and differs > _OTHER:
            return (
                "two shapes fit almost equally well; their angles differ by up to "
                f"{math.degrees(differs):.1f} deg"
            )
    return ""


def _of_uncertainty(deviation: Numbers, most: float) -> str:
    mean = float(np.sqrt((deviation**2).mean()))
    if mean <= most:
        return ""
    return (
        f"the angles are uncertain by {math.degrees(mean):.3f} deg (standard deviations, root mean "
        f"square), and {math.degrees(most):g} deg are allowed; go nearer, take it sharper and in "
        "even light, or allow more"
    )
