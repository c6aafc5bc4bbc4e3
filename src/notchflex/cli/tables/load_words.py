"""External loads in words, for the head of a table."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from notchflex.cli import terminal

if TYPE_CHECKING:
    from notchflex.loads.external import ExternalLoad

MOST_LOADS = 3
"""More different loads than this are only counted."""


def load_sentences(external: Sequence[ExternalLoad]) -> list[str]:
    """Return lines with the external loads, and their steps if not at all of them."""
    different = list(dict.fromkeys(external))
    if all(one.is_nothing for one in different):
        return []
    if len(different) > MOST_LOADS:
        return [f"external loads: {len(different)} different ones over the steps"]
    lines: list[str] = []
    for one in different:
        steps = [number for number, other in enumerate(external, start=1) if other == one]
        where = "" if len(different) == 1 else _steps(steps)
        text = f"external loads{where}: {in_words(one)}"
        lines += textwrap.wrap(text, width=terminal.NARROW, subsequent_indent="    ")
    return lines


def _steps(steps: list[int]) -> str:
    if len(steps) == 1:
        return f", step {steps[0]}"
    if steps == list(range(steps[0], steps[-1] + 1)):
        return f", steps {steps[0]} to {steps[-1]}"
    return f", {len(steps)} of the steps"


def in_words(load: ExternalLoad) -> str:
    """Return external loads in words.

    Example:
        >>> from notchflex.loads import ExternalLoad
        >>> in_words(ExternalLoad(tip_force=(0.0, 0.1, 0.0), following=True, tip_mass=20.0))
        'tip force (0, 0.1, 0) N following the tip, tip mass 20 g'
    """
    words: list[str] = []
    turning = " following the tip" if load.following else ""
    at = f" at {_vector(load.tip_point)} mm from the tip" if any(load.tip_point) else ""
    if any(load.tip_force):
        words.append(f"tip force {_vector(load.tip_force)} N{at}{turning}")
    if any(load.tip_moment):
        words.append(f"tip moment {_vector(load.tip_moment)} N mm{turning}")
    if load.tip_mass:
        words.append(f"tip mass {load.tip_mass:g} g{'' if any(load.tip_force) else at}")
    if load.gravity is not None and any(load.gravity):
        words.append(f"gravity {_vector(load.gravity)} m/s2")
    for one in load.body_forces:
        point = f" at {_vector(one.point)} mm" if any(one.point) else ""
        follows = " following it" if one.following else ""
        for name, value, unit in (("force", one.force, "N"), ("moment", one.moment, "N mm")):
            if any(value):
                where = point if name == "force" else ""
                words.append(f"{name} {_vector(value)} {unit} on body {one.body}{where}{follows}")
    return ", ".join(words) or "none"


def _vector(values: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
