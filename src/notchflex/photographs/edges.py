"""The contrast of a photograph, its edges to a part of a pixel, and errors that edges share.

Every side of a ring, end of a ring and edge of a spine is one line. Its edges have errors of their
own, and share a shift and a turn (blur, highlights, paper lines), which are unknowns with a spread.
All lines share one shift outward, which blur and shading cause. The spread is that of most lines; a
line that lies farther off has a spread of its own size and counts less.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

_COARSE = 240  # px: longer side of the photograph in which the background is fitted
_ROUNDS = 12


@dataclass(frozen=True)
class Contrast:
    """Difference of a photograph from its background.

    Attributes:
        value: Distance of every pixel from the background over all colours, grey levels.
        threshold: Contrast above which a pixel is not background.
        size: Width and height of the photograph, px, (2,).
        factor: By how much the photograph was made smaller for it.
    """

    value: NDArray[np.float32]
    threshold: float
    size: Numbers
    factor: float = 1.0

    @property
    def middle(self) -> Numbers:
        """Middle of the photograph, px of this contrast, (2,)."""
        return 0.5 * self.factor * self.size - 0.5

    @property
    def centre(self) -> Numbers:
        """Middle of the photograph, px of it, (2,)."""
        return 0.5 * self.size - 0.5

    def reduced(self, factor: float) -> Contrast:
        """Return the contrast of the photograph made smaller by a factor."""
        value = made_smaller(self.value, factor / self.factor)
        return Contrast(value, self.threshold, self.size, min(factor, self.factor))


def made_smaller(picture: NDArray[Any], factor: float) -> Any:
    """Return a picture made smaller by a factor; the same if it would become larger."""
    import cv2

    if factor >= 1.0:
        return picture
    return cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)


def contrast(picture: NDArray[np.uint8], factor: float = 1.0) -> Contrast:
    """Find the background, a smooth surface in each colour, and the contrast against it.

    Args:
        picture: The photograph, (height, width, 3).
        factor: By how much it was made smaller.
    """
    import cv2

    size = np.array(picture.shape[1::-1])
    coarse = _COARSE / float(size.max())
    surface = _surface(made_smaller(picture, coarse).astype(np.float64))
    background: Any = cv2.resize(
        surface.astype(np.float32), size.tolist(), interpolation=cv2.INTER_CUBIC
    )
    value: Any = np.sqrt(np.square(picture - background).mean(axis=2))
    value = cv2.GaussianBlur(value, (0, 0), 0.7)
    low = made_smaller(value, coarse)
    # Otsu's threshold between background and the rest, not below the noise of the background.
    capped = np.clip(low, 0.0, 255.0).astype(np.uint8)
    otsu, _ = cv2.threshold(capped, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    return Contrast(
        value, max(0.6 * float(otsu), 4.0 * float(np.median(low)), 5.0), size / factor, factor
    )


def _surface(image: Numbers) -> Numbers:
    """Fit a quadratic surface to the most common colours by reweighted least squares."""
    height, width, _ = image.shape
    y, x = np.meshgrid(np.linspace(-1, 1, height), np.linspace(-1, 1, width), indexing="ij")
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1).reshape(-1, 6)
    border = np.ones((height, width), bool)
    border[height // 12 : -height // 12, width // 12 : -width // 12] = False
    colour, fitted = image.reshape(-1, 3), np.median(image[border], axis=0)
    away = np.sqrt(((colour - fitted) ** 2).mean(axis=1))
    scale = max(60.0, float(np.median(away)))
    for _ in range(_ROUNDS):
        weight = np.maximum(1.0 - (away / scale) ** 2, 0.0) ** 2
        if np.count_nonzero(weight) < len(weight) // 20:
            break
        weighted = terms * weight[:, None]
        coefficients = np.linalg.lstsq(weighted.T @ terms, weighted.T @ colour, rcond=None)[0]
        fitted = terms @ coefficients
        away = np.sqrt(((colour - fitted) ** 2).mean(axis=1))
        scale = max(6.0, min(0.8 * scale, 60.0), 4.0 * float(np.median(away[weight > 0.0])))
    return np.broadcast_to(fitted, colour.shape).reshape(image.shape)


class Outline(NamedTuple):
    """Points of outlines. N points, b views.

    Attributes:
        point: Where they are seen, px from the middle of the photograph, (b, N, 2).
        normal: Unit normals that point out of the robot, of the first view, (N, 2).
        room: How far the background reaches beyond each point along its normal, px, of the first
            view, (N,); infinite where nothing follows.
        breadth: How far the robot reaches inside each point, px, (N,).
    """

    point: Numbers
    normal: Numbers
    room: Numbers
    breadth: Numbers


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


_STEP = 0.5  # px: distance of samples along a normal
_BESIDE = 10  # samples: how far out the background and how far in the robot is looked at
_BLURRED = 0.35  # contrast outside over that inside: what blur leaves of a sharp edge
_USUAL = 70.0  # percentile of the rises that is called usual
_MIN_ROOM, _MIN_BREADTH = 5.0, 3.0  # px: narrower gaps show no background, narrower walls no edge


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
    place = outline.point[0] + contrast.middle
    looked = (outline.room > _MIN_ROOM) & (outline.breadth > _MIN_BREADTH)
    looked &= ((place > 2.0) & (place < [width - 3.0, height - 3.0])).all(axis=1)
    out = _BESIDE * _STEP
    steps = np.arange(-reach - out, reach + 2.0 * out + _STEP, _STEP)
    where = place[:, None] + steps[:, None] * outline.normal[:, None]
    x, y = np.moveaxis(where, -1, 0).astype(np.float32)
    profile: Any = cv2.remap(
        contrast.value, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    smooth: Any = cv2.GaussianBlur(profile, (0, 0), 1.2 / _STEP, sigmaY=1e-3)
    inside, outside = smooth[:, : -2 * _BESIDE], smooth[:, 2 * _BESIDE :]
    rise, position = -np.gradient(smooth, axis=1), steps[_BESIDE:-_BESIDE]
    before, level, after = (rise[:, _BESIDE + k : k - _BESIDE] for k in (-1, 0, 1))
    allowed = (level > before) & (level >= after)
    allowed &= outside < np.maximum(contrast.threshold, _BLURRED * inside)
    allowed &= inside - outside > 0.5 * contrast.threshold
    distance = np.where(allowed, np.abs(position), np.inf)
    distance[distance > np.minimum(reach, 0.6 * outline.room)[:, None]] = np.inf
    nearest = np.arange(len(distance)), distance.argmin(axis=1)
    is_edge = np.isfinite(distance[nearest]) & looked
    before, level, after = before[nearest], level[nearest], after[nearest]
    bend = np.minimum(before - 2.0 * level + after, -1e-30)
    shift = np.clip(0.5 * (before - after) / bend, -1.0, 1.0)
    offset = np.where(is_edge, position[nearest[1]] + shift * _STEP, np.nan)
    usual = max(float(np.percentile(level[is_edge], _USUAL)), 1e-9) if is_edge.any() else 1.0
    return Edges(offset, looked, np.where(is_edge, np.clip(level / usual, 0.0, 1.0), 0.0))


_FIRST_SPREAD = (0.3, 0.08)  # px: spreads of shift and turn of a line before they are known
_MIN_SPREAD, _MAX_SPREAD = (0.06, 0.04), 2.0  # px
_MIN_POINTS = 5
_FAR_LINE = 2.5  # spreads: lines farther off count less
_LINE_ROUNDS = 4


class Lines:
    """Lines of an outline with N points.

    Args:
        names: Name of the line of each point, (N, k).
        place: Place of each point along it, from and to the same distance of 0.5, (N,).
        shift: How far blur and shading may shift all lines alike, px.

    Attributes:
        which: Number of the line of each point, (N,).
        place: Place of each point on its line, -1 to 1, (N,).
        number: Number of lines.
        columns: What one px of each shift, of each turn and of the common shift adds, (N, m).
    """

    def __init__(self, names: NDArray[np.int_], place: Numbers, shift: float) -> None:
        self.which = np.unique(names, axis=0, return_inverse=True)[1].ravel()
        self.number, self._shift = int(self.which.max()) + 1, shift
        spans = [np.ptp(place[self.which == line]) for line in range(self.number)]
        self.place = (2.0 * place - 1.0) / np.array(spans)[self.which]
        on_line = np.eye(self.number)[self.which]
        common = np.ones((len(place), 1))
        self.columns = np.hstack([on_line, on_line * self.place[:, None], common])

    def errors(
        self, offset: Numbers, robust: float, strength: Numbers | float = 1.0
    ) -> tuple[Numbers, Numbers]:
        """Fit a shift and a turn to each line, by reweighted least squares.

        Args:
            offset: Distance of each edge from the outline, px, (N,); NaN if there is none.
            robust: Distance from the line beyond which an edge counts less, px.
            strength: Strengths of the edges (`Edges`), by whose square they count, (N,).

        Returns:
            Shift and turn, px, (number, 2), NaN for lines of few edges; offsets less these, (N,).
        """
        is_edge, x = np.isfinite(offset), self.place
        value = np.where(is_edge, offset, 0.0)
        is_fitted = np.bincount(self.which, is_edge, self.number) >= _MIN_POINTS
        lines = [value[is_edge & (self.which == line)] for line in range(self.number)]
        shift = np.array([np.median(values) if len(values) else 0.0 for values in lines])
        turn = np.zeros(self.number)
        left = value - shift[self.which]
        for _ in range(_LINE_ROUNDS):
            weight = is_edge * strength**2 / (1.0 + (left / robust) ** 2)
            terms = (weight, weight * x, weight * x**2, weight * value, weight * x * value)
            w, wx, wxx, wy, wxy = (np.bincount(self.which, term, self.number) for term in terms)
            determinant = np.maximum(w * (wxx + 1e-9) - wx**2, 1e-12)
            shift = np.where(is_fitted, ((wxx + 1e-9) * wy - wx * wxy) / determinant, shift)
            turn = np.where(is_fitted, (w * wxy - wx * wy) / determinant, 0.0)
            left = value - shift[self.which] - turn[self.which] * x
        errors = np.where(is_fitted, [shift, turn], np.nan).T
        return errors, np.where(is_edge, left, np.nan)

    def spreads(self, errors: Numbers, fitted: int | None) -> Numbers:
        """Return the spreads of all columns, px, (m,).

        Args:
            errors: Shifts and turns of the lines, (number, 2).
            fitted: How many unknowns were fitted to the lines, which makes their errors look
                small; None in first rounds, whose errors say little about the lines.
        """
        apart, finite = np.abs(from_median(errors)), np.isfinite(errors[:, 0]).sum()
        typical = np.array(_FIRST_SPREAD)
        if fitted is not None and finite:
            freedom = max(0.25, 1.0 - fitted / (2 * finite))
            typical = 1.4826 * np.nanmedian(apart, axis=0) / np.sqrt(freedom)
            typical = np.clip(typical, _MIN_SPREAD, _MAX_SPREAD)
        spread = np.hypot(typical, np.nan_to_num(apart, nan=_MAX_SPREAD) / _FAR_LINE)
        return np.append(spread.T, self._shift)


def median_shift(errors: Numbers) -> float:
    """Return the median shift of all lines, px."""
    finite = errors[np.isfinite(errors[:, 0]), 0]  # none where a start lies beside the tube
    return float(np.median(finite)) if len(finite) else 0.0


def from_median(errors: Numbers) -> Numbers:
    """Return shifts and turns of lines, (number, 2), with the shifts from their median."""
    return errors - np.array([median_shift(errors), 0.0])
