"""Check that every part of a fitted robot is visible in the photograph."""

from __future__ import annotations

import numpy as np

from notchflex.photographs.chain.outline import FACE, SIDE, SPINE, OutlineModel
from notchflex.photographs.fitting import Fit

MAX_RESIDUAL = 2.0
"""Distance from the outline within which an edge counts as its own, px."""

_MIN_SCORE, _MIN_SIDE, _MIN_BASE, _MIN_TIP = 0.7, 0.5, 0.35, 0.5
_MAX_HIDDEN, _MIN_OTHER = 1, 0.7  # rings of which one side looks like the background
_MIN_FACES, _MIN_SPINES, _MIN_INNER = 0.35, 0.5, 0.3


def missing(model: OutlineModel, fit: Fit) -> str:
    """Return why the fit is rejected for a part that is not seen, or an empty string."""
    n = model.table.notches
    is_near = np.abs(fit.residual) < MAX_RESIDUAL
    looked = fit.edges.looked

    def share(part: np.ndarray) -> float:
        return float(is_near[part].mean()) if part.any() else 0.0

    side, face = model.kind == SIDE, model.kind == FACE
    hidden: list[int] = []
    for ring in range(n + 1):
        shares = [share(side & (model.ring == ring) & (model.which == one)) for one in (-1.0, 1.0)]
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
        beside = ((model.ring == notch - 1) & (model.which > 0)) | (
            (model.ring == notch) & (model.which < 0)
        )
        part = face & beside & looked
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
