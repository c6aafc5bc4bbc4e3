"""`notchflex friction-rig`: the coefficient of friction from two hanging weights."""

from __future__ import annotations

from typing import Annotated, Literal

from cyclopts import Parameter

from notchflex.cli import terminal
from notchflex.cli.arguments.robots import Columns, named_columns
from notchflex.cli.outputs import JsonFile, Outputs, PlotFile


def friction_rig(
    data: Annotated[
        str,
        Parameter(
            help="CSV with `weight_1_g` (pulls), `weight_2_g` (is lifted), `turn_1_deg` and "
            "`turn_2_deg`; if known the standard deviations `weight_1_sd_g`, `turn_1_sd_deg`, ..."
        ),
    ],
    /,
    *,
    law: Annotated[
        Literal["capstan", "corner"],
        Parameter(
            help="Friction law of an edge: that of robots by default, or that of Liu 2022 (eq. 21)."
        ),
    ] = "capstan",
    column: Columns = (),
    json: JsonFile = None,
    plot: PlotFile = None,
) -> None:
    """Find the coefficient of friction of a tendon over two edges from two hanging weights.

    Every row is a reading: weight 1 is just about to lift weight 2, the tendon turning over two
    edges in between. Prints the coefficient with its 95 % interval, the spread
    of the readings, outliers, and whether a constant coefficient is enough.
    """
    outputs = Outputs([data], json=json, plot=plot)

    from notchflex.fit import friction_document, read_friction_rig
    from notchflex.fit import friction_rig as estimate

    rig = estimate(read_friction_rig(data, law, named_columns(column)))

    outputs.write_json(lambda: friction_document(rig))
    outputs.draw(rig)
    if outputs.prints_tables:
        console = terminal.output()
        console.print(data, soft_wrap=True)
        for sentence in rig.words:
            console.print(sentence)
    if rig.readings.ignored:
        terminal.note(f"ignored columns: {', '.join(rig.readings.ignored)}.")
