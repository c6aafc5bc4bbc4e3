"""Measuring the notch angles of robots in photographs."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from notchflex import InputError, Robot, tip_from_angles
from notchflex.photographs.board import Board
from notchflex.photographs.camera import NUMBERS
from notchflex.photographs.chain_table import ChainTable, Numbers, chain_table
from notchflex.photographs.edges import Contrast, contrast
from notchflex.photographs.fitting import MAX_RESIDUAL
from notchflex.photographs.judging import UNCERTAINTY, rejection_reason
from notchflex.photographs.loads import loads_of
from notchflex.photographs.locating import Located, locate
from notchflex.photographs.measured import MeasuredPhotograph, MeasuredPhotographs
from notchflex.photographs.outline import axis_points
from notchflex.photographs.reading import read_photograph
from notchflex.photographs.sighting import NO_RULER, Ruler
from notchflex.support import check_number

MOST_PIXELS = 8.0e6
"""A photograph of more pixels is made smaller before it is measured."""


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
    names = names_of(photographs)
    table, ruler = chain_table(robot), Ruler(scale, board)
    uncertainty = checked_uncertainty(uncertainty_deg)
    columns_of_loads = loads_of(names, robot, loads, pattern, exif, columns)
    measured: list[MeasuredPhotograph] = []
    for number, name in enumerate(names, 1):
        picture = read_photograph(name)
        measured.append(measure_picture(picture, table, name, ruler, uncertainty=uncertainty))
        if progress is not None:
            progress("measuring", number, len(names))
    return MeasuredPhotographs(robot, tuple(measured), columns_of_loads)


def names_of(photographs: Sequence[str | os.PathLike[str]] | str | os.PathLike[str]) -> list[str]:
    """Return the names of one file or several.

    Raises:
        InputError: There is none.
    """
    is_single = isinstance(photographs, (str, os.PathLike))
    names = [os.fspath(name) for name in ([photographs] if is_single else photographs)]
    if not names:
        raise InputError.NO_DATA("there is no photograph to measure; name one or more")
    return names


def checked_uncertainty(value: float) -> float:
    """Return an uncertainty in rad that was given in deg.

    Raises:
        InputError: It is not a number above 0.
    """
    number = check_number(value, "uncertainty_deg", "a number of deg")
    if not number > 0.0:
        raise InputError.OUT_OF_RANGE(f"uncertainty_deg must be above 0 deg, not {number:g}")
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
    seen = see(picture, table, ruler, chain)
    if isinstance(seen, str):
        return MeasuredPhotograph.refused(name, table.notches, seen)
    spread = seen.located.fit.covariance()[NUMBERS:, NUMBERS:]
    deviation = np.sqrt(np.maximum(np.diag(spread), 0.0))
    fit, rivals, _ = seen.located
    reason = rejection_reason(fit, rivals, deviation, uncertainty)
    return judged_photograph(name, seen, spread, reason)


class SeenRobot(NamedTuple):
    """A robot in a photograph.

    Attributes:
        located: The fit.
        contrast: Contrast of the whole photograph, without a board.
        factor: By how much the photograph was made smaller for it.
    """

    located: Located
    contrast: Contrast
    factor: float


def see(
    picture: NDArray[np.uint8], table: ChainTable, ruler: Ruler, chain: Numbers | None = None
) -> SeenRobot | str:
    """Find the robot in a photograph; return why not if it is not found."""
    import cv2

    factor = min(1.0, math.sqrt(MOST_PIXELS / (picture.shape[0] * picture.shape[1])))
    smaller: Any = picture
    if factor < 1.0:
        smaller = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    if chain is not None:
        middle = (np.array(smaller.shape[1::-1]) - 1.0) / 2.0
        chain = (chain + 0.5) * factor - 0.5 - middle
    reading = ruler.read(smaller, factor)
    if isinstance(reading, str):
        return reading
    whole = reading.hidden(contrast(smaller))
    located = locate(table, whole, reading, chain)
    if located is None:
        return "no tube of the proportions of the robot is seen"
    return SeenRobot(located, whole, factor)


def judged_photograph(
    name: str, seen: SeenRobot, spread: Numbers, reason: str
) -> MeasuredPhotograph:
    """Return what a fit says about a photograph.

    Args:
        name: What the photograph is called.
        seen: The fit.
        spread: Covariance of the angles, rad^2, (n, n).
        reason: Why the photograph is refused; "" if it is not.
    """
    fit, factor = seen.located.fit, seen.factor * seen.located.factor
    table = fit.model.table
    angles = fit.numbers[NUMBERS : NUMBERS + table.notches]

    def placed(points: Numbers) -> Numbers:
        """Return points of the photograph as it was read, px."""
        middle = (seen.contrast.middle + 0.5) * seen.located.factor
        return (points + middle) / factor - 0.5

    view: dict[str, Any] = {
        "scale": math.exp(fit.numbers[3]) / factor,
        "roll": math.remainder(fit.numbers[4], math.pi),
        "tilt": float(fit.numbers[5]),
        "noise": fit.noise / factor,
        "found": fit.score,
        "outline": placed(fit.outline.point[0]),
        "chain": placed(axis_points(table, fit.numbers)),
        "seen": np.abs(fit.residual) < MAX_RESIDUAL,
    }
    if reason:
        return MeasuredPhotograph.refused(name, table.notches, reason, **view)
    steps = 1e-4 * np.vstack([np.zeros(len(angles)), np.eye(len(angles))])
    tips, _ = tip_from_angles(table.robot, angles + steps)
    slopes = (tips[1:] - tips[0]).T / 1e-4
    variance = np.einsum("an,nm,am->a", slopes, spread, slopes)
    deviation = np.where(variance > 1e-18, np.sqrt(np.maximum(variance, 0.0)), np.nan)
    return MeasuredPhotograph(
        name, "", angles.copy(), np.sqrt(np.diag(spread)), tips[0], deviation, **view
    )
