"""Tables of `notchflex tolerance`, and the effect of tolerances as a few lines."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

from notchflex.cli import terminal
from notchflex.support import DEGREES, described_at

if TYPE_CHECKING:
    from notchflex import Band, Bands, Robot
    from notchflex.analysis.bands import ClosingBands
    from notchflex.support import Tolerance
    from notchflex.tolerancing import ToleranceAnalysis


def closing_lines(robot: Robot, bands: ClosingBands) -> list[str]:
    """Return what `show` says: closing, a typical load, 10 µm of depth, and what was assumed."""
    first, last = int(bands.tension.median.argmin()), int(bands.tension.median.argmax())
    words = [_closing(bands, one) for one in dict.fromkeys((first, last))]
    pulled = f" of tendon {bands.tendon}" if robot.number_of_tendons > 1 else ""
    text = (
        f"Accuracy: of {bands.bands.draws} draws within the tolerances, 5 to 95 % give: "
        f"{'; '.join(words)}; total angle at {bands.load:.3g} N{pulled}: "
        f"{_range(bands.total_angle, '.1f', DEGREES)} deg."
    )
    if bands.shares:
        parts = sorted(bands.shares.items(), key=lambda part: -part[1])
        words = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in parts if share > 0.005)
        text += f" Of the variance of that angle: {words}."
    if math.isfinite(bands.by_depth):
        change = abs(bands.by_depth) * DEGREES
        text += f" 10 µm of depth in all notches change that angle by {change:.2g} deg."
    return [*_wrapped(text), *tolerance_lines(bands.bands)]


def tolerance_lines(bands: Bands) -> list[str]:
    """Return the tolerances that bands were made with, and which of them were assumed."""
    return tolerance_words(bands.path.robot, bands.tolerances, bands.assumed)


def tolerance_words(
    robot: Robot, tolerances: Iterable[Tolerance], names: Collection[str]
) -> list[str]:
    """Return tolerances in lines of text.

    Args:
        robot: The robot.
        tolerances: Its tolerances.
        names: Of the values whose tolerance is assumed.
    """
    tolerances = list(tolerances)
    given = [_words(robot, one) for one in tolerances if one.value not in names]
    assumed = [_words(robot, one) for one in tolerances if one.value in names]
    lines = _wrapped(f"Tolerances: {', '.join(given)}.") if given else []
    if assumed:
        text = f"Tolerances assumed: {', '.join(assumed)}. A [tolerance] table in the robot file"
        lines += _wrapped(f"{text} replaces them.")
    return lines


def _closing(bands: ClosingBands, step: int) -> str:
    tensions = _range(bands.tension, ".3g", step=step)
    angles = _range(bands.angle, ".1f", DEGREES, step)
    return f"notch {bands.notches[step]} closes at {tensions} N and {angles} deg"


def _range(band: Band, form: str, scale: float = 1.0, step: int | None = None) -> str:
    ends = [band.low, band.high] if step is None else [band.low[step], band.high[step]]
    low, high = (float(end) * scale for end in ends)
    if math.isinf(high):
        return f"{low:{form}} or more" if math.isfinite(low) else "no"
    return f"{low:{form}} to {high:{form}}"


def _words(robot: Robot, one: Tolerance) -> str:
    """Return a tolerance in words, such as "notch.depth 0.01 mm"."""
    unit = described_at(robot, one.value).unit

    def size(value: object) -> str:
        return value if isinstance(value, str) else f"{value:g} {unit}".strip()

    if one.sd is not None:
        words = f"{one.value} {size(one.sd)} (SD)"
    elif one.plus == one.minus:
        words = f"{one.value} ±{size(one.plus)}"
    else:
        words = f"{one.value} +{size(one.plus)} −{size(one.minus)}"
    return f"{words} each" if one.per_notch else words


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, width=terminal.NARROW - 1)


_MAX_ROWS = 20
"""Limits and sources with a row of their own; the JSON has all."""

_LEGEND = (
    "worst case: all deviations at their worse ends. RSS sd: standard deviation by gradients. "
    "outside: of the drawn robots.",
    "variance: share of the RSS variance of a limit; those of one limit add up to 100 %, and a row "
    "has its largest of all limits. Sobol: the same of the drawn robots, from 0 to 1, by the "
    "deviation alone (first) and with the others (total). yield if exact: without this deviation. "
    "allowed tolerance: the part of it that alone gives the wanted yield.",
)


def print_tolerances(analysis: ToleranceAnalysis, title: str) -> None:
    """Print limits, yield and sources of a tolerance analysis."""
    console = terminal.output()
    console.print(f"{title}: {analysis.draws} robots within the tolerances", soft_wrap=True)
    for line in tolerance_words(analysis.robot, analysis.tolerances, analysis.assumed):
        console.print(line)
    console.print()
    heads = [
        "limit\n", ">lower\n", ">upper\n", ">drawing\n", ">worst\nfrom", ">case\nto", ">RSS\nsd",
        ">draws\n2.5 %", ">\n97.5 %", ">outside\n%",
    ]  # fmt: skip
    console.print(terminal.table(heads, _limit_rows(analysis)[:_MAX_ROWS]))
    _print_more(len(analysis.criteria), "limits")
    console.print()
    for line in _yield_lines(analysis):
        console.print(line)
    console.print()
    heads = ["deviation of\n", ">variance\n%", ">Sobol\nfirst", ">\ntotal", ">yield if\nexact, %"]
    heads += [] if analysis.control.factor is None else [">allowed\ntolerance"]
    console.print(terminal.table(heads, _source_rows(analysis)[:_MAX_ROWS]))
    _print_more(len(analysis.sources), "deviations")
    for text in (*_LEGEND, " ".join(advice(analysis))):
        console.print()
        for line in textwrap.wrap(text, width=terminal.NARROW - 1):
            console.print(line)


def _print_more(count: int, what: str) -> None:
    if count > _MAX_ROWS:
        terminal.output().print(f"... and {count - _MAX_ROWS} more {what}; --json has all.")


def _limit_rows(analysis: ToleranceAnalysis) -> list[list[str]]:
    low, high = analysis.percentile(0.025), analysis.percentile(0.975)
    outside, linear = analysis.below + analysis.above, analysis.linear
    rows: list[list[str]] = []
    for index, one in enumerate(analysis.criteria):
        scale, unit = one.quantity.scale, one.quantity.unit
        worst = linear.worst_case[index] * scale
        ends = [linear.nominal[index], *(worst / scale), linear.sd[index], low[index], high[index]]
        cells = [_number(one.lower * scale), _number(one.upper * scale)]
        cells += [_number(end * scale) for end in ends]
        entry, _, entry_name = one.name.partition(" ")
        more = " ".join([entry_name, f"[{unit}]" if unit else ""]).strip()
        name = f"{entry}\n  {more}" if more else entry
        rows.append([name, *cells, f"{100.0 * outside[index]:.1f}"])
    return rows


def _source_rows(analysis: ToleranceAnalysis) -> list[list[str]]:
    """Return a row for each source, that to control first at the top; parts are the largest."""
    import numpy as np

    first, total = (
        np.nan_to_num(one[:-1]).max(axis=0) for one in (analysis.sobol.first, analysis.sobol.total)
    )
    share, factor = analysis.linear.share.max(axis=0), analysis.control.factor
    rows: list[list[str]] = []
    for index in analysis.order:
        row = [
            analysis.sources[index], f"{100.0 * share[index]:.1f}", f"{first[index]:.2f}",
            f"{total[index]:.2f}", f"{100.0 * analysis.control.exact[index]:.1f}",
        ]  # fmt: skip
        rows.append(row if factor is None else [*row, _factor(float(factor[index]))])
    return rows


def _factor(factor: float) -> str:
    if factor == 0.0:
        return "none"
    return "any" if math.isinf(factor) else f"x {factor:.2f}"


def _yield_lines(analysis: ToleranceAnalysis) -> list[str]:
    low, high = (100.0 * end for end in analysis.interval)
    text = (
        f"Yield: {100.0 * analysis.accepted_fraction:.1f} % meet all limits "
        f"({low:.1f} to {high:.1f} %, 95 % interval)"
    )
    if analysis.wanted_yield is not None:
        text += f"; {100.0 * analysis.wanted_yield:.4g} % are wanted"
    return textwrap.wrap(f"{text}.", width=terminal.NARROW - 1)


def advice(analysis: ToleranceAnalysis) -> list[str]:
    """Return which dimension to control, and what its tolerance must be."""
    best = int(analysis.order[0])
    name, exact = analysis.sources[best], analysis.control.exact[best]
    part = 100.0 * analysis.accepted_fraction
    sentences: list[str] = []
    if 100.0 * exact - part >= 0.1:
        sentences.append(
            f"Control {name} first: if it were exact, the yield would be {100.0 * exact:.1f} % "
            f"instead of {part:.1f} %."
        )
    else:
        sentences.append(
            "No single dimension brings more yield, however exact: change the drawing, the limits, "
            "or several tolerances."
            if part < 99.9
            else "All robots meet the limits; tolerances may be wider."
        )
    factor, target = analysis.control.factor, analysis.wanted_yield
    if factor is None or target is None:
        return sentences
    sufficient = [index for index in analysis.order if 0.0 < factor[index] < 1.0]
    if analysis.accepted_fraction >= target:
        sentences.append("The wanted yield is reached.")
    elif sufficient:
        ways = [
            f"{analysis.sources[one]} to {factor[one]:.2f} of its tolerance"
            for one in sufficient[:3]
        ]
        sentences.append(f"For {100.0 * target:.4g} % reduce {', or '.join(ways)}.")
    else:
        sentences.append(
            f"No single tolerance, however small, gives {100.0 * target:.4g} %: reduce several, or "
            "move the drawing to the middle of the limits."
        )
    return sentences


def _number(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "-"
