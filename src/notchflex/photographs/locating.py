"""Finding a robot in a photograph: many starts, small first, then the few best in full."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from notchflex.photographs.board.ruler import RulerReading
from notchflex.photographs.chain.axis_points import BASE, axis_points, on_axis_points
from notchflex.photographs.chain.camera import NUMBERS
from notchflex.photographs.chain.chain_table import ChainTable, Numbers
from notchflex.photographs.chain.outline import OutlineModel
from notchflex.photographs.contrast import Contrast
from notchflex.photographs.fitting import Fit, cost, covariance, misfit, refine
from notchflex.photographs.missing import MAX_RESIDUAL, missing
from notchflex.photographs.start import COARSE, reversed_view, starts, with_tilts

_COARSE_WIDTH = 40.0  # of the tube in the first fits, px
_FINE_WIDTH = 100.0  # of the tube in the last fits, px: edges of sharp photographs are then sharp
_COARSE_REACHES = [14.0, 14, 12, 12, 10, 10, 8, 8, 6, 6, 5, 4, 4]
_FINE_REACHES = [8.0, 8, 6, 6, 5, 5, 4, 4]
_LAST_REACHES = [5.0, 5.0] + 10 * [4.0]
_KEPT = 4
_WORSE = 0.1  # by how much the cost of a fit may be higher than the best and be looked into
_TILT = 0.06
_VIEWS = np.radians([[0.0, 6.0], [0.0, -6.0], [8.0, 0.0], [-8.0, 0.0]])
"""Roll and tilt by which the view of the best fit is turned: fits end in the wrong one at times."""
EDGE_NOISE = 0.08
"""No edge is known better, px."""

_MOVES = 2
"""So often chains are moved along themselves where parts of the robot are missing."""

_SAME = math.radians(1.5)


class Located(NamedTuple):
    """The best fit of a robot, its model, and how all fits differ from it.

    Attributes:
        fit: The best.
        model: The outline that was fitted.
        rival: By how much more every fit misses the edges (`misfit`), with the largest difference
            of its angles from those of the best, rad.
        factor: By how much the photograph was made smaller for it.
    """

    fit: Fit
    model: OutlineModel
    rival: tuple[tuple[float, float], ...]
    factor: float


def locate(
    table: ChainTable, contrast: Contrast, reading: RulerReading, given: Sequence[Numbers] = ()
) -> Located | None:
    """Find a robot in a photograph; None if nothing there looks like a tube of its proportions.

    Args:
        table: The robot.
        contrast: Contrast of the photograph.
        reading: What is known of its scale and tilt.
        given: Numbers from which fits are started; if there are none, starts are searched.
    """
    height, width = contrast.value.shape
    middle = np.array([width - 1.0, height - 1.0]) / 2.0
    factor = min(1.0, COARSE / max(width, height))
    coarse = [*given, *_coarse(table, contrast, factor, middle, given)]
    if not coarse:
        return None
    # Where both ends look the same, a chain from tip to base fits nearly as well.
    coarse += on_axis_points(table, axis_points(table, coarse[0])[::-1])[:1]
    wide = 2.0 * table.outer * math.exp(coarse[0][3])
    fine = min(1.0, _FINE_WIDTH / wide)
    view_prior = reading.prior(coarse[0][:2] + middle).smaller(fine)
    contrast, middle = contrast.reduced(fine), (middle + 0.5) * fine - 0.5
    model = OutlineModel(table, base=BASE * table.outer, prior=view_prior)
    fits = _fine(model, contrast, middle, [_scaled(numbers, fine) for numbers in coarse])
    latest = fits
    for _ in range(_MOVES):
        if all(missing(model, fit) for fit in fits):
            near = min(latest, key=lambda fit: cost(fit, model))
            latest = _slipped(model, contrast, near, middle)
            fits += latest
    whole = [fit for fit in fits if not missing(model, fit)] or fits
    first = min(whole, key=lambda fit: cost(fit, model))
    noise = max(EDGE_NOISE, covariance(first, model)[1])
    best = min(whole, key=lambda fit: misfit(fit, model, noise))
    turned = _turned(model, contrast, best, middle)
    whole += [fit for fit in turned if not missing(model, fit)]
    misfits = [misfit(fit, model, noise) for fit in whole]
    least = min(misfits)
    best = whole[misfits.index(least)]
    rivals = [
        (one - least, _differ(best.numbers, fit.numbers))
        for one, fit in zip(misfits, whole, strict=True)
    ]
    return Located(best, model, tuple(rivals), fine)


def _turned(model: OutlineModel, contrast: Contrast, fit: Fit, middle: Numbers) -> list[Fit]:
    """Fit again from views that are turned a little."""
    views = fit.numbers + np.zeros((len(_VIEWS), 1))
    views[:, 4:6] += _VIEWS
    return [refine(model, contrast, one, _LAST_REACHES, middle, MAX_RESIDUAL) for one in views]


def _slipped(model: OutlineModel, contrast: Contrast, fit: Fit, middle: Numbers) -> list[Fit]:
    """Fit again from chains that lie one pitch nearer to the tip or the base, and the other way.

    Where a ring looks like the background, a fit may end a ring beside its place, or at the base.
    """
    table, scale = model.table, math.exp(fit.numbers[3])
    points, height = axis_points(table, fit.numbers), scale * float(table.height.mean())
    pitch = scale * table.length / table.notches
    side, fits = math.cos(fit.numbers[4]), []
    # The ends of bodies are their starts as seen from the tip, where notches lie on the other side.
    for chain, way, hand in (
        (points, pitch, side),
        (points, -pitch, side),
        (points[::-1], -height, -side),
    ):
        both = on_axis_points(table, _moved(chain, way))
        numbers = next(one for one in both if hand * math.cos(one[4]) > 0.0)
        quick = refine(model, contrast, numbers, _FINE_REACHES, middle, MAX_RESIDUAL, quick=True)
        fits.append(refine(model, contrast, quick.numbers, _LAST_REACHES, middle, MAX_RESIDUAL))
    return fits


def _moved(points: Numbers, way: float) -> Numbers:
    """Return points farther along their line, which continues straight at both ends, px."""
    ends = [2.0 * points[:1] - points[1:2], 2.0 * points[-1:] - points[-2:-1]]
    line = np.vstack([ends[0], points, ends[1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return np.stack([np.interp(along[1:-1] + way, along, one) for one in line.T], axis=1)


def _fine(
    model: OutlineModel, contrast: Contrast, middle: Numbers, coarse: list[Numbers]
) -> list[Fit]:
    """Fit in full from the best of some starts, each tilted to and away from the camera."""
    quick = [
        min(
            (
                refine(model, contrast, start, _FINE_REACHES, middle, MAX_RESIDUAL, quick=True)
                for start in with_tilts(numbers, _TILT)
            ),
            key=lambda fit: cost(fit, model),
        )
        for numbers in coarse
    ]
    limit = min(cost(fit, model) for fit in quick) + _WORSE
    near = [fit.numbers for fit in quick if cost(fit, model) < limit or not missing(model, fit)]
    if all(missing(model, fit) for fit in quick):
        near = [fit.numbers for fit in quick]
    return [
        refine(model, contrast, start, _LAST_REACHES, middle, MAX_RESIDUAL)
        for numbers in near
        for start in (numbers, reversed_view(numbers))
    ]


def _coarse(
    table: ChainTable,
    contrast: Contrast,
    factor: float,
    middle: Numbers,
    given: Sequence[Numbers],
) -> list[Numbers]:
    model = OutlineModel(table, 8, 6, base=BASE * table.outer)
    candidates: list[tuple[float, Numbers]] = []
    low = contrast.reduced(factor)
    low_middle = (middle + 0.5) * factor - 0.5
    images: dict[float, Contrast] = {}
    first = [_scaled(numbers, factor) for numbers in given]
    for start in first or starts(table, low, low_middle):
        wide = 2.0 * table.outer * math.exp(start[3]) / factor
        rough = min(1.0, _COARSE_WIDTH / wide)
        rough = min(1.0, 2.0 ** (round(2.0 * math.log2(rough)) / 2.0))
        image = images.setdefault(rough, contrast.reduced(rough))
        numbers = _scaled(start, rough / factor)
        fit = refine(
            model,
            image,
            numbers,
            _COARSE_REACHES,
            (middle + 0.5) * rough - 0.5,
            MAX_RESIDUAL,
            quick=True,
        )
        candidates.append((cost(fit, model), _scaled(fit.numbers, 1.0 / rough)))
    candidates.sort(key=lambda one: one[0])
    kept: list[Numbers] = []
    for _, numbers in candidates:
        if all(_differ(numbers, other) > _SAME for other in kept):
            kept.append(numbers)
    return kept[:_KEPT]


def _scaled(numbers: Numbers, factor: float) -> Numbers:
    scaled = numbers.copy()
    scaled[:2] *= factor
    scaled[3] += math.log(factor)
    return scaled


def _differ(one: Numbers, other: Numbers) -> float:
    """Return by how much angles differ, rad: toward the same side of the photograph."""
    shapes = [np.sign(math.cos(numbers[4])) * numbers[NUMBERS:] for numbers in (one, other)]
    apart = float(np.abs(shapes[0] - shapes[1]).max())
    return apart if math.cos(one[4]) * math.cos(other[4]) > 0.0 else max(apart, 2.0 * _SAME)
