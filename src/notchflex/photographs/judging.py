"""Acceptance of a fit: the reason for a rejection, in one sentence."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from notchflex.photographs.camera import NUMBERS
from notchflex.photographs.chain_table import Numbers
from notchflex.photographs.fitting import MAX_RESIDUAL, Fit
from notchflex.photographs.outline import FACE, SIDE, SPINE

MIN_WIDTH = 25.0
"""Width of the tube below which angles are not measured, px."""

MAX_SPREAD = math.radians(0.5)
"""Standard deviation of one angle beyond which none is reported, rad."""

UNCERTAINTY = math.radians(0.11)
"""Root mean square of the standard deviations beyond which no angles are reported, rad."""

_APART = 3.0  # standard deviations by which the scale of a fit may differ from a known one
_MAX_NOISE = 1.0
_RIVAL = 12.0  # by how much the misfit of another shape must be larger
_OTHER = math.radians(0.7)  # by how much the angles of another shape differ
_MADE = 0.04  # of the outer diameter: how far notches may differ from the robot file


def rejection_reason(
    fit: Fit,
    rivals: Iterable[tuple[float, float]],
    deviation: Numbers,
    uncertainty: float = math.inf,
) -> str:
    """Return why the fit is rejected, or an empty string.

    Args:
        fit: The best fit.
        rivals: By how much more other fits miss the edges, and by how much their angles differ.
        deviation: Standard deviations of its angles, rad.
        uncertainty: Root mean square of the deviations that is allowed, rad.
    """
    # Where parts are missing, view and cut are those of something else.
    return (
        _of_scale(fit)
        or missing(fit)
        or _of_view(fit)
        or _of_spread(fit, rivals, deviation)
        or _of_uncertainty(deviation, uncertainty)
    )


def _of_scale(fit: Fit) -> str:
    numbers, prior = fit.numbers, fit.model.prior
    width = 2.0 * fit.model.table.outer * math.exp(numbers[3])
    if width < MIN_WIDTH:
        return f"the tube is {width:.0f} pixels wide; it needs {MIN_WIDTH:.0f} or more, go nearer"
    more = numbers[3] - math.log(prior.scale) if prior.scale > 0.0 else 0.0
    if abs(more) > _APART * prior.scale_deviation:
        percent = 100.0 * math.expm1(more)
        return (
            f"the outer diameter gives a scale {percent:+.1f} % off the one that is given or that "
            "the board gives; check the diameter, and that the board lies in the plane of the robot"
        )
    return ""


def _of_view(fit: Fit) -> str:
    roll, tilt, _, kerf, cut = fit.numbers[4:NUMBERS]
    if abs(math.remainder(roll, math.pi)) > math.radians(25) or abs(tilt) > math.radians(18):
        return "the robot is not seen from the side: it is rolled or tilted too far"
    if max(abs(kerf), abs(cut)) > 2.0 * _MADE * fit.model.table.outer:
        return "the notches differ from the robot file; check its depths and heights"
    return ""


def _of_spread(fit: Fit, rivals: Iterable[tuple[float, float]], deviation: Numbers) -> str:
    if fit.noise > _MAX_NOISE:
        return f"edges lie {fit.noise:.1f} pixels beside the outline"
    if not np.isfinite(deviation).all() or deviation.max() > MAX_SPREAD:
        worst = int(np.argmax(np.nan_to_num(deviation, nan=np.inf)))
        return (
            f"the angle of notch {worst + 1} is uncertain by {math.degrees(deviation[worst]):.1f} "
            "deg (standard deviation)"
        )
    for worse, differs in rivals:
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


_MIN_SCORE, _MIN_SIDE, _MIN_BASE, _MIN_TIP = 0.7, 0.5, 0.35, 0.5
_MAX_HIDDEN, _MIN_OTHER = 1, 0.7  # rings of which one side looks like the background
_MIN_FACES, _MIN_SPINES, _MIN_INNER = 0.35, 0.5, 0.3


def missing(fit: Fit) -> str:
    """Return why the fit is rejected for a part that is not seen, or an empty string."""
    model, n = fit.model, fit.model.table.notches
    is_near = np.abs(fit.residual) < MAX_RESIDUAL
    looked = fit.edges.looked

    def share(part: np.ndarray) -> float:
        return float(is_near[part].mean()) if part.any() else 0.0

    side, face = model.kind == SIDE, model.kind == FACE
    hidden: list[int] = []
    for ring in range(n + 1):
        shares = [share(side & (model.ring == ring) & (model.which == which)) for which in (-1, 1)]
        least = _MIN_SIDE if ring else _MIN_BASE
        if min(shares) < least:
            hidden.append(ring)
            if max(shares) < _MIN_OTHER:
                return _hidden(ring)
    if len(hidden) > _MAX_HIDDEN:
        return _hidden(hidden[0])
    tip = face & (model.ring == n) & (model.which > 0)
    if share(tip) < _MIN_TIP:
        return "the tip is not seen clearly where the robot file has it"
    for notch in range(1, n + 1):
        faces = ((model.ring == notch - 1) & (model.which > 0)) | (
            (model.ring == notch) & (model.which < 0)
        )
        part = face & faces & looked
        if part.sum() > 6 and share(part) < _MIN_FACES:
            return f"the faces of notch {notch} are not seen where the robot file has them"
    # A robot laid out on its wrong side fits rings, but its spines lie where there is nothing.
    notch = np.clip(model.ring - 1, 0, n - 1)
    back = (model.kind == SPINE) & (model.which * model.table.side[notch] < 0.0)
    if share(back) < _MIN_SPINES:
        return "the spines beside the notches are not seen where the robot file has them"
    inner = (model.kind == SPINE) & (model.which * model.table.side[notch] > 0.0) & looked
    if inner.any() and share(inner) < _MIN_INNER:
        return (
            "the inner edges of the notches are not seen where the robot file has them; check "
            "depth and cut"
        )
    if fit.score < _MIN_SCORE:
        return f"only {100 * fit.score:.0f} % of the outline is found in the photograph"
    return ""


def _hidden(ring: int) -> str:
    where = f"the tube behind notch {ring}" if ring else "the tube before notch 1"
    return f"a side of {where} is not seen clearly"
