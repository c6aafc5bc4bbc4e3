"""Tables of `notchflex tolerance`."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

from notchflex.cli import terminal
from notchflex.cli.tables.tolerance_lines import tolerance_words

if TYPE_CHECKING:
    from notchflex.tolerancing import ToleranceAnalysis

_MOST = 20
"""Limits and sources with a row of their own; the JSON has all."""


def print_tolerances(found: ToleranceAnalysis, title: str) -> None:
    """Print limits, yield and sources of a tolerance analysis."""
    console = terminal.output()
    console.print(f"{title}: {found.draws} robots within the tolerances", soft_wrap=True)
    for line in tolerance_words(found.robot, found.tolerances, found.assumed):
        console.print(line)
    console.print()
    heads = [
        "limit\n", ">lower\n", ">upper\n", ">drawing\n", ">worst\nfrom", ">case\nto", ">RSS\nsd",
        ">draws\n2.5 %", ">\n97.5 %", ">outside\n%",
    ]  # fmt: skip
    console.print(terminal.table(heads, _limit_rows(found)[:_MOST]))
    _print_more(len(found.criteria), "limits")
    console.print()
    for line in _yield_lines(found):
        console.print(line)
    console.print()
    heads = ["deviation of\n", ">variance\n%", ">Sobol\nfirst", ">\ntotal", ">yield if\nexact, %"]
    heads += [] if found.control.factor is None else [">allowed\ntolerance"]
    console.print(terminal.table(heads, _source_rows(found)[:_MOST]))
    _print_more(len(found.sources), "deviations")
    console.print()
    for line in textwrap.wrap(" ".join(advice(found)), width=terminal.NARROW - 1):
        console.print(line)


def _print_more(count: int, what: str) -> None:
    if count > _MOST:
        terminal.output().print(f"... and {count - _MOST} more {what}; --json has all.")


def _limit_rows(found: ToleranceAnalysis) -> list[list[str]]:
    low, high = found.percentile(0.025), found.percentile(0.975)
    outside, linear = found.below + found.above, found.linear
    rows: list[list[str]] = []
    for index, one in enumerate(found.criteria):
        scale, unit = one.quantity.scale, one.quantity.unit
        worst = linear.worst_case[index] * scale
        ends = [linear.nominal[index], *(worst / scale), linear.sd[index], low[index], high[index]]
        cells = [_number(one.lower * scale), _number(one.upper * scale)]
        cells += [_number(end * scale) for end in ends]
        entry, _, place = one.name.partition(" ")
        more = " ".join([place, f"[{unit}]" if unit else ""]).strip()
        name = f"{entry}\n  {more}" if more else entry
        rows.append([name, *cells, f"{100.0 * outside[index]:.1f}"])
    return rows


def _source_rows(found: ToleranceAnalysis) -> list[list[str]]:
    """Return a row for each source, that to control first at the top; parts are the largest."""
    import numpy as np

    first, total = (
        np.nan_to_num(one[:-1]).max(axis=0) for one in (found.sobol.first, found.sobol.total)
    )
    share, factor = found.linear.share.max(axis=0), found.control.factor
    rows: list[list[str]] = []
    for index in found.order:
        row = [
            found.sources[index], f"{100.0 * share[index]:.1f}", f"{first[index]:.2f}",
            f"{total[index]:.2f}", f"{100.0 * found.control.exact[index]:.1f}",
        ]  # fmt: skip
        rows.append(row if factor is None else [*row, _factor(float(factor[index]))])
    return rows


def _factor(factor: float) -> str:
    if factor == 0.0:
        return "none"
    return "any" if math.isinf(factor) else f"x {factor:.2f}"


def _yield_lines(found: ToleranceAnalysis) -> list[str]:
    low, high = (100.0 * end for end in found.interval)
    text = (
        f"Yield: {100.0 * found.accepted_fraction:.1f} % meet all limits ({low:.1f} to {high:.1f} "
        f"%, 95 % interval)"
    )
    if found.wanted_yield is not None:
        text += f"; {100.0 * found.wanted_yield:.4g} % are wanted"
    return textwrap.wrap(f"{text}.", width=terminal.NARROW - 1)


def advice(found: ToleranceAnalysis) -> list[str]:
    """Return which dimension to control, and what its tolerance must be."""
    best = int(found.order[0])
    name, exact = found.sources[best], found.control.exact[best]
    part = 100.0 * found.accepted_fraction
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
    factor, wanted = found.control.factor, found.wanted_yield
    if factor is None or wanted is None:
        return sentences
    enough = [index for index in found.order if 0.0 < factor[index] < 1.0]
    if found.accepted_fraction >= wanted:
        sentences.append("The wanted yield is reached.")
    elif enough:
        ways = [f"{found.sources[one]} to {factor[one]:.2f} of its tolerance" for one in enough[:3]]
        sentences.append(f"For {100.0 * wanted:.4g} % reduce {', or '.join(ways)}.")
    else:
        sentences.append(
            f"No single tolerance, however small, gives {100.0 * wanted:.4g} %: reduce several, or "
            "move the drawing to the middle of the limits."
        )
    return sentences


def _number(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "-"
