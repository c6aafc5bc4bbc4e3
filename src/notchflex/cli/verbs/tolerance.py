"""`notchflex tolerance`: worst case, yield and sensitivity of a robot with tolerances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import NO_FOLDER, InPieces, Refinement, TableOutputs, as_csv, integer
from notchflex.cli.robots import RobotName, Settings, changed_title, chosen_robot, robot_files

if TYPE_CHECKING:
    from notchflex.tolerancing import ToleranceAnalysis

_MOST_ROWS = 20
"""Limits and sources with a row of their own; the JSON has all."""

_LEGEND = (
    "worst case: all deviations at their worse ends. rss sd: standard deviation by gradients. "
    "outside: of the drawn robots.",
    "variance: share of the RSS variance of a limit; those of one limit add up to 100 %, and a row "
    "has its largest of all limits. Sobol: the same of the drawn robots, from 0 to 1, by the "
    "deviation alone (first) and with the others (total). yield if exact: without this deviation. "
    "allowed tolerance: the part of it that alone gives the wanted yield (0: none does, –: any).",
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
        analysis,
        tolerance_document,
        lambda analysis: _print(
            analysis, tolerance_document(analysis), changed_title(chosen, settings)
        ),
        csv=as_csv(tolerance_columns),
    )
    for sentence in analysis.warnings():
        terminal.warn(sentence)


def _print(analysis: ToleranceAnalysis, document: dict[str, Any], title: str) -> None:
    """Print limits, yield and sources of a tolerance analysis, that to control first at the top."""
    terminal.line(f"{title}: {analysis.draws} robots within the tolerances")
    terminal.show(
        *tables.tolerance_words(analysis.robot, analysis.tolerances, analysis.assumed), ""
    )
    limits: list[dict[str, Any]] = []
    for row in document["limits"]:
        entry, _, load = row["name"].partition(" ")
        unit = f" [{row['unit']}]" if row["unit"] else ""
        from_, to = row["worst_case"]
        drawn = {f"{level}%": row["percentiles"][level] for level in ("2.5", "97.5")}
        more = {"worst_from": from_, "to": to, **drawn}
        more["outside_%"] = 100.0 * (row["below"] + row["above"])
        limits.append({"limit": f"{entry}\n  {load}{unit}".rstrip(), **row, **more})
    keys = "limit lower upper drawing worst_from to rss_sd 2.5% 97.5% outside_%"
    _show(limits, keys)
    low, high = (100.0 * end for end in analysis.interval)
    wanted = analysis.wanted_yield
    terminal.show(
        "",
        tables.wrapped(
            f"Yield: {100.0 * analysis.accepted_fraction:.1f} % meet all limits "
            f"({low:.1f} to {high:.1f} %, 95 % interval)"
            + ("." if wanted is None else f"; {100.0 * wanted:.4g} % are wanted.")
        ),
        "",
    )
    sources = [
        {
            "deviation_of": row["name"],
            "variance_%": 100.0 * max(row["variance_share"]),
            "Sobol_first": max(np.nan_to_num(row["sobol_first"])),
            "Sobol_total": max(np.nan_to_num(row["sobol_total"])),
            "yield_if_exact_%": 100.0 * row["yield_if_exact"],
            "allowed_tolerance": row["allowed_factor"],
        }
        for row in (document["sources"][index] for index in analysis.order)
    ]
    _show(sources)
    terminal.show("", *map(tables.wrapped, (*_LEGEND, _advice(analysis))))


def _show(rows: list[dict[str, Any]], keys: str = "") -> None:
    tables.show(rows[:_MOST_ROWS], keys, {"allowed_tolerance": ".2f"})
    if len(rows) > _MOST_ROWS:
        terminal.line(f"... and {len(rows) - _MOST_ROWS} more; --json has all.")


def _advice(analysis: ToleranceAnalysis) -> str:
    """Say which dimension to control."""
    best = int(analysis.order[0])
    name, exact = analysis.sources[best], 100.0 * analysis.control.exact[best]
    part = 100.0 * analysis.accepted_fraction
    if exact - part >= 0.1:
        return (
            f"Control {name} first: if it were exact, the yield would be {exact:.1f} % instead of "
            f"{part:.1f} %."
        )
    if part < 99.9:
        return (
            "No single dimension brings more yield, however exact: change the drawing, the limits, "
            "or several tolerances."
        )
    return "All robots meet the limits; tolerances may be wider."
