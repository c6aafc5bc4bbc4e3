"""Measuring notches as they were cut, in photographs of a straight robot."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from notchflex.errors import InputError
from notchflex.photographs.board.layout import Board
from notchflex.photographs.board.ruler import Ruler
from notchflex.photographs.chain.chain_table import ChainTable, Numbers, chain_table
from notchflex.photographs.cut.depths import depths
from notchflex.photographs.cut.measured_cut import LENGTHS, MeasuredCut
from notchflex.photographs.cut.straight import StraightFit, fit_straight
from notchflex.photographs.measured import MeasuredPhotograph
from notchflex.photographs.reading import read_photograph
from notchflex.robot import ArcNotch, Robot

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
    one = isinstance(photographs, (str, os.PathLike))
    names = [os.fspath(name) for name in ([photographs] if one else photographs)]
    turns = _turns(len(names), turn_deg)
    table, ruler = chain_table(robot), Ruler(scale, board)
    fits: list[StraightFit] = []
    for number, name in enumerate(names):
        fits.append(fit_straight(read_photograph(name), table, name, ruler))
        if progress is not None:
            progress("measuring", number + 1, len(names))
    return combined(table, fits, turns)


def _turns(count: int, turn_deg: float | Sequence[float]) -> Numbers:
    if count == 0:
        raise InputError.NO_DATA("there is no photograph to measure; name one or more")
    try:
        given: NDArray[np.float64] = np.atleast_1d(np.asarray(turn_deg, float))
    except (TypeError, ValueError):
        raise InputError.WRONG_TYPE(
            f"turn_deg must be a number or a list of numbers, not {turn_deg!r}"
        ) from None
    if given.ndim > 1 or len(given) != count - 1:
        raise InputError.WRONG_SHAPE(
            f"{count} photographs need {count - 1} turns, one for each after the first; got "
            f"{given.size}"
        )
    if not (np.abs(given) <= MAX_TURN_DEG).all():
        raise InputError.OUT_OF_RANGE(
            f"turns must lie between -{MAX_TURN_DEG:g} and {MAX_TURN_DEG:g} deg, not "
            f"{', '.join(f'{turn:g}' for turn in given)}"
        )
    return np.radians(np.concatenate([[0.0], given]))


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
    given = {name: values.get(name, nothing) for name in names}
    return MeasuredCut(table.robot, photographs, turns, reason, **given)
