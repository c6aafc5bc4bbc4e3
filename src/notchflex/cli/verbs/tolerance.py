"""`notchflex tolerance`: worst case, yield and sensitivity of a robot with tolerances."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import NO_FOLDER, InPieces, Refinement, TableOutputs, integer
from notchflex.cli.robots import RobotName, Settings, changed_title, chosen_robot, robot_files

if TYPE_CHECKING:
    from notchflex.tolerancing import ToleranceAnalysis

_MOST_ROWS = 20
"""Limits and sources with a row of their own; the JSON has all."""

_LEGEND = (
    "worst case: all deviations at their worse ends. RSS sd: standard deviation by gradients. "
    "outside: of the drawn robots.",
    "variance: share of the RSS variance of a limit; those of one limit add up to 100 %, and a row "
    "has its largest of all limits. Sobol: the same of the drawn robots, from 0 to 1, by the "
    "deviation alone (first) and with the others (total). yield if exact: without this deviation. "
    "allowed tolerance: the part of it that alone gives the wanted yield.",
)


def tolerance(
    robot: RobotName,
    tolerances: Annotated[str, Parameter(metavar="TOLERANCES.toml")],
    /,
    *,
    draws: Annotated[int, integer(50, 10_000_000_000)] = 100_000,
    seed: Annotated[int, integer(0)] = 0,
    refinement: Refinement = 0,
    settings: Settings = (),
    pieces: InPieces = NO_FOLDER,
    outputs: TableOutputs = TableOutputs(),
) -> None:
    """Find out what tolerances do to a robot that must meet acceptance limits.

    Prints for every limit the value of the drawing, worst case and root sum of squares (by
    gradients), and the percentiles of drawn robots; the yield with its 95 % interval; and for every
    tolerance its part of the variance (Sobol indices), the yield if that dimension were exact, and
    the tolerance that is allowed for the wanted yield. The CSV has a row for every drawn robot.

    Args:
        tolerances: A TOML file, which `notchflex new NAME --tolerance` writes: `[load.NAME]` (the
            options of `simulate` as keys), `[[accept]]` (`quantity`, `lower`, `upper`), and if
            wanted `[tolerance]`, as in a robot file, and `wanted_yield`. Without `[tolerance]`
            those of the robot hold.
        draws: About how many robots are drawn: 25 independent sets of scrambled Sobol points, each
            as large as the nearest power of two. More than 10 000 000 need `--folder`.
        seed: Seed of the draws.
    """
    inputs = [*robot_files(robot), tolerances]
    outputs.check(inputs)
    chosen = chosen_robot(robot, settings)
    folder = pieces.chosen("tolerance", inputs)
    if folder is None and draws > 10_000_000:
        raise InputError.OUT_OF_RANGE(
            f"--draws {draws}: more than 10000000 draws need --folder DIR, which keeps them in "
            "pieces."
        )
    if folder is not None and outputs.csv is not None:
        raise InputError.CONFLICT(
            "--csv and --folder exclude each other: the rows are the files in the folder."
        )
    with terminal.progress(f"reading {tolerances}") as progress:
        from notchflex.tolerancing import tolerance_analysis

        analysis = tolerance_analysis(
            chosen, tolerances, draws=draws, seed=seed, refinement=refinement, progress=progress,
            folder=folder,
        )  # fmt: skip
    from notchflex.tolerancing import tolerance_columns, tolerance_document

    outputs.write(
        lambda: tolerance_document(analysis),
        columns=lambda: tolerance_columns(analysis),
        picture=analysis,
    )
    for sentence in analysis.warnings():
        terminal.warn(sentence)
    if outputs.prints_tables:
        print_tolerances(analysis, changed_title(chosen, settings))


def print_tolerances(analysis: ToleranceAnalysis, title: str) -> None:
    """Print limits, yield and sources of a tolerance analysis."""
    console = terminal.output()
    console.print(f"{title}: {analysis.draws} robots within the tolerances", soft_wrap=True)
    for line in tables.tolerance_words(analysis.robot, analysis.tolerances, analysis.assumed):
        console.print(line)
    console.print()
    tables.show(_limits(analysis))
    _print_more(len(analysis.criteria), "limits")
    console.print()
    low, high = (100.0 * end for end in analysis.interval)
    wanted = analysis.wanted_yield
    tables.say(
        f"Yield: {100.0 * analysis.accepted_fraction:.1f} % meet all limits "
        f"({low:.1f} to {high:.1f} %, 95 % interval)"
        + ("." if wanted is None else f"; {100.0 * wanted:.4g} % are wanted.")
    )
    console.print()
    tables.show(_sources(analysis))
    _print_more(len(analysis.sources), "deviations")
    console.print()
    tables.say(*_LEGEND, " ".join(advice(analysis)))


def _print_more(count: int, what: str) -> None:
    if count > _MOST_ROWS:
        terminal.output().print(f"... and {count - _MOST_ROWS} more {what}; --json has all.")


def _limits(analysis: ToleranceAnalysis) -> list[tuple[str, Iterable[Any], str]]:
    """Return a row for each limit: its bounds, the drawing, the worst case and the draws."""
    criteria, linear = analysis.criteria[:_MOST_ROWS], analysis.linear
    names: list[str] = []
    for one in criteria:
        entry, _, more = one.name.partition(" ")
        more = f"{more} [{one.quantity.unit}]" if one.quantity.unit else more
        names.append(f"{entry}\n  {more.strip()}" if more else entry)
    columns = {
        "lower\n": [one.lower for one in criteria],
        "upper\n": [one.upper for one in criteria],
        "drawing\n": linear.nominal,
        "worst\nfrom": linear.worst_case[:, 0],
        "case\nto": linear.worst_case[:, 1],
        "RSS\nsd": linear.sd,
        "draws\n2.5 %": analysis.percentile(0.025),
        "\n97.5 %": analysis.percentile(0.975),
    }
    outside = 100.0 * (analysis.below + analysis.above)
    return [
        ("limit\n", names, ""),
        *(
            (
                head,
                [one.quantity.scale * end for one, end in zip(criteria, ends, strict=False)],
                ".3g",
            )
            for head, ends in columns.items()
        ),
        ("outside\n%", outside[:_MOST_ROWS], ".1f"),
    ]


def _sources(analysis: ToleranceAnalysis) -> list[tuple[str, Iterable[Any], str]]:
    """Return a row for each source, that to control first at the top; parts are the largest."""
    import numpy as np

    order, control, sobol = analysis.order[:_MOST_ROWS], analysis.control, analysis.sobol
    columns: list[tuple[str, Iterable[Any], str]] = [
        ("deviation of\n", [analysis.sources[index] for index in order], ""),
        ("variance\n%", 100.0 * analysis.linear.share.max(axis=0)[order], ".1f"),
        ("Sobol\nfirst", np.nan_to_num(sobol.first[:-1]).max(axis=0)[order], ".2f"),
        ("\ntotal", np.nan_to_num(sobol.total[:-1]).max(axis=0)[order], ".2f"),
        ("yield if\nexact, %", 100.0 * control.exact[order], ".1f"),
    ]
    if control.factor is not None:
        parts = [
            "none" if not factor else "any" if math.isinf(factor) else f"x {factor:.2f}"
            for factor in control.factor[order].tolist()
        ]
        columns.append(("allowed\ntolerance", parts, ">"))
    return columns


def advice(analysis: ToleranceAnalysis) -> list[str]:
    """Return which dimension to control, and what its tolerance must be."""
    best = int(analysis.order[0])
    name, exact = analysis.sources[best], 100.0 * analysis.control.exact[best]
    part = 100.0 * analysis.accepted_fraction
    if exact - part >= 0.1:
        first = (
            f"Control {name} first: if it were exact, the yield would be {exact:.1f} % instead of "
            f"{part:.1f} %."
        )
    elif part < 99.9:
        first = (
            "No single dimension brings more yield, however exact: change the drawing, the limits, "
            "or several tolerances."
        )
    else:
        first = "All robots meet the limits; tolerances may be wider."
    factor, target = analysis.control.factor, analysis.wanted_yield
    if factor is None or target is None:
        return [first]
    ways = [
        f"{analysis.sources[index]} to {factor[index]:.2f} of its tolerance"
        for index in analysis.order
        if 0.0 < factor[index] < 1.0
    ]
    if analysis.accepted_fraction >= target:
        return [first, "The wanted yield is reached."]
    if ways:
        return [first, f"For {100.0 * target:.4g} % reduce {', or '.join(ways[:3])}."]
    return [
        first,
        f"No single tolerance, however small, gives {100.0 * target:.4g} %: reduce several, or "
        "move the drawing to the middle of the limits.",
    ]
