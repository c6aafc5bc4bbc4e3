"""Measuring notches as they were cut, in photographs of a straight robot.

From the side, a notch that is rolled a little looks like one that is less deep. One photograph does
not tell which it is; photographs between which the robot was turned by known angles do.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from notchflex import ArcNotch, InputError, Robot
from notchflex.photographs.board import Board
from notchflex.photographs.camera import NUMBERS
from notchflex.photographs.chain_table import ChainTable, Numbers, chain_table
from notchflex.photographs.fitting import refine
from notchflex.photographs.judging import rejection_reason
from notchflex.photographs.locating import EDGE_NOISE, reversed_view, scaled
from notchflex.photographs.measure import judged_photograph, names_of, see
from notchflex.photographs.measured import MeasuredPhotograph
from notchflex.photographs.outline import OutlineModel, spine_edge
from notchflex.photographs.reading import read_photograph
from notchflex.photographs.sighting import NO_RULER, Ruler
from notchflex.support import document_head, robot_text, write_columns, write_text

LENGTHS = ("height", "depth", "uncut_length")
"""The measured lengths, by their names in a robot file."""


@dataclass(frozen=True, eq=False)
class MeasuredCut:
    """The notches of a robot as they were cut, n notches. Units mm.

    Attributes:
        robot: The robot as its file describes it.
        photographs: What was seen in each photograph.
        turns: By how much the robot was turned about its axis for each photograph, rad.
        reason: Why nothing is reported; "" if the notches were measured.
        height: Height of every notch, base to tip, (n,); NaN if refused.
        depth: Depth of every notch, (n,).
        uncut_length: Length of every uncut section, that of the tip last, (n,).
        height_deviation: Standard deviations of the heights, (n,).
        depth_deviation: Standard deviations of the depths, (n,).
        uncut_length_deviation: Standard deviations of the uncut lengths, (n,).
    """

    robot: Robot
    photographs: tuple[MeasuredPhotograph, ...]
    turns: Numbers
    reason: str
    height: Numbers
    depth: Numbers
    uncut_length: Numbers
    height_deviation: Numbers
    depth_deviation: Numbers
    uncut_length_deviation: Numbers

    @property
    def measured(self) -> bool:
        """Whether lengths are reported."""
        return not self.reason

    def columns(self) -> dict[str, Numbers]:
        """Return the columns of the CSV table: one row a notch."""
        columns: dict[str, Numbers] = {"notch": np.arange(1.0, len(self.height) + 1)}
        for name in LENGTHS:
            columns[f"{name}_mm"] = getattr(self, name)
            columns[f"{name}_sd_mm"] = getattr(self, f"{name}_deviation")
        return columns

    def write_csv(self, target: str) -> None:
        """Write the lengths as CSV, one row a notch, `-` for output.

        Raises:
            InputError: The file cannot be written.
        """
        columns = self.columns()
        write_columns(target, {**columns, "notch": columns["notch"].astype(int)})

    def document(self) -> dict[str, Any]:
        """Return the JSON document: the notches, or why they were refused."""
        photographs = [
            {"photograph": one.source, "turn_deg": math.degrees(turn), **one.view()}
            for one, turn in zip(self.photographs, self.turns, strict=True)
        ]
        document: dict[str, Any] = {"measured": self.measured, "photographs": photographs}
        document |= self.columns() if self.measured else {"reason": self.reason}
        return {**document_head(self.robot), **document}

    def as_cut(self) -> Robot:
        """Return the robot with the measured heights, depths and uncut lengths.

        Raises:
            InputError: The photographs were refused, or the robot is not possible.
        """
        return self.robot.with_values(self._values())

    def write_robot(self, target: str | os.PathLike[str]) -> None:
        """Write the robot as it was cut; comments name the photographs and standard deviations.

        Raises:
            InputError: The photographs were refused, or the file cannot be written.
        """
        robot = self.as_cut()
        sources = ", ".join(" ".join(Path(one.source).name.split()) for one in self.photographs)
        notes: dict[str, str] = {}
        for name in LENGTHS:
            for number, spread in enumerate(getattr(self, f"{name}_deviation"), 1):
                path = f"notch[{number}].{name}"
                notes[path] = f"photographs {sources}: standard deviation {spread:.2g} mm"
        write_text(Path(target), robot_text(robot, fitted=notes))

    def _values(self) -> dict[str, float]:
        if self.reason:
            raise InputError.NO_DATA(f"the cut was not measured: {self.reason}")
        return {
            f"notch[{number}].{name}": round(float(value), 5)
            for name in LENGTHS
            for number, value in enumerate(getattr(self, name), 1)
        }


_WIDTH = 300.0  # of the tube beyond which a photograph is made smaller, px
_REACH, _LAST = 0.08, 4.0  # of the width of the tube, and px, within which edges are looked for
_ROUNDS = 30
_CORNER = 0.35  # outer radii: blurred corners beside spines shift ends
_BENT = "the robot is bent; photograph it straight"
_MAX_ANGLE = math.radians(12.0)
_STEP = 1e-5  # mm, rad
_SHIFT = 0.2
"""How far blur and shading shift all edges of a photograph alike, px: by that the tube looks wider
and all notches look lower, or the other way round. Nothing else in the photograph shows it."""


class StraightFit(NamedTuple):
    """Notches of a robot measured in one photograph. Lengths mm.

    Attributes:
        photograph: The fit as a photograph, with the reason if it was refused.
        lengths: Heights and uncut lengths less those of the robot file, (2 n,).
        spread: Their covariance, (2 n, 2 n).
        edge: How high over the axis the inner edge of every spine is seen, (n,).
        edge_spread: Their covariance, (n, n).
    """

    photograph: MeasuredPhotograph
    lengths: Numbers
    spread: Numbers
    edge: Numbers
    edge_spread: Numbers


# Of matrices this small, threads of the linear algebra only cost.
@threadpool_limits.wrap(limits=1)
def fit_straight(
    picture: NDArray[np.uint8], table: ChainTable, name: str, ruler: Ruler = NO_RULER
) -> StraightFit:
    """Fit heights, depths and places of all notches to a photograph, (height, width, 3)."""
    n = table.notches
    seen = see(picture, table, ruler)
    if isinstance(seen, str):
        return _refused(name, n, seen)
    located = seen.located
    if np.abs(located.fit.numbers[NUMBERS:]).max() > 1.5 * _MAX_ANGLE:
        return _refused(name, n, _BENT)
    full = scaled(located.fit.numbers, 1.0 / located.factor)
    wide = 2.0 * table.outer * math.exp(full[3])
    fine = min(1.0, _WIDTH / wide)
    reaches = [*3 * [max(_LAST, _REACH * wide * fine)], *_ROUNDS * [_LAST]]
    view_prior = located.fit.model.prior.smaller(fine / located.factor)
    model = OutlineModel(table, corner=_CORNER, shift=_SHIFT, prior=view_prior)
    start = np.concatenate([scaled(full, fine), np.zeros(3 * n + 1)])
    image = seen.contrast.reduced(fine)
    fits = [refine(model, image, view, reaches) for view in _tilted(table, start)]
    noise = max(EDGE_NOISE, min(fit.noise for fit in fits))
    fit = min(fits, key=lambda fit: fit.misfit(noise))
    spread = fit.covariance()
    angles = slice(NUMBERS, NUMBERS + n)
    deviation = np.sqrt(np.maximum(np.diag(spread)[angles], 0.0))
    reason = rejection_reason(fit, located.rivals, deviation)
    if not reason and np.abs(fit.numbers[angles]).max() > _MAX_ANGLE:
        reason = _BENT
    seen = seen._replace(located=located._replace(fit=fit, factor=fine))
    photograph = judged_photograph(name, seen, spread[angles, angles], reason)
    rows, edges = _lengths(n, len(start)), _edges(table, fit.numbers)
    steps = _STEP * np.eye(len(start))
    slopes = np.stack([_edges(table, fit.numbers + step) - edges for step in steps], axis=1) / _STEP
    lengths, of_lengths = rows @ fit.numbers, rows @ spread @ rows.T
    return StraightFit(photograph, lengths, of_lengths, edges, slopes @ spread @ slopes.T)


def _refused(name: str, n: int, reason: str) -> StraightFit:
    photograph = MeasuredPhotograph.refused(name, n, reason)
    nothing, spread = np.full(n, np.nan), np.zeros((0, 0))
    return StraightFit(photograph, np.tile(nothing, 2), spread, nothing, spread)


def _tilted(table: ChainTable, numbers: Numbers) -> Numbers:
    """Return starts whose views differ: edges of a straight robot hardly show them at first."""
    roll, tilt = float(numbers[4]), float(numbers[5])
    mirrored = float(reversed_view(numbers)[4])
    starts = np.tile(numbers, (4, 1))
    starts[:, 4:6] = (roll, tilt), (roll, -tilt), (roll, 0.0), (mirrored, 0.0)
    starts[:, 6] = 0.003 / table.outer
    return starts


def _lengths(n: int, count: int) -> Numbers:
    """Return heights and uncut lengths as sums of the numbers that were fitted, (2 n, count)."""
    first, moved = NUMBERS + n, NUMBERS + 3 * n
    rows = np.zeros((2 * n, count))
    height, uncut = rows[:n], rows[n:]
    notch = np.arange(n)
    height[:, 7] = height[notch, first + notch] = 1.0
    uncut[notch, moved + notch + 1], uncut[notch, moved + notch] = 1.0, -1.0
    uncut -= 0.5 * height
    uncut[:-1] -= 0.5 * height[1:]
    return rows


def _edges(table: ChainTable, numbers: Numbers) -> Numbers:
    n = table.notches
    cut = numbers[8] + numbers[NUMBERS + 2 * n : NUMBERS + 3 * n]
    return seen_edges(table, cut, float(numbers[4]))


def seen_edges(table: ChainTable, cut: Numbers, roll: float) -> Numbers:
    """Return how high over the axis the inner edges of spines are seen, (n,).

    Args:
        table: The robot.
        cut: What the notches are deeper than in the robot file, (n,).
        roll: Roll about the tube axis, rad.
    """
    x, y = np.full(len(cut), abs(math.cos(roll))), np.full(len(cut), abs(math.sin(roll)))
    return spine_edge(table, np.arange(table.notches), cut, x, y)


_ROLL = math.radians(10.0)  # usual roll of a robot that was laid down with care
_DEPTH = 0.1  # of the outer diameter: how far a depth may be off
_TURN = math.radians(0.3)  # how well a turn is known
_MIN_SPREAD = 1e-4  # mm: no edge is known better
_STARTS = np.radians(np.arange(-24.0, 25.0, 6.0))


def depths(
    table: ChainTable, fits: Sequence[StraightFit], turns: Numbers
) -> tuple[Numbers, Numbers, float]:
    """Return what notches are deeper than in the robot file, and standard deviations, mm, (n,).

    The third is the largest residual, in standard deviations.

    Args:
        table: The robot.
        fits: What the photographs say.
        turns: By how much the robot was turned about its axis for each of them, rad.
    """
    n = table.notches
    scales = np.concatenate([np.full(n, _DEPTH * 2.0 * table.outer), [_ROLL]])
    scales = np.concatenate([scales, np.full(len(fits), _TURN)])
    weights = [
        np.linalg.inv(np.linalg.cholesky(fit.edge_spread + _MIN_SPREAD**2 * np.eye(n)))
        for fit in fits
    ]

    def residuals(scaled: Numbers) -> Numbers:
        numbers = scaled * scales
        rolls = numbers[n] + turns + numbers[n + 1 :]
        apart = [
            weight @ (seen_edges(table, numbers[:n], float(roll)) - fit.edge)
            for weight, fit, roll in zip(weights, fits, rolls, strict=True)
        ]
        return np.concatenate([*apart, scaled])

    results = []
    for roll in _STARTS:
        start = np.zeros(len(scales))
        start[n] = roll / _ROLL
        results.append(least_squares(residuals, start))
    best = min(results, key=lambda result: result.cost)
    covariance = np.linalg.inv(best.jac.T @ best.jac)
    return (
        (best.x * scales)[:n],
        (np.sqrt(np.diag(covariance)) * scales)[:n],
        float(np.abs(best.fun).max()),
    )


MAX_TURN_DEG = 40.0
"""Most that the robot is turned between photographs, deg: all are taken from the side."""

_APART = 5.0  # standard deviations by which photographs may contradict each other


def measure_cut(
    photographs: Sequence[str | os.PathLike[str]] | str | os.PathLike[str],
    robot: Robot,
    *,
    turn_deg: float | Sequence[float] = (),
    scale: float | None = None,
    board: Board | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> MeasuredCut:
    """Measure height, depth and uncut length of every notch in photographs of the straight robot.

    From the side, a notch that is rolled looks like one that is less deep. Two photographs between
    which the robot was turned by some 20 deg about its axis separate roll from depth; with one,
    the standard deviations of the depths are some percent of the outer diameter.

    Args:
        photographs: One file or several: PNG, JPEG or TIFF.
        robot: The robot in all of them; its notches are arcs and bend in one plane.
        turn_deg: By how much the robot was turned about its axis for each photograph after the
            first, from the first on, deg; known to about 0.3 deg.
        scale: Pixels of the photographs per mm at the robot, known to 0.3 %.
        board: Board of markers beside the robot.
        progress: Called with the stage, how many photographs are done, and how many there are.

    Returns:
        Lengths with standard deviations, or the reason why there are none.

    Raises:
        InputError: A file is not a photograph, the robot is of another kind, the number of turns
            differs from the number of photographs, scale or board are invalid, or
            `opencv-python-headless` is not installed.

    Example:
        >>> import notchflex as nf
        >>> robot = nf.load_robot("wrist.toml")  # doctest: +SKIP
        >>> cut = nf.measure_cut(["a.jpg", "b.jpg"], robot, turn_deg=20)  # doctest: +SKIP
        >>> cut.write_robot("wrist-as-cut.toml")  # doctest: +SKIP
    """
    names = names_of(photographs)
    turns = _turns(len(names), turn_deg)
    table, ruler = chain_table(robot), Ruler(scale, board)
    fits: list[StraightFit] = []
    for number, name in enumerate(names, 1):
        fits.append(fit_straight(read_photograph(name), table, name, ruler))
        if progress is not None:
            progress("measuring", number, len(names))
    return combined(table, fits, turns)


def _turns(count: int, turn_deg: float | Sequence[float]) -> Numbers:
    try:
        turns: NDArray[np.float64] = np.atleast_1d(np.asarray(turn_deg, float))
    except (TypeError, ValueError):
        raise InputError.WRONG_TYPE(
            f"turn_deg must be a number or a list of numbers, not {turn_deg!r}"
        ) from None
    if turns.ndim > 1 or len(turns) != count - 1:
        raise InputError.WRONG_SHAPE(
            f"{count} photographs need {count - 1} turns, one for each after the first; got "
            f"{turns.size}"
        )
    if not (np.abs(turns) <= MAX_TURN_DEG).all():
        raise InputError.OUT_OF_RANGE(
            f"turns must lie between -{MAX_TURN_DEG:g} and {MAX_TURN_DEG:g} deg, not "
            f"{', '.join(f'{turn:g}' for turn in turns)}"
        )
    return np.radians(np.concatenate([[0.0], turns]))


def combined(table: ChainTable, fits: Sequence[StraightFit], turns: Numbers) -> MeasuredCut:
    """Return what photographs say together.

    Args:
        table: The robot.
        fits: What each photograph says.
        turns: By how much the robot was turned for each of them, rad.
    """
    photographs = tuple(fit.photograph for fit in fits)
    refused = next((one for one in photographs if one.reason), None)
    if refused is not None:
        return _cut(table, photographs, turns, f"{refused.source}: {refused.reason}")
    lengths, spread, apart = _mean(fits)
    if apart > _APART:
        return _cut(table, photographs, turns, "the photographs contradict each other in heights")
    cut, cut_deviation, apart = depths(table, fits, turns)
    if apart > _APART:
        return _cut(
            table, photographs, turns, "the photographs contradict each other; check the turns"
        )
    n = table.notches
    depth = np.array([notch.depth for notch in table.robot.notches if isinstance(notch, ArcNotch)])
    beyond = table.depth - table.outer  # depths may count from elsewhere than the outer surface
    slope = np.where(np.abs(beyond) > 1e-6, (depth - table.outer) / (beyond + 1e-300), 1.0)
    values = {
        "height": table.height + lengths[:n],
        "uncut_length": table.uncut + lengths[n:],
        "depth": depth + slope * cut,
        "height_deviation": spread[:n],
        "uncut_length_deviation": spread[n:],
        "depth_deviation": slope * cut_deviation,
    }
    return _cut(table, photographs, turns, "", **values)


def _mean(fits: Sequence[StraightFit]) -> tuple[Numbers, Numbers, float]:
    """Return the weighted mean of lengths, standard deviations, and how far fits lie apart."""
    weights = [np.linalg.pinv(fit.spread, hermitian=True) for fit in fits]
    covariance = np.linalg.pinv(sum(weights), hermitian=True)
    mean = covariance @ sum(weight @ fit.lengths for weight, fit in zip(weights, fits, strict=True))
    apart = max(
        float((np.abs(fit.lengths - mean) / np.sqrt(np.diag(fit.spread))).max()) for fit in fits
    )
    # Blur and shading shift edges equally in all photographs: a mean of several is no better.
    return mean, np.sqrt(len(fits) * np.diag(covariance)), apart


def _cut(
    table: ChainTable,
    photographs: tuple[MeasuredPhotograph, ...],
    turns: Numbers,
    reason: str,
    **values: Numbers,
) -> MeasuredCut:
    nothing = np.full(table.notches, math.nan)
    names = [*LENGTHS, *(f"{name}_deviation" for name in LENGTHS)]
    lengths = {name: values.get(name, nothing) for name in names}
    return MeasuredCut(table.robot, photographs, turns, reason, **lengths)
