"""Finding a robot in a photograph: many starts, small first, then the few best in full."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from notchflex.photographs.camera import NUMBERS
from notchflex.photographs.chain_table import ChainTable, Numbers
from notchflex.photographs.edges import Contrast
from notchflex.photographs.fitting import Fit, refine
from notchflex.photographs.judging import missing
from notchflex.photographs.outline import OutlineModel, axis_points, on_axis_points
from notchflex.photographs.sighting import RulerReading

COARSE = 360
"""Longer side of the photograph in which robots are searched, px."""

_CLOSINGS = (2, 4, 7, 11, 16)
_BIN = 2.0
_BREAK = 5  # bins: shorter breaks, by highlights, do not end a stretch
_SHORTEST = 0.6  # of the length of the robot: its centre line is cut short on the inside of a bend
_MAX_PARTS = 4
_MIN_WIDTH = 3.0
_SLIPS = (0.0, -0.4, -0.8, 0.4)
"""How far the robot may lie from where the ribbon ends, pitches toward the base."""
_WIDTHS = np.geomspace(_MIN_WIDTH, 0.3 * COARSE, 34)


class Ribbon(NamedTuple):
    """A stretch of constant width, from its free end on.

    Attributes:
        centre: Points of its centre line, px, (p, 2).
        width: Its width, px.
        quality: How constant its width is, 0 to 1.
    """

    centre: Numbers
    width: float
    quality: float


def starts(table: ChainTable, contrast: Contrast) -> list[Numbers]:
    """Return numbers from which fits are started, the most likely first.

    Args:
        table: The robot.
        contrast: Contrast of the photograph, made smaller to `COARSE` px.
    """
    different: list[Ribbon] = []  # in their free end or their width
    for ribbon in sorted(_ribbons(table, contrast), key=lambda ribbon: -ribbon.quality):
        if all(
            np.linalg.norm(ribbon.centre[0] - kept.centre[0]) > ribbon.width
            or abs(math.log(ribbon.width / kept.width)) > 0.15
            for kept in different
        ):
            different.append(ribbon)
    views = [
        _numbers(table, ribbon, side, slip, contrast.middle)
        for ribbon, side, slip in itertools.product(different[:3], (1.0, -1.0), _SLIPS)
    ]
    return [numbers for numbers in views if numbers is not None]


def _ribbons(table: ChainTable, contrast: Contrast) -> Iterator[Ribbon]:
    import cv2

    mask = (contrast.value > contrast.threshold).astype(np.uint8)
    for radius in _CLOSINGS:
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
        closed: Any = cv2.morphologyEx(np.pad(mask, radius + 1), cv2.MORPH_CLOSE, disc)
        closed = closed[radius + 1 : -radius - 1, radius + 1 : -radius - 1]
        count, labels, stats, _ = cv2.connectedComponentsWithStats(closed, connectivity=4)
        by_area = np.argsort(-stats[1:count, cv2.CC_STAT_AREA])[:_MAX_PARTS] + 1
        for label in by_area:
            if stats[label, cv2.CC_STAT_AREA] < 60:
                continue
            for levels in _levels(labels == label):
                yield from _stretches(table, *levels)


def _levels(part: NDArray[np.bool_]) -> Iterator[tuple[Numbers, Numbers]]:
    """Yield centres and widths of a connected part along it, from each of its two ends."""
    rows, columns = np.nonzero(part)
    count = len(rows)
    number = np.full(part.shape, -1)
    number[rows, columns] = np.arange(count)
    ends: list[NDArray[np.int_]] = []
    lengths: list[Numbers] = []
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        y, x = rows + dy, columns + dx
        is_inside = (y < part.shape[0]) & (x >= 0) & (x < part.shape[1])
        near = np.where(is_inside, number[np.minimum(y, part.shape[0] - 1), x % part.shape[1]], -1)
        has = near >= 0
        ends.append(np.stack([np.nonzero(has)[0], near[has]]))
        lengths.append(np.full(int(has.sum()), math.hypot(dx, dy)))
    pairs = np.concatenate(ends, axis=1)
    graph = coo_matrix((np.concatenate(lengths), (pairs[0], pairs[1])), (count, count)).tocsr()

    def far(source: int) -> Numbers:
        return dijkstra(graph, directed=False, indices=source)

    first = int(far(0).argmax())
    from_first = far(first)
    second = int(from_first.argmax())
    for distance in (from_first, far(second)):
        bins = (distance / _BIN).astype(int)
        area = np.bincount(bins)
        centre = np.stack(
            [np.bincount(bins, place) / np.maximum(area, 1) for place in (columns, rows)], axis=1
        )
        yield centre, area / _BIN


def _stretches(table: ChainTable, centre: Numbers, width: Numbers) -> Iterator[Ribbon]:
    """Yield the stretches of constant width that are long enough for the robot."""
    ratio = table.length / (2.0 * table.outer)
    for wanted in _WIDTHS:
        fits = (width > 0.6 * wanted) & (width < 1.35 * wanted)
        fits = binary_closing(fits, np.ones(_BREAK), border_value=0) | fits
        changes = np.flatnonzero(np.diff(np.concatenate([[0], fits.astype(int), [0]])))
        for begin, end in zip(changes[::2], changes[1::2], strict=True):
            if (end - begin) * _BIN < _SHORTEST * wanted * ratio:
                continue
            usual = float(np.percentile(width[begin:end], 55))
            if not 0.94 < usual / wanted < 1.07:
                continue
            long = min(end - begin, round(1.1 * usual * ratio / _BIN))
            even = np.abs(width[begin : begin + long] / usual - 1.0) < 0.12
            yield Ribbon(centre[begin:end], usual, float(even.mean()))


def _numbers(
    table: ChainTable, ribbon: Ribbon, side: float, slip: float, middle: Numbers
) -> Numbers | None:
    """Return the numbers of a robot along a ribbon (from the tip on), slipped toward the base.

    The slip is in pitches; `side` is 1 if the first notch is cut on the right from base to tip.
    """
    scale = ribbon.width / (2.0 * table.outer)
    centre = ribbon.centre[1:]
    if len(centre) < 6:
        return None
    smooth = _smoothed(centre, max(2, round(0.5 * ribbon.width / _BIN)))
    step = np.diff(smooth, axis=0)
    heading = np.unwrap(np.arctan2(-step[:, 1], -step[:, 0]))  # toward the tip
    length = np.cumsum(np.linalg.norm(step, axis=1)) / scale + 0.15 * ribbon.width / scale
    turned = side * (heading[0] - heading)  # toward the side of the notches, from here to the tip
    neutral = length + 0.8 * table.outer * turned
    neutral -= slip * table.length / table.notches
    neutral = np.maximum.accumulate(neutral) + 1e-9 * np.arange(len(neutral))
    ends = table.length - np.concatenate([[0.0], np.cumsum(table.height + table.uncut)])
    behind = np.concatenate([[ends[0] + 0.3 * table.outer], ends[1:] + 0.5 * table.uncut])
    directions = np.interp(behind, neutral, heading)
    angles = side * np.diff(directions) * table.side
    position = np.array([np.interp(ends[0], neutral, smooth[1:, axis]) for axis in (0, 1)])
    over = ends[0] - neutral[-1]
    if over > 0.0:
        position = position - over * scale * np.array(
            [math.cos(directions[0]), math.sin(directions[0])]
        )
    if over > 0.4 * table.length:
        return None
    roll = math.radians(5.0) if side > 0.0 else math.pi + math.radians(5.0)
    view = [
        *(position - middle),
        directions[0],
        math.log(scale),
        roll,
        0.0,
        0.003 / table.outer,
        0.0,
        0.0,
    ]
    return np.array([*view, *np.clip(angles, -0.3, 1.6)])


def _smoothed(points: Numbers, half: int) -> Numbers:
    if len(points) <= half + 1:
        return points
    before = 2.0 * points[0] - points[half:0:-1]
    after = 2.0 * points[-1] - points[-2 : -half - 2 : -1]
    padded = np.concatenate([before, points, after])
    kernel = np.ones(2 * half + 1) / (2 * half + 1)
    return np.stack([np.convolve(padded[:, axis], kernel, "valid") for axis in (0, 1)], axis=1)


def reversed_view(numbers: Numbers) -> Numbers:
    """Return the view that looks the same from far away: opposite roll and tilt."""
    turned = numbers.copy()
    turn = math.pi if math.cos(turned[4]) < 0.0 else 0.0
    turned[4], turned[5] = 2.0 * turn - turned[4], -turned[5]
    return turned


def scaled(numbers: Numbers, factor: float) -> Numbers:
    """Return the view in a photograph that was made smaller."""
    smaller = numbers.copy()
    smaller[:2] *= factor
    smaller[3] += math.log(factor)
    return smaller


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
    """The best fit of a robot, and how all fits differ from it.

    Attributes:
        fit: The best.
        rivals: By how much more every fit misses the edges (`misfit`), with the largest difference
            of its angles from those of the best, rad.
        factor: By how much the photograph was made smaller for it.
    """

    fit: Fit
    rivals: tuple[tuple[float, float], ...]
    factor: float


def locate(
    table: ChainTable, contrast: Contrast, reading: RulerReading, chain: Numbers | None = None
) -> Located | None:
    """Find a robot in a photograph; None if nothing there looks like a tube of its proportions.

    Args:
        table: The robot.
        contrast: Contrast of the photograph.
        reading: What is known of its scale and tilt.
        chain: Points of the tube axis from which fits are started, px from the middle, (n + 2, 2);
            without them starts are searched.
    """
    by_hand = [] if chain is None else on_axis_points(table, chain)
    coarse = [*by_hand, *_coarse(table, contrast, by_hand)]
    if not coarse:
        return None
    # Where both ends look the same, a chain from tip to base fits nearly as well.
    coarse += on_axis_points(table, axis_points(table, coarse[0])[::-1])[:1]
    fine = min(1.0, _FINE_WIDTH / (2.0 * table.outer * math.exp(coarse[0][3])))
    view_prior = reading.prior(coarse[0][:2] + contrast.middle).smaller(fine)
    contrast, model = contrast.reduced(fine), OutlineModel(table, prior=view_prior)
    fits = _fine(model, contrast, [scaled(numbers, fine) for numbers in coarse])
    latest = fits
    for _ in range(_MOVES):
        if all(map(missing, fits)):
            latest = _slipped(contrast, min(latest, key=lambda fit: fit.cost))
            fits += latest
    whole = [fit for fit in fits if not missing(fit)] or fits
    noise = max(EDGE_NOISE, min(whole, key=lambda fit: fit.cost).noise)
    best = min(whole, key=lambda fit: fit.misfit(noise))
    # Fitted again from views that are turned a little.
    views = best.numbers + np.zeros((len(_VIEWS), 1))
    views[:, 4:6] += _VIEWS
    turned = [refine(model, contrast, view, _LAST_REACHES) for view in views]
    whole += [fit for fit in turned if not missing(fit)]
    misfits = [fit.misfit(noise) for fit in whole]
    least = min(misfits)
    best = whole[misfits.index(least)]
    rivals = [
        (more - least, _differ(best.numbers, fit.numbers))
        for more, fit in zip(misfits, whole, strict=True)
    ]
    return Located(best, tuple(rivals), fine)


def _slipped(contrast: Contrast, fit: Fit) -> list[Fit]:
    """Fit again from chains that lie one pitch nearer to the tip or the base, and the other way.

    Where a ring looks like the background, a fit may end a ring beside its place, or at the base.
    """
    model, table, scale = fit.model, fit.model.table, math.exp(fit.numbers[3])
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
        numbers = next(view for view in both if hand * math.cos(view[4]) > 0.0)
        quick = refine(model, contrast, numbers, _FINE_REACHES, quick=True)
        fits.append(refine(model, contrast, quick.numbers, _LAST_REACHES))
    return fits


def _moved(points: Numbers, way: float) -> Numbers:
    """Return points farther along their line, which continues straight at both ends, px."""
    ends = [2.0 * points[:1] - points[1:2], 2.0 * points[-1:] - points[-2:-1]]
    line = np.vstack([ends[0], points, ends[1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return np.stack([np.interp(along[1:-1] + way, along, axis) for axis in line.T], axis=1)


def _fine(model: OutlineModel, contrast: Contrast, coarse: list[Numbers]) -> list[Fit]:
    """Fit in full from the best of some starts, each tilted to and away from the camera."""
    quick: list[Fit] = []
    for numbers in coarse:
        tilted = np.tile(numbers, (2, 1))
        tilted[:, 5] = _TILT, -_TILT
        fits = [refine(model, contrast, view, _FINE_REACHES, quick=True) for view in tilted]
        quick.append(min(fits, key=lambda fit: fit.cost))
    limit = min(fit.cost for fit in quick) + _WORSE
    whole = [not missing(fit) for fit in quick]
    near = [
        fit.numbers
        for fit, is_whole in zip(quick, whole, strict=True)
        if fit.cost < limit or is_whole or not any(whole)
    ]
    return [
        refine(model, contrast, view, _LAST_REACHES)
        for numbers in near
        for view in (numbers, reversed_view(numbers))
    ]


def _coarse(table: ChainTable, contrast: Contrast, by_hand: Sequence[Numbers]) -> list[Numbers]:
    """Return the best views that differ, fitted in a small photograph from many starts."""
    model = OutlineModel(table, 8, 6)
    factor = min(1.0, COARSE / max(contrast.value.shape))
    views = by_hand
    if not views:
        ribbons = starts(table, contrast.reduced(factor))
        views = [scaled(numbers, 1.0 / factor) for numbers in ribbons]
    fits: list[tuple[float, Numbers]] = []
    images: dict[float, Contrast] = {}
    for start in views:
        rough = min(1.0, _COARSE_WIDTH / (2.0 * table.outer * math.exp(start[3])))
        rough = min(1.0, 2.0 ** (round(2.0 * math.log2(rough)) / 2.0))
        image = images.setdefault(rough, contrast.reduced(rough))
        fit = refine(model, image, scaled(start, rough), _COARSE_REACHES, quick=True)
        fits.append((fit.cost, scaled(fit.numbers, 1.0 / rough)))
    kept: list[Numbers] = []
    for _, numbers in sorted(fits, key=lambda fit: fit[0]):
        if all(_differ(numbers, view) > _SAME for view in kept):
            kept.append(numbers)
    return kept[:_KEPT]


def _differ(first: Numbers, second: Numbers) -> float:
    """Return by how much angles differ, rad: toward the same side of the photograph."""
    shapes = [np.sign(math.cos(numbers[4])) * numbers[NUMBERS:] for numbers in (first, second)]
    apart = float(np.abs(shapes[0] - shapes[1]).max())
    return apart if math.cos(first[4]) * math.cos(second[4]) > 0.0 else max(apart, 2.0 * _SAME)
