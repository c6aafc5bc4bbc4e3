"""Edges of a photograph near a predicted outline, to a part of a pixel."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex.photographs.chain_table import Numbers
from notchflex.photographs.contrast import Contrast
from notchflex.photographs.outline import Outline

STEP = 0.5
"""Distance of samples along a normal, px."""

_BESIDE = 5.0  # how far out the background is looked at, px
_BLURRED = 0.35  # contrast outside over that inside: what blur leaves of a sharp edge
_USUAL = 70.0  # percentile of the rises that is called usual
_MIN_ROOM = 5.0  # gaps that are narrower show no background, px


class Edges(NamedTuple):
    """Edges along the normals of an outline, N points.

    Attributes:
        offset: Distance of each edge from the predicted point, outward, px, (N,); NaN if none.
        looked: Whether an edge should be seen there, (N,).
        strength: How steep the contrast rises there, over that of most edges, 1 at most, (N,).
    """

    offset: Numbers
    looked: NDArray[np.bool_]
    strength: Numbers


def find_edges(contrast: Contrast, outline: Outline, reach: float) -> Edges:
    """Find the edge of the robot nearest to every point of an outline.

    Outside an edge lies background; the edge is where the contrast rises most steeply.

    Args:
        contrast: Contrast of the photograph against its background.
        outline: Where the outline is expected; its first view counts.
        reach: How far from there an edge is looked for, px.
    """
    import cv2

    height, width = contrast.value.shape
    room = np.minimum(outline.room, 1e6)
    looked = (room > _MIN_ROOM) & (outline.breadth > 3.0)
    steps = np.arange(-reach - _BESIDE, reach + 2.0 * _BESIDE + STEP, STEP)
    place = outline.point[0] + contrast.middle
    looked &= ((place > 2.0) & (place < [width - 3.0, height - 3.0])).all(axis=1)
    where = place[:, None] + steps[None, :, None] * outline.normal[:, None]
    profile: Any = cv2.remap(
        contrast.value,
        where[..., 0].astype(np.float32),
        where[..., 1].astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    smooth: Any = cv2.GaussianBlur(profile, (0, 0), 1.2 / STEP, sigmaY=1e-3)
    rise = smooth[:, :-2] - smooth[:, 2:]  # toward the inside
    level = rise[:, 1:-1]
    peak = (level > rise[:, :-2]) & (level >= rise[:, 2:])
    position = steps[2:-2]
    far = round(_BESIDE / STEP)
    outside = np.minimum(np.arange(2, len(steps) - 2) + far, len(steps) - 1)
    within = smooth[:, np.maximum(np.arange(2, len(steps) - 2) - far, 0)]
    clear = smooth[:, outside] < np.maximum(contrast.threshold, _BLURRED * within)
    strong = within - smooth[:, outside] > 0.5 * contrast.threshold
    limit = np.minimum(reach, 0.6 * room)[:, None]
    allowed = peak & clear & strong & (np.abs(position)[None] <= limit)
    cost = np.where(allowed, np.abs(position)[None], np.inf)
    best = cost.argmin(axis=1)
    row = np.arange(len(best))
    is_edge = np.isfinite(cost[row, best]) & looked
    before, here, after = (rise[row, best + shift] for shift in (0, 1, 2))
    bend = before - 2.0 * here + after
    shift = np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, -1.0), 0.0)
    offset = position[best] + np.clip(shift, -1.0, 1.0) * STEP
    return Edges(np.where(is_edge, offset, np.nan), looked, _strength(here, is_edge))


def _strength(rise: Numbers, is_edge: NDArray[np.bool_]) -> Numbers:
    if not is_edge.any():
        return np.zeros(len(rise))
    usual = max(float(np.percentile(rise[is_edge], _USUAL)), 1e-9)
    return np.where(is_edge, np.clip(rise / usual, 0.0, 1.0), 0.0)
