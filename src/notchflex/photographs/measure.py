"""Measuring the notch angles of robots in photographs."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from notchflex import InputError, Robot, tip_from_angles
from notchflex.photographs.board.layout import Board
from notchflex.photographs.board.sighting import NO_RULER, Ruler
from notchflex.photographs.chain.camera import NUMBERS
from notchflex.photographs.chain.chain_table import ChainTable, Numbers, chain_table
from notchflex.photographs.chain.outline import axis_points, on_axis_points
from notchflex.photographs.contrast import contrast
from notchflex.photographs.fitting import covariance
from notchflex.photographs.judging import UNCERTAINTY, rejection_reason
from notchflex.photographs.locating import Located, locate
from notchflex.photographs.measured import MeasuredPhotograph, MeasuredPhotographs
from notchflex.photographs.missing import MAX_RESIDUAL
from notchflex.photographs.reading import read_photograph
from notchflex.photographs.taken import loads_of

NO_TUBE = "no tube of the proportions of the robot is seen"
WORKED_ON = 8.0e6
"""Pixels of a photograph beyond which it is made smaller before it is measured."""


def measure(
    photographs: Sequence[str | os.PathLike[str]] | str | os.PathLike[str],
    robot: Robot,
    *,
    loads: str | os.PathLike[str] | None = None,
    pattern: str | None = None,
    exif: bool = False,
    columns: Mapping[str, str] | None = None,
    scale: float | None = None,
    board: Board | None = None,
    uncertainty_deg: float = math.degrees(UNCERTAINTY),
    progress: Callable[[str, int, int], None] | None = None,
) -> MeasuredPhotographs:
    """Measure the angle of every notch in photographs of a robot from the side.

    The outline of the robot, as its file describes it, is fitted to the edges in each photograph:
    angles, place, scale, roll and tilt. The scale follows from the outer diameter, or also from a
    number or a board. A photograph in which anything is doubtful is refused with its reason.

    Args:
        photographs: One file or several: PNG, JPEG or TIFF.
        robot: The robot in all of them; its notches are arcs and bend in one plane.
        loads: CSV with a column `photograph` (names of the files) and columns of loads, such as
            `tendon_force_N`.
        pattern: What the names of the files look like, with `{tension}` for the pull in N and
            `{pull}` for a label of the pull: `"wrist_{pull}_{tension}N.jpg"`.
        exif: Whether UserComment or ImageDescription in the EXIF of each photograph gives the
            tension: `tension=1.2 N`, and a label of the pull if wanted: `tension=1.2 N; pull=2`.
        columns: Headers of `loads` for columns, such as `{"tension": "Kraft [N]"}`.
        scale: Pixels of the photographs per mm at the robot, known to 0.3 %.
        board: Board of markers beside the robot, in the plane in which it bends: it gives the
            scale and the tilt.
        uncertainty_deg: Photographs whose standard deviations have a larger root mean square are
            refused, deg.
        progress: Called with the stage, how many photographs are done, and how many there are.

    Returns:
        Angles and tip with standard deviations, or the reason, for each photograph.

    Raises:
        InputError: A file is not a photograph, the robot is of another kind, a photograph has no
            loads, scale or board are invalid, or `opencv-python-headless` is not installed.

    Example:
        >>> import notchflex as nf
        >>> found = nf.measure("pull_1N.jpg", nf.load_robot("wrist.toml"))  # doctest: +SKIP
        >>> found.write_csv("measured.csv")  # doctest: +SKIP
    """
    one = isinstance(photographs, (str, os.PathLike))
    names = [os.fspath(name) for name in ([photographs] if one else photographs)]
    if not names:
        raise InputError.NO_DATA("there is no photograph to measure; name one or more")
    table, ruler = chain_table(robot), Ruler(scale, board)
    uncertainty = checked_uncertainty(uncertainty_deg)
    given = loads_of(names, robot, loads, pattern, exif, columns)
    measured: list[MeasuredPhotograph] = []
    for number, name in enumerate(names):
        picture = read_photograph(name)
        measured.append(measure_picture(picture, table, name, ruler, uncertainty=uncertainty))
        if progress is not None:
            progress("measuring", number + 1, len(names))
    return MeasuredPhotographs(robot, tuple(measured), given)


def checked_uncertainty(value: float) -> float:
    """Return an uncertainty in rad that was given in deg.

    Raises:
        InputError: It is not a number above 0.
    """
    number: Any = value
    if isinstance(number, bool) or not isinstance(number, (int, float, np.number)):
        raise InputError.WRONG_TYPE(f"uncertainty_deg must be a number of deg, not {value!r}")
    if not number > 0.0:
        raise InputError.OUT_OF_RANGE(f"uncertainty_deg must be above 0 deg, not {value:g}")
    return math.radians(number)


# Of matrices this small, threads of the linear algebra only cost.
@threadpool_limits.wrap(limits=1)
def measure_picture(
    picture: NDArray[np.uint8],
    table: ChainTable,
    name: str,
    ruler: Ruler = NO_RULER,
    chain: Numbers | None = None,
    uncertainty: float = UNCERTAINTY,
) -> MeasuredPhotograph:
    """Measure a photograph that was read, (height, width, 3).

    Args:
        picture: Blue, green and red.
        table: The robot.
        name: What the photograph is called.
        ruler: What gives the scale.
        chain: Points of the tube axis from which the fit is started, px, (n + 2, 2), as in
            `MeasuredPhotograph.chain`; without them the robot is searched.
        uncertainty: Largest root mean square of the standard deviations, rad.

    Raises:
        InputError: The points of the chain are invalid.
    """
    picture, factor = smaller(picture)
    middle = (np.array([picture.shape[1], picture.shape[0]]) - 1.0) / 2.0
    given = () if chain is None else on_axis_points(table, (chain + 0.5) * factor - 0.5 - middle)
    reading = ruler.read(picture, factor)
    if isinstance(reading, str):
        return refused_photograph(name, table, reading)
    located = locate(table, reading.hidden(contrast(picture)), reading, given)
    if located is None:
        return refused_photograph(name, table, NO_TUBE)
    factor *= located.factor
    both, noise = covariance(located.fit, located.model)
    angles = slice(NUMBERS, NUMBERS + table.notches)
    deviation = np.sqrt(np.maximum(np.diag(both)[angles], 0.0))
    reason = rejection_reason(located, deviation, noise, uncertainty)
    middle = (np.array([picture.shape[1], picture.shape[0]]) * located.factor - 1.0) / 2.0
    return judged_photograph(name, located, both[angles, angles], (reason, noise, factor), middle)


def smaller(picture: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], float]:
    """Return a photograph of `WORKED_ON` pixels at most, and by how much it was made smaller."""
    import cv2

    factor = min(1.0, math.sqrt(WORKED_ON / (picture.shape[0] * picture.shape[1])))
    if factor == 1.0:
        return picture, factor
    resized: Any = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    return resized, factor


def judged_photograph(
    name: str,
    located: Located,
    spread: Numbers,
    judged: tuple[str, float, float],
    middle: Numbers,
) -> MeasuredPhotograph:
    """Return what a fit says about a photograph.

    Args:
        name: What the photograph is called.
        located: The fit.
        spread: Covariance of the angles, rad^2, (n, n).
        judged: Why the photograph is refused ("" if not), noise of the edges (px), and by how much
            the photograph was made smaller.
        middle: Middle of the photograph that was made smaller, px.
    """
    reason, noise, factor = judged
    fit, table = located.fit, located.model.table
    angles = fit.numbers[NUMBERS : NUMBERS + table.notches]

    def placed(points: Numbers) -> Numbers:
        return (points + middle + 0.5) / factor - 0.5

    view: dict[str, Any] = {
        "scale": math.exp(fit.numbers[3]) / factor,
        "roll": math.remainder(fit.numbers[4], math.pi),
        "tilt": float(fit.numbers[5]),
        "noise": noise / factor,
        "found": fit.score,
        "outline": placed(fit.outline.point[0]),
        "chain": placed(axis_points(table, fit.numbers)),
        "seen": np.abs(fit.residual) < MAX_RESIDUAL,
    }
    if reason:
        return refused_photograph(name, table, reason, **view)
    steps = 1e-4 * np.vstack([np.zeros(len(angles)), np.eye(len(angles))])
    tips, _ = tip_from_angles(table.robot, angles + steps)
    slopes = (tips[1:] - tips[0]).T / 1e-4
    variance = np.einsum("an,nm,am->a", slopes, spread, slopes)
    deviation = np.where(variance > 1e-18, np.sqrt(np.maximum(variance, 0.0)), np.nan)
    return MeasuredPhotograph(
        name, "", angles.copy(), np.sqrt(np.diag(spread)), tips[0], deviation, **view
    )


def refused_photograph(
    name: str, table: ChainTable, reason: str, **view: Any
) -> MeasuredPhotograph:
    """Return a photograph of which nothing is reported, with the reason."""
    nothing, nowhere = np.full(table.notches, np.nan), np.full(3, np.nan)
    return MeasuredPhotograph(name, reason, nothing, nothing, nowhere, nowhere, **view)
