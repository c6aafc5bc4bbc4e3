"""A tolerance analysis in files: a document for JSON, and columns with a row for every robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from notchflex import InputError
from notchflex.pieces.folder import CODES
from notchflex.support import document_head
from notchflex.tolerancing.analysis import ToleranceAnalysis
from notchflex.tolerancing.linear import WORST_SD
from notchflex.tolerancing.study import DrawnPieces

PERCENTILES = (2.5, 50.0, 97.5)


def tolerance_document(analysis: ToleranceAnalysis) -> dict[str, Any]:
    """Return a tolerance analysis as a document of plain values, at the edge units.

    Args:
        analysis: The analysis.

    Returns:
        `yield` (with `interval`), `limits`, one for each number that has limits, and `sources`, one
        for each deviation. Angles in deg, lengths in mm, forces in N.
    """
    low, high = analysis.interval
    return {
        **document_head(analysis.robot),
        "draws": analysis.draws,
        "seed": analysis.seed,
        "tolerances": {one.value: one.written for one in analysis.tolerances},
        "assumed": list(analysis.assumed),
        "yield": {
            "accepted": analysis.accepted_fraction,
            "interval": [low, high],
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
    parts = [analysis.percentile(part / 100.0) for part in PERCENTILES]
    below, above, linear = analysis.below, analysis.above, analysis.linear
    documents: list[dict[str, Any]] = []
    for index, one in enumerate(analysis.criteria):
        scale = one.quantity.scale
        documents.append(
            {
                "name": one.name,
                "quantity": one.quantity.name,
                "unit": one.quantity.unit,
                "load": one.load,
                "step": one.step + 1,
                "lower": _number(one.lower * scale),
                "upper": _number(one.upper * scale),
                "drawing": linear.nominal[index] * scale,
                "worst_case": linear.worst_case[index] * scale,
                "rss_mean": linear.mean[index] * scale,
                "rss_sd": linear.sd[index] * scale,
                "percentiles": {
                    f"{level:g}": part[index] * scale
                    for level, part in zip(PERCENTILES, parts, strict=True)
                },
                "below": below[index],
                "above": above[index],
            }
        )
    return documents


def _sources(analysis: ToleranceAnalysis) -> list[dict[str, Any]]:
    """Return what is found of every deviation; lists are in the order of `limits`."""
    factor = analysis.control.factor
    documents: list[dict[str, Any]] = []
    for index, name in enumerate(analysis.sources):
        scales = np.array([one.quantity.scale for one in analysis.criteria])
        documents.append(
            {
                "name": name,
                "one_sd": analysis.linear.spread[:, index] * scales,
                "variance_share": analysis.linear.share[:, index],
                "sobol_first": analysis.sobol.first[:-1, index],
                "sobol_total": analysis.sobol.total[:-1, index],
                "sobol_total_of_acceptance": analysis.sobol.total[-1, index],
                "yield_if_exact": analysis.control.exact[index],
                "allowed_factor": None if factor is None else factor[index],
            }
        )
    return documents


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
    if isinstance(analysis.drawn, DrawnPieces):
        raise InputError.UNSUPPORTED(
            f"the drawn robots are rows of the files in {analysis.drawn.directory}; read those."
        )
    outcomes = analysis.drawn.outcomes
    columns: dict[str, Sequence[Any]] = {"robot": range(1, analysis.draws + 1)}
    columns |= {name: values.tolist() for name, values in analysis.drawn.numbers.items()}
    for one, values in zip(analysis.criteria, outcomes.values.T, strict=True):
        unit = f" [{one.quantity.unit}]" if one.quantity.unit else ""
        columns[f"{one.name}{unit}"] = (values * one.quantity.scale).tolist()
    columns["outcome"] = [CODES[code] for code in outcomes.codes]
    return columns


def _number(value: float) -> float | None:
    """Return a limit as it was given: turned to rad and back it has a rounding error."""
    return float(f"{value:.12g}") if np.isfinite(value) else None
