"""Finding a robot in a photograph: many starts, small first, then the few best in full."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, uniform_filter1d
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from notchflex.photographs.edges import Contrast, Numbers
from notchflex.photographs.fitting import Fit, missing, refine
from notchflex.photographs.outline import (
    NUMBERS,
    OutlineModel,
    PlanarRobot,
    ViewPrior,
    axis_points,
    on_axis_points,
    start_numbers,
)

COARSE = 360
"""Longer side of the photograph in which robots are searched, px."""

_CLOSINGS = (2, 4, 7, 11, 16)
_BIN = 2.0
_BREAK = 5  # bins: shorter breaks, by highlights, do not end a stretch
_LEAST_POINTS = 7  # of a centre line
_SHORTEST = 0.6  # of the length of the robot: its centre line is cut short on the inside of a bend
_MAX_PARTS, _MIN_AREA = 4, 60  # px: parts of a photograph that are searched
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


def starts(planar: PlanarRobot, contrast: Contrast) -> list[Numbers]:
    """Return numbers from which fits are started, the most likely first."""
    different: list[Ribbon] = []  # in their free end or their width
    small = contrast.reduced(COARSE / contrast.size.max())
    for ribbon in sorted(_ribbons(planar, small), key=lambda ribbon: -ribbon.quality):
        if all(
            np.linalg.norm(ribbon.centre[0] - kept.centre[0]) > ribbon.width
            or abs(math.log(ribbon.width / kept.width)) > 0.15
            for kept in different
        ):
            different.append(ribbon)
    views = [
        _along(planar, ribbon, side, slip, small)
        for ribbon, side, slip in itertools.product(different[:3], (1.0, -1.0), _SLIPS)
    ]
    return [numbers for numbers in views if numbers is not None]


def _ribbons(planar: PlanarRobot, contrast: Contrast) -> Iterator[Ribbon]:
    import cv2

    mask = (contrast.value > contrast.threshold).astype(np.uint8)
    for radius in _CLOSINGS:
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
        closed: Any = cv2.morphologyEx(np.pad(mask, radius + 1), cv2.MORPH_CLOSE, disc)
        closed = closed[radius + 1 : -radius - 1, radius + 1 : -radius - 1]
        count, labels, stats, _ = cv2.connectedComponentsWithStats(closed, connectivity=4)
        by_area = np.argsort(-stats[1:count, cv2.CC_STAT_AREA])[:_MAX_PARTS] + 1
        for label in by_area:
            if stats[label, cv2.CC_STAT_AREA] >= _MIN_AREA:
                for levels in _levels(labels == label):
                    yield from _stretches(planar, *levels)


def _levels(part: NDArray[np.bool_]) -> Iterator[tuple[Numbers, Numbers]]:
    """Yield centres and widths of a connected part along it, from each of its two ends."""
    place = np.argwhere(part)
    number = np.full(np.add(part.shape, 2), -1)  # with a border, beyond which nothing lies
    number[tuple(place.T + 1)] = np.arange(len(place))
    graph = coo_matrix((len(place), len(place))).tocsr()
    for step in ((0, 1), (1, 0), (1, 1), (1, -1)):
        pairs = np.stack([number, np.roll(number, np.negative(step), (0, 1))]).reshape(2, -1)
        pairs = pairs[:, (pairs >= 0).all(axis=0)]
        length = np.full(pairs.shape[1], math.hypot(*step))
        graph += coo_matrix((length, pairs), graph.shape).tocsr()

    def distances(source: int) -> Numbers:
        return dijkstra(graph, directed=False, indices=source)

    from_first = distances(int(distances(0).argmax()))
    for distance in (from_first, distances(int(from_first.argmax()))):
        bins = (distance / _BIN).astype(int)
        area = np.bincount(bins)
        centre = [np.bincount(bins, along) / np.maximum(area, 1) for along in place.T[::-1]]
        yield np.stack(centre, axis=1), area / _BIN


def _stretches(planar: PlanarRobot, centre: Numbers, width: Numbers) -> Iterator[Ribbon]:
    """Yield the stretches of constant width that are long enough for the robot."""
    ratio = planar.length / (2.0 * planar.outer)
    for wanted in _WIDTHS:
        fits = (width > 0.6 * wanted) & (width < 1.35 * wanted)
        fits = binary_closing(fits, np.ones(_BREAK), border_value=0) | fits
        changes = np.flatnonzero(np.diff(fits.astype(int), prepend=0, append=0))
        for begin, end in changes.reshape(-1, 2):
            if (end - begin) * _BIN < _SHORTEST * wanted * ratio:
                continue
            usual = float(np.percentile(width[begin:end], 55))
            if 0.94 < usual / wanted < 1.07:
                long = min(end - begin, round(1.1 * usual * ratio / _BIN))
                even = np.abs(width[begin : begin + long] / usual - 1.0) < 0.12
                yield Ribbon(centre[begin:end], usual, float(even.mean()))


def _along(
    planar: PlanarRobot, ribbon: Ribbon, side: float, slip: float, contrast: Contrast
) -> Numbers | None:
    """Return the numbers of a robot along a ribbon (from the tip on), slipped toward the base.

    The slip is in pitches; `side` is 1 if the first notch is cut on the right from base to tip.
    """
    scale = ribbon.width / (2.0 * planar.outer)
    half = max(2, round(0.5 * ribbon.width / _BIN))
    if len(ribbon.centre) < _LEAST_POINTS:
        return None
    padded = np.pad(ribbon.centre[1:], ((half, half), (0, 0)), "reflect", reflect_type="odd")
    smooth = uniform_filter1d(padded, 2 * half + 1, axis=0)[half:-half]
    step = np.diff(smooth, axis=0)
    heading = np.unwrap(np.arctan2(-step[:, 1], -step[:, 0]))  # toward the tip
    length = np.cumsum(np.linalg.norm(step, axis=1)) / scale + 0.15 * ribbon.width / scale
    turned = side * (heading[0] - heading)  # toward the side of the notches, from here to the tip
    neutral = length + 0.8 * planar.outer * turned - slip * planar.length / planar.notches
    neutral = np.maximum.accumulate(neutral) + 1e-9 * np.arange(len(neutral))
    pitches = np.cumsum(planar.height + planar.uncut)
    first, ends = planar.length, planar.length - pitches
    behind = np.array([first + 0.3 * planar.outer, *(ends + 0.5 * planar.uncut)])
    directions = np.interp(behind, neutral, heading)
    over = max(0.0, first - neutral[-1])
    if over > 0.4 * planar.length:
        return None
    position = np.array([np.interp(first, neutral, along) for along in smooth[1:].T])
    position -= over * scale * np.array([math.cos(directions[0]), math.sin(directions[0])])
    angles = np.clip(side * np.diff(directions) * planar.side, -0.3, 1.6)
    place = (position - contrast.middle) / contrast.factor
    log_scale = math.log(scale / contrast.factor)
    return start_numbers(planar, place, directions[0], log_scale, side, angles)


def reversed_view(numbers: Numbers) -> Numbers:
    """Return the view that looks the same from far away: opposite roll and tilt."""
    turned = numbers.copy()
    turn = math.pi if math.cos(turned[4]) < 0.0 else 0.0
    turned[4], turned[5] = 2.0 * turn - turned[4], -turned[5]
    return turned


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
        contrast: Contrast of the whole photograph.
    """

    fit: Fit
    rivals: list[tuple[float, float]]
    contrast: Contrast


def locate(
    planar: PlanarRobot,
    contrast: Contrast,
    prior: Callable[[Numbers], ViewPrior],
    chain: Numbers | None = None,
) -> Located | str:
    """Find a robot in a photograph; return why not if it is not found.

    Args:
        planar: The robot.
        contrast: Contrast of the photograph.
        prior: What is known of the view of a robot at a position, px from the middle.
        chain: Points of the tube axis from which fits are started, px from the middle, (n + 2, 2);
            without them starts are searched.
    """
    by_hand = [] if chain is None else on_axis_points(planar, chain)
    coarse = by_hand + _coarse(planar, contrast, by_hand or starts(planar, contrast))
    if not coarse:
        return "no tube of the proportions of the robot is seen"
    # Where both ends look the same, a chain from tip to base fits nearly as well.
    coarse += on_axis_points(planar, axis_points(planar, coarse[0])[::-1])[:1]
    model = OutlineModel(planar, prior=prior(coarse[0][:2]))
    fine = contrast.reduced(_FINE_WIDTH / planar.width(coarse[0]))
    fits = latest = _fine(model, fine, coarse)
    for _ in range(_MOVES):
        if all(map(missing, fits)):
            latest = _slipped(min(latest, key=lambda fit: fit.cost))
            fits = fits + latest
    # Of fits that all miss parts, those beside the photograph miss the fewest edges.
    whole = [fit for fit in fits if not missing(fit)] or [max(fits, key=lambda fit: fit.score)]
    noise = max(EDGE_NOISE, min(whole, key=lambda fit: fit.cost).noise)
    best = min(whole, key=lambda fit: fit.misfit(noise))
    # Fitted again from views that are turned a little.
    views = np.tile(best.numbers, (len(_VIEWS), 1))
    views[:, 4:6] += _VIEWS
    turned = [refine(model, fine, view, _LAST_REACHES) for view in views]
    whole += [fit for fit in turned if not missing(fit)]
    misfits = [fit.misfit(noise) for fit in whole]
    least = min(misfits)
    best = whole[misfits.index(least)]
    differences = [_differ(best.numbers, fit.numbers) for fit in whole]
    return Located(best, [*zip(np.subtract(misfits, least), differences, strict=True)], contrast)


def _slipped(fit: Fit) -> list[Fit]:
    """Fit again from chains that lie one pitch nearer to the tip or the base, and the other way.

    Where a ring looks like the background, a fit may end a ring beside its place, or at the base.
    """
    planar, scale = fit.model.planar, math.exp(fit.numbers[3])
    points, height = axis_points(planar, fit.numbers), scale * float(planar.height.mean())
    pitch = scale * planar.length / planar.notches
    side, fits = math.cos(fit.numbers[4]), []
    # The ends of bodies are their starts as seen from the tip, where notches lie on the other side.
    for chain, way, hand in (
        (points, pitch, side),
        (points, -pitch, side),
        (points[::-1], -height, -side),
    ):
        # Farther along their line, which continues straight at both ends.
        line = np.pad(chain, ((1, 1), (0, 0)), "reflect", reflect_type="odd")
        along = np.cumsum(np.linalg.norm(np.diff(line, axis=0, prepend=line[:1]), axis=1))
        moved = [np.interp(along[1:-1] + way, along, coordinate) for coordinate in line.T]
        both = on_axis_points(planar, np.stack(moved, axis=1))
        numbers = next(view for view in both if hand * math.cos(view[4]) > 0.0)
        quick = refine(fit.model, fit.contrast, numbers, _FINE_REACHES, quick=True)
        fits.append(refine(fit.model, fit.contrast, quick.numbers, _LAST_REACHES))
    return fits


def _fine(model: OutlineModel, contrast: Contrast, coarse: list[Numbers]) -> list[Fit]:
    """Fit in full from the best of some starts, each tilted to and away from the camera."""
    quick: list[Fit] = []
    for numbers in coarse:
        tilted = np.tile(numbers, (2, 1))
        tilted[:, 5] = _TILT, -_TILT
        fits = [refine(model, contrast, view, _FINE_REACHES, quick=True) for view in tilted]
        quick.append(min(fits, key=lambda fit: fit.cost))
    limit = min(fit.cost for fit in quick) + _WORSE
    whole = [fit for fit in quick if not missing(fit)] or quick
    near = [fit.numbers for fit in quick if fit.cost < limit or fit in whole]
    return [
        refine(model, contrast, view, _LAST_REACHES)
        for numbers in near
        for view in (numbers, reversed_view(numbers))
    ]


def _coarse(planar: PlanarRobot, contrast: Contrast, views: list[Numbers]) -> list[Numbers]:
    """Return the best views that differ, fitted in small photographs from many starts."""
    model, fits = OutlineModel(planar, 8, 6), list[Fit]()
    for start in views:
        # In steps of sqrt(2): starts that differ little see the same pixels.
        rough = round(2.0 * math.log2(_COARSE_WIDTH / planar.width(start) / contrast.factor))
        small = contrast.reduced(contrast.factor * 2.0 ** (0.5 * rough))
        fits.append(refine(model, small, start, _COARSE_REACHES, quick=True))
    kept: list[Numbers] = []
    for fit in sorted(fits, key=lambda fit: fit.cost):
        if all(_differ(fit.numbers, view) > _SAME for view in kept):
            kept.append(fit.numbers)
    return kept[:_KEPT]


def _differ(first: Numbers, second: Numbers) -> float:
    """Return by how much angles differ, rad: toward the same side of the photograph."""
    sides = np.sign([math.cos(first[4]), math.cos(second[4])])
    apart = float(np.abs(sides[0] * first[NUMBERS:] - sides[1] * second[NUMBERS:]).max())
    return apart if sides.prod() > 0.0 else max(apart, 2.0 * _SAME)
