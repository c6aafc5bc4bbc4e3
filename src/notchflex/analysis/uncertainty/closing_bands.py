"""Effect of tolerances on the closing of notches, and of 10 µm of depth."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex.analysis.batch import solve_batch
from notchflex.analysis.closing_loads import Closing
from notchflex.analysis.uncertainty.bands import Band, Bands, band, uncertain
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.results.quantities.registry import DEGREES
from notchflex.robot import Robot
from notchflex.robot.value_names import numbers_at

DEPTH = 0.010
"""The change of depth whose effect is reported, mm."""

_DRAWS, _STEPS, _BEYOND = 128, 32, 1.6
_NEVER = 1e12


class ClosingBands(NamedTuple):
    """Results of `notchflex show` on tolerances.

    Attributes:
        bands: The bands that the others were taken from.
        notches: Numbers of the notches, from 1, that the tendon closes that closes one first.
        tension: Tension that closes each of them, N, (n,); infinite beyond 1.6 times the tension
            that closes all of the robot of the drawing.
        angle: Angle at which it closes, rad, (n,).
        load: Half the tension that closes the first notch, N.
        tendon: That tendon, from 1.
        total_angle: Total angle at that load, rad.
        by_depth: Change of the total angle at that load if all notches are cut 10 µm deeper, rad;
            NaN for notches without a depth.
        shares: Parts of the variance of that angle, by `Bands.variance_shares`.
    """

    bands: Bands
    notches: Int[np.ndarray, " n"]
    tension: Band
    angle: Band
    load: float
    tendon: int
    total_angle: Band
    by_depth: float
    shares: dict[str, float]


def closing_bands(robot: Robot, table: Closing) -> ClosingBands | None:
    """Propagate the tolerances of a robot to the closing of its notches.

    Args:
        robot: The robot, n notches.
        table: Result of `closing` for it.

    Returns:
        The bands; None where no notch closes.
    """
    if not np.isfinite(table.tension).any():
        return None
    first = int(np.nanargmin(table.tension))
    tendon = int(table.tendon[first])
    own = np.flatnonzero(np.isfinite(table.tension) & (table.tendon == tendon))
    load = 0.5 * float(table.tension[first])
    loads = np.linspace(0.0, _BEYOND * table.tension[own].max(), _STEPS)
    loads = np.sort(np.append(loads, load))
    names = ("total_angle", "notch_angle", "gap", "contact_force")
    bands = uncertain(robot, _pull(robot, tendon, loads), outputs=names, draws=_DRAWS)
    gaps, forces = (bands.samples[name][:, :, own] for name in ("gap", "contact_force"))
    stiffness = np.asarray(bands.path.chain.contact_stiffness)[own]
    angles = bands.samples["notch_angle"][:, :, own]
    tension, angle = _closing(loads, gaps, forces > gaps * stiffness, angles)
    step = int(np.searchsorted(loads, load))
    total = band(bands.samples["total_angle"][:, step])
    shares = bands.variance_shares("total_angle", step)
    by_depth = _by_depth(robot, _pull(robot, tendon, np.array([load])))
    # Of tensions of which some are infinite.
    finite = band(np.minimum(tension, _NEVER))
    ends = (finite.low, finite.median, finite.high)
    closing = Band(*(np.where(end < _NEVER, end, np.inf) for end in ends)), band(angle)
    return ClosingBands(bands, own + 1, *closing, load, tendon, total, by_depth, shares)


def closing_document(closing_bands: ClosingBands) -> dict[str, Any]:
    """Return the document of `notchflex show --json` on tolerances, in output units."""
    return {
        "draws": closing_bands.bands.draws,
        "tolerances": {one.value: one.written for one in closing_bands.bands.tolerances},
        "assumed": list(closing_bands.bands.assumed),
        "tendon": closing_bands.tendon,
        "notches": closing_bands.notches,
        "closing_tension_N": _ends(closing_bands.tension),
        "closing_angle_deg": _ends(closing_bands.angle, DEGREES),
        "load_N": closing_bands.load,
        "total_angle_deg": _ends(closing_bands.total_angle, DEGREES),
        "total_angle_variance_shares": closing_bands.shares,
        "total_angle_deg_by_10um_depth": closing_bands.by_depth * DEGREES,
    }


def _ends(one: Band, scale: float = 1.0) -> dict[str, Any]:
    ends = {"low": one.low, "median": one.median, "high": one.high}
    return {name: np.where(np.isfinite(end), end * scale, np.nan) for name, end in ends.items()}


def _pull(robot: Robot, tendon: int, loads: Float[np.ndarray, " s"]) -> LoadPath:
    """Pull one tendon (from 1), the others slack."""
    tensions = np.zeros((len(loads), robot.number_of_tendons))
    tensions[:, tendon - 1] = loads
    return LoadPath(tensions)


def _closing(
    loads: Float[np.ndarray, " s"],
    gaps: Float[np.ndarray, "d s n"],
    closed: Bool[np.ndarray, "d s n"],
    angles: Float[np.ndarray, "d s n"],
) -> tuple[Float[np.ndarray, "d n"], Float[np.ndarray, "d n"]]:
    """Compute tension and angle at which each notch of each draw closes.

    The gap falls almost evenly until it is closed and stands still then, so the last two open
    steps are continued.
    """
    step = np.argmax(closed, axis=1)[:, None]
    near, far = (
        np.take_along_axis(gaps, np.maximum(step - back, 0), axis=1)[:, 0] for back in (1, 2)
    )
    step = step[:, 0]
    before, after = loads[np.maximum(step - 1, 0)], loads[step]
    earlier = loads[np.maximum(step - 2, 0)]
    with np.errstate(divide="ignore", invalid="ignore"):
        extrapolated = before + near * (before - earlier) / (far - near)
    tension = np.where(step > 1, np.clip(extrapolated, before, after), 0.5 * (before + after))
    angle = np.take_along_axis(angles, step[:, None], axis=1)[:, 0]
    closes = closed.any(axis=1)
    failed = np.isnan(gaps).any(axis=1)
    never = np.where(failed, np.nan, np.inf)
    return np.where(closes, tension, never), np.where(closes, angle, np.nan)


def _by_depth(robot: Robot, load: LoadPath) -> float:
    """Return the change of the total angle for each 10 µm of depth, by a central difference."""
    exact = robot.replace(tolerance=None)
    try:
        depths = numbers_at(robot, "notch.depth")
        both = [
            exact.with_values({name: depth + sign * DEPTH for name, depth in depths.items()})
            for sign in (1.0, -1.0)
        ]
    except InputError:  # no depth, or a spine thinner than that
        return float("nan")
    deeper, shallower = solve_batch(both, load, outputs=("total_angle",))["total_angle"]
    return 0.5 * float(deeper - shallower)
