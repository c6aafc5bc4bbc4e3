"""What was measured over the load, with the model and its band, and what is left between them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from notchflex.plot.style import BLUE, GREY, sequence_colours
from notchflex.results.quantities import QUANTITIES

if TYPE_CHECKING:
    from notchflex.calibrate import Calibration

MARKERS = "osD^vP*X"
# Of a robot with more notches some are drawn.
MOST_NOTCHES = 6


class Part(NamedTuple):
    """A measured number of every row: robot, quantity, and its component as residuals have it."""

    label: str
    quantity: str
    component: int
    title: str


class _Line(NamedTuple):
    """The rows of one pull, or of all pulls from rest of one file, in the order of a line."""

    x: NDArray[np.float64]
    measured: NDArray[np.float64]
    model: NDArray[np.float64]
    half: NDArray[np.float64]
    pulls: NDArray[np.intp]


def parts_shown(found: Calibration, label: str) -> list[Part]:
    """What is drawn of a robot: some notches, and one panel for each other number."""
    from notchflex.calibrate.measurements import OBSERVED

    residuals = found.residuals
    own = residuals.robot == list(found.given).index(label)
    parts: list[Part] = []
    for number, quantity in enumerate(OBSERVED):
        there = np.unique(residuals.part[own & (residuals.quantity == number)])
        if quantity == "axis_points":  # thirty points and more: their residuals tell
            continue
        if len(there) > MOST_NOTCHES:
            spread = np.linspace(0, len(there) - 1, MOST_NOTCHES).round().astype(int)
            there = there[spread]
        parts += [Part(label, quantity, int(one), _title(quantity, int(one))) for one in there]
    return parts


def draw_data(axes: Axes, *, found: Calibration, part: Part) -> None:
    """Draw one number over the load: measured, model, and the band of the model."""
    from notchflex.calibrate.errors_of_parts import edge

    _, unit, scale = edge(part.quantity)
    for line in _lines(found, part):
        measured, model, half = (one * scale for one in (line.measured, line.model, line.half))
        if np.isfinite(half).all():
            axes.fill_between(
                line.x, model - half, model + half, color=BLUE, alpha=0.25, linewidth=0.0
            )
        axes.plot(line.x, model, color=BLUE, zorder=3)
        for pull in np.unique(line.pulls):
            mine = line.pulls == pull
            axes.plot(line.x[mine], measured[mine], **_marker(int(pull)))
    axes.set_title(
        f"{part.label}: {part.title}" if len(found.given) > 1 else part.title, loc="left"
    )
    axes.set_xlabel(_abscissa(found, part.label)[1])
    axes.set_ylabel(f"{_kind(part.quantity)} [{unit}]")


def draw_residuals(axes: Axes, *, found: Calibration, label: str) -> None:
    """Draw what is left of every number of a robot over its noise; notches by colour."""
    from notchflex.calibrate.measurements import OBSERVED

    residuals = found.residuals
    own = residuals.robot == list(found.given).index(label)
    scaled = residuals.values / found.noise.deviation
    x = _abscissa(found, label)[0]
    axes.axhspan(-1.96, 1.96, color=GREY, alpha=0.15, linewidth=0.0)
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    angles = own & (residuals.quantity == OBSERVED.index("notch_angle"))
    notches = np.unique(residuals.part[angles])
    for notch, colour in zip(notches, sequence_colours(len(notches)), strict=True):
        mine = angles & (residuals.part == notch)
        name = f"{notch + 1}" if notch in (notches[0], notches[-1]) or len(notches) < 8 else None
        axes.plot(x[mine], scaled[mine], "o", color=colour, markersize=3.0, label=name)
    other = own & ~angles
    if other.any():
        axes.plot(
            x[other], scaled[other], "x", color=GREY, markersize=3.5, label="others", zorder=1
        )
    title = "model less measured"
    axes.set_title(f"{label}: {title}" if len(found.given) > 1 else title, loc="left")
    axes.set_xlabel(_abscissa(found, label)[1])
    axes.set_ylabel("residual / its noise")
    if len(notches):
        most = max(2.2, 1.1 * float(np.max(np.abs(scaled[own]))))
        axes.set_ylim(-most, 2.0 * most)  # room for the names of the colours
        axes.legend(
            title="notch",
            fontsize=6.5,
            title_fontsize=6.5,
            ncols=4,
            handletextpad=0.0,
            columnspacing=0.6,
            loc="upper center",
        )


def _lines(found: Calibration, part: Part) -> list[_Line]:
    """The rows of a part as lines: all from rest of a file by load, or pull by pull in order."""
    from notchflex.calibrate.measurements import OBSERVED

    residuals = found.residuals
    own = (
        (residuals.robot == list(found.given).index(part.label))
        & (residuals.quantity == OBSERVED.index(part.quantity))
        & (residuals.part == part.component)
    )
    x = _abscissa(found, part.label)[0]
    half = _half_width(found)
    lines: list[_Line] = []
    for number in np.unique(residuals.sample[own]):
        measured = found.problem.samples.every[number].measured
        mine = np.flatnonzero(own & (residuals.sample == number))
        groups = [mine[np.argsort(x[mine], kind="stable")]]
        if not measured.from_rest:
            groups = [mine[residuals.pull[mine] == one] for one in np.unique(residuals.pull[mine])]
        for rows in groups:
            model = _model(found, rows, part, measured)
            values = model - residuals.values[rows]
            lines.append(_Line(x[rows], values, model, half[rows], residuals.pull[rows]))
    return lines


def _half_width(found: Calibration) -> NDArray[np.float64]:
    """Half the 95 % band of the model at every residual; NaN where it has no end."""
    from scipy.stats import t

    slopes = found.residuals.slopes
    known = np.isfinite(np.diag(found.covariance))
    covariance = found.covariance[np.ix_(known, known)]
    variance = np.einsum("ri,ij,rj->r", slopes[:, known], covariance, slopes[:, known])
    # A constant that is not known at all only matters where the model depends on it.
    variance[slopes[:, ~known].any(axis=1)] = np.nan
    return float(t.ppf(0.975, max(found.freedom, 1))) * np.sqrt(np.maximum(variance, 0.0))


def _model(
    found: Calibration, rows: NDArray[np.intp], part: Part, measured: Any
) -> NDArray[np.float64]:
    """The model's number at some residuals: what was measured, and what the model is more."""
    table = measured.observed[part.quantity]
    if part.quantity == "tip_position":  # residuals are in the frame of the base
        from notchflex._jax import constant
        from notchflex.motion import rotation_about

        table = table @ np.asarray(rotation_about(constant(measured.load.base_rotation)))
    seen = table.reshape(len(table), -1)[found.residuals.row[rows], part.component]
    return seen + found.residuals.values[rows]


def _abscissa(found: Calibration, label: str) -> tuple[NDArray[np.float64], str]:
    """What was done to a tendon at every residual of a robot, and the label of its axis."""
    residuals = found.residuals
    x = np.full(len(residuals), np.nan)
    samples = found.problem.samples.every
    mine = [(number, one) for number, one in enumerate(samples) if one.label == label]
    for name in ("tension", "stroke"):
        tables = {number: getattr(one.measured.load, name) for number, one in mine}
        first = next(iter(tables.values()))
        for tendon in range(first.shape[1]):
            columns = {number: table[:, tendon] for number, table in tables.items()}
            varied = np.concatenate(list(columns.values()))
            if not np.isfinite(varied).all() or np.ptp(varied) == 0.0:
                continue
            for number, column in columns.items():
                there = residuals.sample == number
                x[there] = column[residuals.row[there]]
            one_of_many = f" {tendon + 1}" if first.shape[1] > 1 else ""
            row = QUANTITIES[name]
            return x, row.label.replace(row.title, row.title + one_of_many, 1)
    for number, _ in mine:
        there = residuals.sample == number
        x[there] = residuals.row[there] + 1
    return x, "row"


def _marker(pull: int) -> dict[str, Any]:
    return {
        "linestyle": "",
        "marker": MARKERS[pull % len(MARKERS)],
        "markersize": 3.2,
        "markerfacecolor": "none",
        "markeredgecolor": GREY,
        "markeredgewidth": 0.8,
    }


def _kind(quantity: str) -> str:
    if quantity in ("notch_angle", "total_angle", "tip_rotation"):
        return "angle"
    return "tension" if quantity == "tip_tension" else "position"


def _title(quantity: str, component: int) -> str:
    from notchflex.calibrate.errors_of_parts import edge, part_title

    if quantity in ("tip_position", "tip_rotation"):
        return f"{edge(quantity)[0]}, {'xyz'[component]}"
    return part_title(quantity, 0 if quantity == "total_angle" else component + 1)
