"""A tolerance analysis in files: a document for JSON, and columns with a row for every robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from notchflex import InputError
from notchflex.pieces import CODES
from notchflex.support import document_head
from notchflex.tolerancing.analysis import WORST_SD, ToleranceAnalysis
from notchflex.tolerancing.study import DrawnPieces, limited_columns

PERCENTILES = (2.5, 50.0, 97.5)


def tolerance_document(analysis: ToleranceAnalysis) -> dict[str, Any]:
    """Return a tolerance analysis as a document of plain values, at the edge units.

    Args:
        analysis: The analysis.

    Returns:
        `yield` (with `interval`), `limits`, one for each number that has limits, and `sources`, one
        for each deviation. Angles in deg, lengths in mm, forces in N.
    """
    return {
        **document_head(analysis.robot),
        "draws": analysis.draws,
        "seed": analysis.seed,
        "tolerances": {one.value: one.written for one in analysis.tolerances},
        "assumed": list(analysis.assumed),
        "yield": {
            "accepted": analysis.accepted_fraction,
            "interval": list(analysis.interval),
            "wanted": analysis.wanted_yield,
            "counts": analysis.counts,
        },
        "worst_case_sd": WORST_SD,
        "limits": _limits(analysis),
        "sources": _sources(analysis),
        "sobol_robots": analysis.sobol.robots,
        "sobol_failed": analysis.sobol.failed,
        "control_robots": analysis.control.robots,
    }


def _limits(analysis: ToleranceAnalysis) -> list[dict[str, Any]]:
    linear = analysis.linear
    values = {
        "drawing": linear.nominal,
        "worst_case": linear.worst_case,
        "rss_mean": linear.mean,
        "rss_sd": linear.sd,
    }
    parts = {f"{level:g}": analysis.percentile(level / 100.0) for level in PERCENTILES}
    documents: list[dict[str, Any]] = []
    for index, criterion in enumerate(analysis.criteria):
        scale = criterion.quantity.scale
        # A limit that was turned to rad and back has a rounding error.
        ends = {end: float(f"{getattr(criterion, end) * scale:.12g}") for end in ("lower", "upper")}
        documents.append(
            {
                "name": criterion.name,
                "quantity": criterion.quantity.name,
                "unit": criterion.quantity.unit,
                "load": criterion.load,
                "step": criterion.step + 1,
                **{end: value if np.isfinite(value) else None for end, value in ends.items()},
                **{name: column[index] * scale for name, column in values.items()},
                "percentiles": {level: part[index] * scale for level, part in parts.items()},
                "below": analysis.below[index],
                "above": analysis.above[index],
            }
        )
    return documents


def _sources(analysis: ToleranceAnalysis) -> list[dict[str, Any]]:
    """Return what is found of every deviation; lists are in the order of `limits`."""
    sobol, control = analysis.sobol, analysis.control
    scales = np.array([criterion.quantity.scale for criterion in analysis.criteria])
    return [
        {
            "name": name,
            "one_sd": analysis.linear.spread[:, index] * scales,
            "variance_share": analysis.linear.share[:, index],
            "sobol_first": sobol.first[:-1, index],
            "sobol_total": sobol.total[:-1, index],
            "sobol_total_of_acceptance": sobol.total[-1, index],
            "yield_if_exact": control.exact[index],
            "allowed_factor": None if control.factor is None else control.factor[index],
        }
        for index, name in enumerate(analysis.sources)
    ]


def tolerance_columns(analysis: ToleranceAnalysis) -> dict[str, Sequence[Any]]:
    """Return the drawn robots as columns: their numbers, those with limits, and what became of it.

    Args:
        analysis: The analysis.

    Returns:
        `robot` from 1, the numbers that deviate by name (mm, N, MPa, deg), the numbers that have
        limits with their unit, empty where there is no result, and `outcome`: accepted, rejected,
        NOT_CONVERGED or INVALID_ROBOT.

    Raises:
        InputError: They were drawn in pieces.
    """
    drawn = analysis.drawn
    if isinstance(drawn, DrawnPieces):
        raise InputError.UNSUPPORTED(
            f"the drawn robots are rows of the files in {drawn.directory}; read those."
        )
    columns = {**drawn.numbers, **limited_columns(analysis.criteria, drawn.outcomes.values)}
    return {
        "robot": range(1, analysis.draws + 1),
        **{name: values.tolist() for name, values in columns.items()},
        "outcome": [CODES[code] for code in drawn.outcomes.codes],
    }
