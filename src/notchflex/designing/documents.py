"""A design as a JSON document and as a table."""

from __future__ import annotations

from typing import Any

from notchflex.designing.result import Design
from notchflex.results.files.json import document_head


def design_document(made: Design) -> dict[str, Any]:
    """Return a design as a document.

    Returns:
        `robot` (its description) and `name` as in every document, `design` (its name),
        `converged`, `met`, `reason`, `wishes`, `variables`, `explanation`, `solves`, `gradients`
        and `starts`, and of a robust design `yields`. Angles in deg, lengths in mm, forces in N.
    """
    return {
        **document_head(made.robot),
        "design": made.spec.name,
        "converged": made.converged,
        "met": made.met,
        "reason": made.reason,
        "wishes": [
            {
                "quantity": one.title,
                "unit": one.unit,
                "asked": one.asked,
                "achieved": list(one.achieved),
                "before": list(one.before),
                "met": one.met,
                "parts": list(one.parts),
            }
            for one in made.wishes
        ],
        "variables": [vars(one) for one in made.variables],
        "explanation": list(made.explanation),
        "solves": made.solves,
        "gradients": made.gradients,
        "starts": made.starts,
        **({"yields": [vars(one) for one in made.yields]} if made.yields else {}),
    }


def wish_rows(design: Design) -> list[tuple[str, str, str, str, str, str, str]]:
    """Return a row for every number asked: quantity, part, unit, asked, achieved, before, met."""
    rows: list[tuple[str, str, str, str, str, str, str]] = []
    for one in design.wishes:
        met = "" if one.met is None else "yes" if one.met else "no"
        for number, value in enumerate(one.achieved):
            part = one.parts[number] if len(one.parts) == len(one.achieved) else ""
            was = repr(one.before[number]) if number < len(one.before) else ""
            rows.append((one.title, part, one.unit, one.asked, repr(value), was, met))
    return rows


HEADS = ("quantity", "part", "unit", "asked", "achieved", "before", "met")
