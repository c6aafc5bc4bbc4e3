"""Measuring the notch angles of robots in photographs."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import approx_fprime
from threadpoolctl import threadpool_limits

from notchflex import InputError, Robot, tip_from_angles
from notchflex.photographs.board import NO_RULER, Board, Ruler
from notchflex.photographs.edges import Numbers, contrast, made_smaller
from notchflex.photographs.fitting import MAX_RESIDUAL, UNCERTAINTY, Fit, rejection_reason
from notchflex.photographs.locating import Located, locate
from notchflex.photographs.measured import MeasuredPhotograph, MeasuredPhotographs
from notchflex.photographs.outline import PlanarRobot, axis_points
from notchflex.photographs.reading import loads_of, read_photograph
from notchflex.support import AnyPath, check_is_path, check_is_robot, check_number

Photographs = Sequence[AnyPath] | AnyPath
Progress = Callable[[str, int, int], None]

MOST_PIXELS = 8.0e6
"""A photograph of more pixels is made smaller before it is measured."""


def measure(
    photographs: Photographs,
    robot: Robot,
    *,
    loads: AnyPath | None = None,
    pattern: str | None = None,
    exif: bool = False,
    columns: Mapping[str, str] | None = None,
    scale: float | None = None,
    board: Board | None = None,
    uncertainty_deg: float = math.degrees(UNCERTAINTY),
    progress: Progress | None = None,
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
    planar, ruler = PlanarRobot(check_is_robot(robot)), Ruler(scale, board)
    uncertainty = checked_uncertainty(uncertainty_deg)
    columns_of_loads = loads_of(names, robot, loads, pattern, exif, columns)
    measured = tuple(
        measure_picture(picture, planar, name, ruler, uncertainty=uncertainty)
        for name, picture in pictures_of(names, progress)
    )
    return MeasuredPhotographs(robot, measured, columns_of_loads)


def names_of(photographs: Photographs) -> list[str]:
    """Return the names of one file or several.

    Raises:
        InputError: There is none.
    """
    if isinstance(photographs, str) or not isinstance(photographs, Iterable):
        photographs = [photographs]
    names: list[str] = []
    for name in photographs:
        check_is_path(name, "a photograph")
        names.append(os.fspath(name))
    if not names:
        raise InputError.NO_DATA("there is no photograph to measure; name one or more")
    return names


def pictures_of(
    names: Sequence[str], progress: Progress | None
) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    """Yield names and pictures of photographs, and tell the progress after each."""
    for number, name in enumerate(names, 1):
        yield name, read_photograph(name)
        if progress is not None:
            progress("measuring", number, len(names))


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
    planar: PlanarRobot,
    name: str,
    ruler: Ruler = NO_RULER,
    chain: Numbers | None = None,
    uncertainty: float = UNCERTAINTY,
) -> MeasuredPhotograph:
    """Measure a photograph that was read, (height, width, 3).

    Args:
        picture: Blue, green and red.
        planar: The robot.
        name: What the photograph is called.
        ruler: What gives the scale.
        chain: Points of the tube axis from which the fit is started, px, (n + 2, 2), as in
            `MeasuredPhotograph.chain`; without them the robot is searched.
        uncertainty: Largest root mean square of the standard deviations, rad.

    Raises:
        InputError: The points of the chain are invalid.
    """
    located = see(picture, planar, ruler, chain)
    if isinstance(located, str):
        return MeasuredPhotograph.refused(name, planar.notches, located)
    reason = rejection_reason(located.fit, located.rivals, uncertainty)
    return judged_photograph(name, located.fit, reason)


def see(
    picture: NDArray[np.uint8], planar: PlanarRobot, ruler: Ruler, chain: Numbers | None = None
) -> Located | str:
    """Find the robot in a photograph; return why not if it is not found."""
    factor = min(1.0, math.sqrt(MOST_PIXELS / (picture.shape[0] * picture.shape[1])))
    smaller = made_smaller(picture, factor)
    reading = ruler.read(smaller, contrast(smaller, factor))
    if isinstance(reading, str):
        return reading
    prior, whole = reading
    return locate(planar, whole, prior, None if chain is None else chain - whole.centre)


def judged_photograph(name: str, fit: Fit, reason: str) -> MeasuredPhotograph:
    """Return what a fit says about a photograph; with a reason it is refused."""
    planar, picture, of_angles = fit.model.planar, fit.contrast, fit.model.angles
    view: dict[str, Any] = {
        "scale": math.exp(fit.numbers[3]),
        "roll": math.remainder(fit.numbers[4], math.pi),
        "tilt": float(fit.numbers[5]),
        "noise": fit.noise / picture.factor,
        "found": fit.score,
        "outline": fit.outline.point[0] / picture.factor + picture.centre,
        "chain": axis_points(planar, fit.numbers) + picture.centre,
        "seen": np.abs(fit.residual) < MAX_RESIDUAL,
    }
    if reason:
        return MeasuredPhotograph.refused(name, planar.notches, reason, **view)

    def tip(angles: Numbers) -> Numbers:
        return tip_from_angles(planar.robot, angles[None])[0][0]

    angles, spread = fit.numbers[of_angles].copy(), fit.covariance[of_angles, of_angles]
    slopes: Any = approx_fprime(angles, tip, 1e-4)
    variance = np.einsum("an,nm,am->a", slopes, spread, slopes)
    deviation = np.where(variance > 1e-18, np.sqrt(np.maximum(variance, 0.0)), np.nan)
    return MeasuredPhotograph(name, "", angles, fit.deviation, tip(angles), deviation, **view)
