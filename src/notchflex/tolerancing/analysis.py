"""The tolerance analysis of a robot: worst case, yield, sensitivity, remedies."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial

import numpy as np

from notchflex.analysis.uncertainty.assumed import tolerances_of
from notchflex.errors import InputError
from notchflex.loads.validation import check_integer, check_is_robot, short_repr
from notchflex.pieces.options import PieceFolder
from notchflex.pieces.run import Progress
from notchflex.robot import Robot
from notchflex.robot.tolerance import Tolerance
from notchflex.solver.newton import Settings
from notchflex.tolerancing.control import control
from notchflex.tolerancing.drawn import DrawnRobots
from notchflex.tolerancing.draws_in_pieces import draw_in_pieces
from notchflex.tolerancing.linear import linear_effects
from notchflex.tolerancing.reading import read_tolerance_spec
from notchflex.tolerancing.result import ToleranceAnalysis
from notchflex.tolerancing.sensitivity import sobol
from notchflex.tolerancing.spec import ToleranceSpec
from notchflex.tolerancing.study import Outcomes, Study, study_of
from notchflex.tolerancing.yields import REPLICATES, points_of_each, replicates

DRAWS = 100_000
MIN_DRAWS = 2 * REPLICATES
MAX_DRAWS, MAX_IN_PIECES = 10_000_000, 10_000_000_000
"""Draws in memory at most, and in pieces."""

Stage = Callable[[str, int, int], None]
"""Called with what is computed, how much of it is done, and how much there is."""


def tolerance_analysis(
    robot: Robot,
    spec: ToleranceSpec | str | os.PathLike[str],
    *,
    draws: int = DRAWS,
    seed: int = 0,
    settings: Settings | None = None,
    refinement: int = 0,
    cores: int | None = None,
    progress: Stage | None = None,
    folder: PieceFolder | str | os.PathLike[str] | None = None,
) -> ToleranceAnalysis:
    """Find out what tolerances do to a robot that must meet acceptance limits.

    Args:
        robot: The robot of the drawing.
        spec: Loads, limits and tolerances; or the file that holds them.
        draws: About how many robots are drawn: 25 independent sets of scrambled Sobol points, each
            as large as the nearest power of two.
        seed: The same seed draws the same robots.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes, as for `simulate`.
        cores: As for `simulate_batch`.
        progress: Called with what is computed, how much of it is done, and how much there is.
        folder: Draw in pieces, which this folder keeps: for more draws than fit into memory, by
            many processes (`PieceFolder`), resumed by the same call.

    Returns:
        Worst case and root sum of squares, yield, Sobol indices, and what each tolerance does.

    Raises:
        InputError: Limits, loads or tolerances that cannot be used, or the robot of the drawing
            does not converge under a load.

    Example:
        >>> import notchflex as nf
        >>> limit = nf.AcceptanceLimit("total_angle", lower=0.52, upper=0.60)
        >>> spec = nf.ToleranceSpec([limit], {"pulled": nf.Load(tension=1.0)})
        >>> found = nf.tolerance_analysis(nf.load_robot("pacheco2021-a"), spec, draws=200)
        >>> found.draws
        200
    """
    check_is_robot(robot)
    if check_integer(draws, "draws") < MIN_DRAWS:
        raise InputError.OUT_OF_RANGE(f"draws must be {MIN_DRAWS} or more; got {draws}")
    folder = None if folder is None else PieceFolder.of(folder)
    if draws > (MAX_DRAWS if folder is None else MAX_IN_PIECES):
        more = "; give a folder, which draws in pieces" if folder is None else ""
        most = MAX_DRAWS if folder is None else MAX_IN_PIECES
        raise InputError.OUT_OF_RANGE(f"draws must be at most {most:,}{more}; got {draws}")
    asked = _spec(spec, robot)
    chosen, assumed = tolerances_for(robot, asked)
    study = study_of(robot, asked, chosen, settings, refinement, cores)
    if not study.sources:
        raise InputError.NO_DATA("nothing deviates: all tolerances are 0; give one that is not.")
    effects = linear_effects(study)
    report = {name: _reporter(progress, name) for name in ("drawing", "sensitivity", "tolerances")}
    if folder is None:
        drawn = _draw(study, draws, seed, report["drawing"])
    else:
        drawn = draw_in_pieces(study, asked, draws, seed, folder, _of_pieces(report["drawing"]))
    return ToleranceAnalysis(
        robot=robot,
        paths=study.paths,
        criteria=tuple(study.criteria),
        tolerances=chosen,
        assumed=assumed,
        sources=tuple(one.name for one in study.sources),
        linear=effects,
        drawn=drawn,
        sobol=sobol(study, draws, seed, report["sensitivity"]),
        control=control(study, draws, asked.wanted_yield, seed, report["tolerances"]),
        wanted_yield=asked.wanted_yield,
        seed=seed,
    )


def _spec(spec: ToleranceSpec | str | os.PathLike[str], robot: Robot) -> ToleranceSpec:
    if isinstance(spec, ToleranceSpec):
        return spec
    if not isinstance(spec, str | os.PathLike):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            f"a notchflex.ToleranceSpec is needed, or the path of a file; got {short_repr(spec)}"
        )
    return read_tolerance_spec(spec, robot)


def tolerances_for(
    robot: Robot, asked: ToleranceSpec
) -> tuple[tuple[Tolerance, ...], tuple[str, ...]]:
    """Return the tolerances, and the names of those that are assumed.

    Args:
        robot: The robot of the drawing.
        asked: What is asked of it.
    """
    if asked.tolerances is None:
        return tolerances_of(robot)
    return robot.replace(tolerance=asked.tolerances).tolerance, ()


def _reporter(progress: Stage | None, stage: str) -> Callable[[int, int], None] | None:
    return None if progress is None else partial(progress, stage)


def _of_pieces(report: Callable[[int, int], None] | None) -> Progress | None:
    return None if report is None else lambda done, count, *_: report(done, count)


def _draw(
    study: Study, draws: int, seed: int, progress: Callable[[int, int], None] | None
) -> DrawnRobots:
    levels = np.concatenate(list(replicates(len(study.sources), points_of_each(draws), seed)))
    outcomes: Outcomes = study.at_levels(levels, progress)
    return DrawnRobots(study.drawn(levels), outcomes)
