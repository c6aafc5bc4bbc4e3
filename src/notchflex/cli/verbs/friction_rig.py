"""`notchflex friction-rig`: the coefficient of friction from two hanging weights."""

from __future__ import annotations

from typing import Literal

from notchflex.cli import terminal
from notchflex.cli.options import Columns, DrawnOutputs


def friction_rig(
    data: str,
    /,
    *,
    law: Literal["capstan", "corner"] = "capstan",
    column: Columns = (),
    outputs: DrawnOutputs = DrawnOutputs(),
) -> None:
    """Find the coefficient of friction of a tendon over two edges from two hanging weights.

    Every row is a reading: weight 1 is just about to lift weight 2, the tendon turning over two
    edges in between. Prints the coefficient with its 95 % interval, the spread
    of the readings, outliers, and whether a constant coefficient is enough.

    Args:
        data: CSV with `weight_1_g` (pulls), `weight_2_g` (is lifted), `turn_1_deg` and
            `turn_2_deg`; if known the standard deviations `weight_1_sd_g`, `turn_1_sd_deg`, ...
        law: Friction law of an edge: that of robots by default, or that of Liu 2022 (eq. 21).
    """
    outputs.check([data])

    from notchflex import fit

    rig = fit.friction_rig(fit.read_friction_rig(data, law, dict(column)))

    def show(rig: fit.FrictionRig) -> None:
        terminal.line(data)
        terminal.show(*rig.words)

    outputs.write(rig, fit.friction_document, show)
    if rig.readings.ignored:
        terminal.note(f"ignored columns: {', '.join(rig.readings.ignored)}.")
