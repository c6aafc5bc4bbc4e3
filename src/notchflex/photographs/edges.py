"""The contrast of a photograph against its background, and edges to a part of a pixel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex.photographs.chain_table import Numbers
from notchflex.photographs.outline import Outline

Image = NDArray[np.float32]

_COARSE = 240
_ROUNDS = 12


@dataclass(frozen=True)
class Contrast:
    """Difference of a photograph from its background.

    Attributes:
        value: Distance of every pixel from the background over all colours, grey levels.
        threshold: Contrast above which a pixel is not background.
        middle: Middle of the photograph, px, (2,).
    """

    value: Image
    threshold: float
    middle: NDArray[np.float64]

    def reduced(self, factor: float) -> Contrast:
        """Return the same of a photograph made smaller."""
        import cv2

        if factor >= 1.0:
            return self
        small: Any = cv2.resize(
            self.value, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA
        )
        return Contrast(small, self.threshold, (self.middle + 0.5) * factor - 0.5)


def contrast(photograph: NDArray[np.uint8]) -> Contrast:
    """Find the background of a photograph, a smooth surface in each colour, and the contrast."""
    import cv2

    height, width = photograph.shape[:2]
    factor = min(1.0, _COARSE / max(height, width))
    small = cv2.resize(photograph, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    surface = _surface(small.astype(np.float64))
    background: Any = cv2.resize(
        surface.astype(np.float32), (width, height), interpolation=cv2.INTER_CUBIC
    )
    cv2.subtract(photograph.astype(np.float32), background, dst=background)
    cv2.multiply(background, background, dst=background)
    value: Any = np.sqrt(cv2.transform(background, np.full((1, 3), 1.0 / 3.0, np.float32)))
    value = cv2.GaussianBlur(value, (0, 0), 0.7)
    low = cv2.resize(value, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    noise = float(np.median(low))
    # Otsu's threshold between background and the rest, not below the noise of the background.
    capped = np.clip(low, 0.0, 255.0).astype(np.uint8)
    otsu, _ = cv2.threshold(capped, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    middle = (np.array([width, height]) - 1.0) / 2.0
    return Contrast(value, max(0.6 * float(otsu), 4.0 * noise, 5.0), middle)


def _surface(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fit a quadratic surface to the most common colours by reweighted least squares."""
    height, width, _ = image.shape
    y, x = np.meshgrid(np.linspace(-1, 1, height), np.linspace(-1, 1, width), indexing="ij")
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1).reshape(-1, 6)
    colour = image.reshape(-1, 3)
    border = np.ones((height, width), bool)
    border[height // 12 : -height // 12, width // 12 : -width // 12] = False
    middle = np.median(colour[border.ravel()], axis=0)
    away = np.sqrt(((colour - middle) ** 2).mean(axis=1))
    scale = max(60.0, float(np.median(away)))
    fitted = np.broadcast_to(middle, colour.shape)
    for _ in range(_ROUNDS):
        weight = np.maximum(1.0 - (away / scale) ** 2, 0.0) ** 2
        if np.count_nonzero(weight) < len(weight) // 20:
            break
        weighted = terms * weight[:, None]
        coefficients = np.linalg.lstsq(weighted.T @ terms, weighted.T @ colour, rcond=None)[0]
        fitted = terms @ coefficients
        away = np.sqrt(((colour - fitted) ** 2).mean(axis=1))
        scale = max(6.0, min(0.8 * scale, 60.0), 4.0 * float(np.median(away[weight > 0.0])))
    return fitted.reshape(image.shape)


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
