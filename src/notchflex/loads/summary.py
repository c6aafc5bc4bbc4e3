"""Summaries of loads: what `repr` and a notebook show of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from notchflex._summary import Summary, course, short, vector

if TYPE_CHECKING:
    from notchflex.loads.external import ExternalLoad
    from notchflex.loads.load import Load
    from notchflex.loads.load_path import LoadPath

MOST = 4
"""Tendons, notches or outputs that have a line each; of more, the first."""


def load_path_summary(load: LoadPath) -> Summary:
    """Summarise a load path: what is commanded of every tendon, and the external loads."""
    rows: list[tuple[str, str]] = []
    for name, unit, values in (("tension", "N", load.tension), ("stroke", "mm", load.stroke)):
        rows += tendon_rows(name, unit, values, commanded=True)
    rows += external_rows(load)
    if load.base_rotation.any():
        rows.append(("base rotation", f"{vector(load.base_rotation)} rad"))
    steps = f"{len(load)} step{'s' * (len(load) != 1)}"
    return Summary(f"Load path of {steps}", rows)


def load_words(load: Load) -> str:
    """Return a load in words: what is commanded of every tendon, and the external loads.

    Example:
        >>> from notchflex import Load
        >>> load_words(Load(tension=2.0, tip_force=(0.0, 0.1, 0.0)))
        'tension 2 N, tip force (0, 0.1, 0) N'
    """
    words: list[str] = []
    for name, unit in (("tension", "N"), ("stroke", "mm")):
        given = getattr(load, name)
        several = given if isinstance(given, (list, tuple)) else [given]
        for tendon, value in enumerate(several, start=1):
            if value is not None:
                which = f"tendon {tendon} " if len(several) > 1 else ""
                words.append(f"{which}{name} {short(value)} {unit}")
    words += external_words(load)
    return ", ".join(words) or "none"


def external_words(load: ExternalLoad) -> list[str]:
    """Return the external loads of one step, each in words.

    Example:
        >>> from notchflex.loads import ExternalLoad
        >>> external_words(ExternalLoad(tip_force=(0.0, 0.1, 0.0), following=True, tip_mass=20.0))
        ['tip force (0, 0.1, 0) N following the tip', 'tip mass 20 g']
    """
    words: list[str] = []
    turning = " following the tip" if load.following else ""
    at = f" at {vector(load.tip_point)} mm from the tip" if any(load.tip_point) else ""
    if any(load.tip_force):
        words.append(f"tip force {vector(load.tip_force)} N{at}{turning}")
    if any(load.tip_moment):
        words.append(f"tip moment {vector(load.tip_moment)} N mm{turning}")
    if load.tip_mass:
        words.append(f"tip mass {short(load.tip_mass)} g{'' if any(load.tip_force) else at}")
    if load.gravity is not None and any(load.gravity):
        words.append(f"gravity {vector(load.gravity)} m/s²")
    for one in load.body_forces:
        point = f" at {vector(one.point)} mm" if any(one.point) else ""
        follows = " following it" if one.following else ""
        for name, value, where in (("force", one.force, point), ("moment", one.moment, "")):
            if any(value):
                unit = "N" if name == "force" else "N mm"
                words.append(f"{name} {vector(value)} {unit} on body {one.body}{where}{follows}")
    return words


def external_rows(load: LoadPath) -> Iterator[tuple[str, str]]:
    """Yield the row of the external loads of a path; none where there are none."""
    different = [", ".join(external_words(one)) or "none" for one in load.different]
    if different == ["none"]:
        return
    more = f"; {len(different) - 1} other" if len(different) > 1 else ""
    yield ("external load", f"{different[0]}{more}")


def tendon_rows(
    name: str, unit: str, values: np.ndarray, *, commanded: bool = False
) -> Iterator[tuple[str, str]]:
    """Yield the course of every tendon; of many, the first that are not slack."""
    count = values.shape[1]
    moving = [i for i in range(count) if np.isfinite(values[:, i]).any()]
    shown = moving[: MOST - 2] if len(moving) > MOST - 1 else moving
    for index in shown:
        which = f" {index + 1}" if count > 1 else ""
        yield (f"tendon{which} {name}", f"{course(values[:, index])} {unit}")
    if len(moving) > len(shown):
        yield (f"tendon {name}", f"and {len(moving) - len(shown)} more tendons")
    if not moving and not commanded:
        yield (f"tendon {name}", "none")
