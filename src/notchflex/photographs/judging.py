"""Whether a fit can be trusted: the reason why not, in one sentence."""

from __future__ import annotations

import math

import numpy as np

from notchflex.photographs.chain_table import Numbers
from notchflex.photographs.locating import NEAR, Located
from notchflex.photographs.outline import FACE, NUMBERS, SIDE

LEAST_WIDTH = 25.0
"""Width of the tube below which angles are not measured, px."""

MOST_SPREAD = math.radians(0.5)
"""Standard deviation of an angle beyond which it is not reported, rad."""

_LEAST_SCORE, _LEAST_SIDE, _LEAST_BASE, _LEAST_TIP, _LEAST_FACES = 0.7, 0.5, 0.35, 0.5, 0.35
_MOST_NOISE = 1.0
_RIVAL = 12.0  # by how much the misfit of another shape must be larger
_MADE = 0.04  # of the outer diameter: how far notches may differ from the robot file


def doubt(located: Located, deviation: Numbers, noise: float) -> str:
    """Return why angles are not reported; "" if nothing speaks against them.

    Args:
        located: The best fit.
        deviation: Standard deviations of its angles, rad.
        noise: Robust spread of its edges, px.
    """
    reasons = (_of_view(located), _of_edges(located), _of_spread(located, deviation, noise))
    return next((reason for reason in reasons if reason), "")


def _of_view(located: Located) -> str:
    fit, table = located.fit, located.model.table
    _, _, _, log_scale, roll, tilt, _, kerf, cut = fit.numbers[:NUMBERS]
    width = 2.0 * table.outer * math.exp(log_scale)
    if width < LEAST_WIDTH:
        return f"the tube is {width:.0f} pixels wide; it needs {LEAST_WIDTH:.0f} or more, go nearer"
    if abs(math.remainder(roll, math.pi)) > math.radians(25) or abs(tilt) > math.radians(18):
        return "the robot is not seen from the side: it is rolled or tilted too far"
    if max(abs(kerf), abs(cut)) > 2.0 * _MADE * table.outer:
        return "the notches differ from the robot file; check its depths and heights"
    return ""


def _of_edges(located: Located) -> str:
    model, fit = located.model, located.fit
    n = model.table.notches
    good = np.abs(fit.residual) < NEAR
    looked = fit.edges.looked

    def share(part: np.ndarray) -> float:
        return float(good[part].mean()) if part.any() else 0.0

    side, face = model.kind == SIDE, model.kind == FACE
    for ring in range(n + 1):
        for which in (-1.0, 1.0):
            part = side & (model.ring == ring) & (model.which == which)
            if share(part) < (_LEAST_SIDE if ring else _LEAST_BASE):
                where = f"the tube behind notch {ring}" if ring else "the tube before notch 1"
                return f"a side of {where} is not seen clearly"
    tip = face & (model.ring == n) & (model.which > 0)
    if share(tip) < _LEAST_TIP:
        return "the tip is not seen clearly where the robot file has it"
    for notch in range(1, n + 1):
        beside = ((model.ring == notch - 1) & (model.which > 0)) | (
            (model.ring == notch) & (model.which < 0)
        )
        part = face & beside & looked
        if part.sum() > 6 and share(part) < _LEAST_FACES:
            return f"the faces of notch {notch} are not seen where the robot file has them"
    if fit.score < _LEAST_SCORE:
        return f"only {100 * fit.score:.0f} % of the outline is found in the photograph"
    return ""


def _of_spread(located: Located, deviation: Numbers, noise: float) -> str:
    if noise > _MOST_NOISE:
        return f"edges lie {noise:.1f} pixels beside the outline"
    if not np.isfinite(deviation).all() or deviation.max() > MOST_SPREAD:
        worst = int(np.argmax(np.nan_to_num(deviation, nan=np.inf)))
        return (
            f"the angle of notch {worst + 1} is uncertain by {math.degrees(deviation[worst]):.1f} "
            "deg (standard deviation)"
        )
    for worse, differs in located.rival:
        if worse < _RIVAL:
            return (
                "two shapes fit nearly alike; their angles differ by up to "
                f"{math.degrees(differs):.1f} deg"
            )
    return ""
