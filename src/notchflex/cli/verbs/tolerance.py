"""`notchflex tolerance`: worst case, yield and sensitivity of a robot with tolerances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import converted
from notchflex.cli.arguments.pieces import InPieces
from notchflex.cli.arguments.robots import (
    RobotName,
    Settings,
    changed_title,
    chosen_robot,
    robot_files,
)
from notchflex.cli.outputs import CsvFile, JsonFile, Outputs, PlotFile, Quiet
from notchflex.support import parse_whole

if TYPE_CHECKING:
    from notchflex.tolerancing import ToleranceAnalysis


def tolerance(
    robot: RobotName,
    tolerances: Annotated[
        str,
        Parameter(
            metavar="TOLERANCES.toml",
            help="A TOML file, which `notchflex new NAME --tolerance` writes: `[load.NAME]` (the "
            "options of `simulate` as keys), `[[accept]]` (`quantity`, `lower`, `upper`), and if "
            "wanted `[tolerance]`, as in a robot file, and `wanted_yield`. Without `[tolerance]` "
            "those of the robot hold.",
        ),
    ],
    /,
    *,
    draws: Annotated[
        int,
        converted(parse_whole(50, 10_000_000_000), "N"),
        Parameter(
            help="About how many robots are drawn: 25 independent sets of scrambled Sobol points, "
            "each as large as the nearest power of two. More than 10 000 000 need `--folder`."
        ),
    ] = 100_000,
    seed: Annotated[int, converted(parse_whole(0), "N"), Parameter(help="Seed of the draws.")] = 0,
    refinement: Annotated[
        int,
        converted(parse_whole(0, 3), "N"),
        Parameter(help="0 to 3: more strain modes and fibres, to check the accuracy."),
    ] = 0,
    settings: Settings = (),
    pieces: InPieces = InPieces(),  # noqa: B008 - frozen
    json: JsonFile = None,
    csv: CsvFile = None,
    plot: PlotFile = None,
    quiet: Quiet = False,
) -> None:
    """Find out what tolerances do to a robot that must meet acceptance limits.

    Prints for every limit the value of the drawing, worst case and root sum of squares (by
    gradients), and the percentiles of drawn robots; the yield with its 95 % interval; and for every
    tolerance its part of the variance (Sobol indices), the yield if that dimension were exact, and
    the tolerance that is allowed for the wanted yield. The CSV has a row for every drawn robot.
    """
    outputs = Outputs([*robot_files(robot), tolerances], quiet=quiet, json=json, csv=csv, plot=plot)
    chosen = chosen_robot(robot, settings)
    folder = pieces.chosen("tolerance", [*robot_files(robot), tolerances])
    if folder is None and draws > 10_000_000:
        raise InputError.OUT_OF_RANGE(
            f"--draws {draws}: more than 10000000 draws need --folder DIR, which keeps them in "
            "pieces."
        )
    if folder is not None and csv is not None:
        raise InputError.CONFLICT(
            "--csv and --folder exclude each other: the rows are the files in the folder."
        )
    with terminal.bars(f"reading {tolerances}") as show:
        terminal.use_compile_cache()
        from notchflex.tolerancing import tolerance_analysis

        found = tolerance_analysis(
            chosen, tolerances, draws=draws, seed=seed, refinement=refinement, progress=show,
            folder=folder,
        )  # fmt: skip
    _write(found, outputs)
    for sentence in found.warnings():
        terminal.warn(sentence)
    if outputs.prints_tables:
        from notchflex.cli.tables.tolerance_tables import print_tolerances

        print_tolerances(found, changed_title(chosen, settings))


def _write(found: ToleranceAnalysis, outputs: Outputs) -> None:
    from notchflex.tolerancing import tolerance_columns, tolerance_document

    outputs.write_json(lambda: tolerance_document(found))
    outputs.write_csv(lambda: tolerance_columns(found))
    outputs.draw(found)
