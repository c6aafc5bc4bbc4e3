"""`notchflex simulate`: pull the tendons through a series of loads; `fatigue`: along a loop."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import (
    NO_LOADS,
    OUTPUT,
    ExternalLoads,
    File,
    PathOutputs,
    Refinement,
    Spools,
    StateFile,
    Strokes,
    TableOutputs,
    Tensions,
    as_csv,
    exclude,
    integer,
    save_state,
    vector,
)
from notchflex.cli.robots import (
    Beside,
    RobotName,
    Settings,
    beside_robots,
    changed_title,
    chosen_robot,
    robot_files,
)
from notchflex.cli.terminal import DONE
from notchflex.support import BROWSER, MOVING, PAPER, TendonCommand, Vector, load_columns

if TYPE_CHECKING:
    from notchflex import Bands, EquilibriumPath, LoadPath, Robot, State, StrainCycle


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class SimulateOutputs(PathOutputs):
    """Results of `simulate`.

    Attributes:
        plot: Draw a picture: .png, .svg, .pdf, (interactive) .html or (animated) .gif.
        nc: Write the whole result as NetCDF (extra `data`); `notchflex.read_path` reads it back.
        parquet: Write the columns of the CSV as a Parquet table (extra `data`).
    """

    plot: File = None
    nc: File = None
    parquet: File = None


def simulate(
    robot: RobotName,
    /,
    *,
    tension: Tensions = (),
    stroke: Strokes = (),
    spool: Spools = (),
    base_rotation: Annotated[Vector | None, vector("angles in deg", "RX,RY,RZ")] = None,
    external: ExternalLoads = NO_LOADS,
    refinement: Refinement = 0,
    settings: Settings = (),
    uncertain: bool = False,
    draws: Annotated[int | None, integer(2, 100_000)] = None,
    from_state: StateFile = None,
    beside: Beside = (),
    columns: Annotated[str | None, Parameter(group=OUTPUT, metavar="NAMES")] = None,
    every_row: Annotated[bool, Parameter(group=OUTPUT, name="--all")] = False,
    outputs: SimulateOutputs = SimulateOutputs(),
) -> int:
    """Pull the tendons of a robot through a series of tensions or strokes.

    The steps are one path with friction history: at the same tension, unloading differs from
    loading. Prints a table as wide as the terminal (the variable COLUMNS overrides it) unless
    `--json -` or `--csv -` prints something else.

    Args:
        tension: Tension at the base of a tendon [N], step by step. Values or `start:stop:count`
            ranges joined by commas: `2`, `0,1,2.5`, `0:3:31,3:0:31`. For one of several tendons
            `1=SPEC`; those without hang slack.
        stroke: Tendon length drawn out at the base [mm]; as --tension.
        spool: Way of a [[drive]] of two tendons [mm]; as --stroke.
        base_rotation: Turn the base by a rotation vector [deg]: `90,0,0`.
        uncertain: Carry the tolerances of the robot (its [tolerance] table, else assumed ones)
            through all steps: table, picture, CSV and JSON have the 5th, 50th and 95th percentile.
        draws: Robots that `--uncertain` draws; 256 if not given.
        beside: Also simulate up to four other robots under the same load: `ROBOT`, `LABEL: ROBOT`,
            or this one with other values, `LABEL: PATH=VALUE, PATH=VALUE`. Table, picture and JSON
            have all of them, other files the first.
        columns: Quantities of the table, such as `tension,notch_angle,gap`. A wrong name lists all.
        every_row: Show all steps in the table, not 60 at most.
    """
    from notchflex.cli import path_table

    terminal.quiet = outputs.quiet
    shown = () if columns is None else path_table.parse_columns(columns)
    chosen = chosen_robot(robot, settings)
    title = changed_title(chosen, settings)
    robots = beside_robots(chosen, robot, beside)
    if spool and (tension or stroke):
        raise exclude("--spool", "--tension" if tension else "--stroke")
    if external != NO_LOADS and not (tension or stroke or spool):
        tension = (TendonCommand("--tension", 1, [math.nan]),)  # all hang slack, in one step
    if uncertain and (beside or from_state is not None):
        excluded = "--beside" if beside else "--from-state"
        raise InputError.CONFLICT(
            f"--uncertain draws robots that start from rest; leave out {excluded}, or --uncertain."
        )
    if draws is not None and not uncertain:
        raise InputError.CONFLICT("--draws counts the robots of --uncertain; give both or neither.")
    driven = ("spool", chosen.drive) if spool else ("tendon", chosen.tendon)
    tensions, strokes = load_columns(tension or spool, stroke, len(driven[1]), driven[0])
    outputs.check(
        robot_files(robot, *(variant.robot for variant in beside)),
        pictures=PAPER + BROWSER + (() if beside else MOVING),  # several robots do not move
    )
    if _moves(outputs.plot) and len(tensions) < 2:
        raise InputError.FILE_FORMAT(
            f"--plot {outputs.plot}: one step cannot be animated; write a .png, .svg or .pdf."
        )
    text = f"solving {len(tensions)} steps of {chosen.name}"
    bands, paths = None, {}
    with terminal.progress(text) as progress:
        from notchflex import analysis

        start = None if from_state is None else _start(from_state)
        load = _load((tensions, strokes), external, base_rotation, chosen if spool else None)
        if uncertain:
            more: dict[str, Any] = {} if draws is None else {"draws": draws}
            bands = analysis.uncertain(
                chosen, load, outputs=analysis.band_names(shown), refinement=refinement,
                progress=partial(progress, text), **more,
            )  # fmt: skip
            paths, robots = {chosen.name: bands.path}, {}
        for number, (label, each) in enumerate(robots.items()):
            if number:
                progress(text, number, len(robots))
            paths[label] = analysis.simulate(each, load, from_state=start, refinement=refinement)
            start = None  # only the first starts from a saved state
    _write(paths, outputs, title, bands)
    for sentence in () if bands is None else bands.warnings():
        terminal.warn(sentence)
    if outputs.prints_tables:
        path = next(iter(paths.values()))
        path_table.print_path(path, title, columns=shown, every_row=every_row, bands=bands)
        if len(paths) > 1:
            path_table.print_beside(paths, columns=shown, every_row=every_row)
    return max(_report(path, f"{label}: " if beside else "") for label, path in paths.items())


def _load(
    columns: tuple[Any, Any],
    external: ExternalLoads,
    base_rotation: Sequence[float] | None = None,
    by_spool: Robot | None = None,
) -> LoadPath:
    """Return a path of tensions and strokes, or of ways of the spools of a robot."""
    import numpy as np

    from notchflex import LoadPath, analysis

    others, turn = external.arguments(), np.radians(base_rotation or (0.0, 0.0, 0.0))
    if by_spool is not None:
        return analysis.spool_path(by_spool, columns[0], base_rotation=turn, **others)
    return LoadPath(*columns, base_rotation=turn).loaded(**others)


def _start(file: str) -> State:
    """Read the state to continue from; warn where nothing shows which robot it belongs to."""
    from notchflex import State

    state = State.load(file)
    if state.description is None:
        terminal.warn(
            f"{file} was written by an older notchflex and does not contain the values of its "
            "robot; make sure that they are the same. --save-state writes a file that does."
        )
    return state


def _write(
    paths: Mapping[str, EquilibriumPath], outputs: SimulateOutputs, title: str, bands: Bands | None
) -> None:
    """Write JSON and picture of all paths, other files of the first; bands to all but these."""
    from notchflex.analysis.bands import band_columns, band_document
    from notchflex.support import whole_document, write_netcdf, write_parquet, write_path_csv

    first, *others = paths.values()
    more = None if bands is None else band_columns(bands)

    def document(path: EquilibriumPath) -> dict[str, Any]:
        whole = whole_document(path)
        if others:
            whole["beside"] = {label: whole_document(paths[label]) for label in list(paths)[1:]}
        return whole if bands is None else {**whole, "bands": band_document(bands)}

    def draw(path: EquilibriumPath, target: str, progress: Any) -> None:
        from notchflex import plotting

        if _moves(target):
            plotting.save_animation(path, target, title=title, progress=progress)
        elif others:
            names = dict.fromkeys([title, *(other.robot.name for other in others)])
            plotting.beside_picture(paths, title="; ".join(names)).save(target)
        else:
            plotting.path_picture(path, title=title, bands=bands).save(target)

    outputs.write(
        first,
        document,
        plot=draw,
        csv=lambda path, file: write_path_csv(file, path, more),
        nc=lambda path, file: write_netcdf(file, path),
        parquet=lambda path, file: write_parquet(file, path),
        save_state=save_state,
    )


def _moves(picture: str | None) -> bool:
    return picture is not None and Path(picture).suffix.lower() in MOVING


def _report(path: EquilibriumPath, label: str) -> int:
    """Write warnings and the first failure, after the label if given; return the exit code."""
    from notchflex.results.path import path_warnings

    for sentence in path_warnings(path):
        terminal.warn(f"{label}{sentence}")
    for step, converged in enumerate(path.converged):
        if not converged:
            return terminal.failed(
                f"{label}not converged: step {step + 1} of {len(path)}: {path.reason[step]}."
            )
    return DONE


def fatigue(
    robot: RobotName,
    /,
    *,
    tension: Tensions = (),
    stroke: Strokes = (),
    external: ExternalLoads = NO_LOADS,
    refinement: Refinement = 0,
    settings: Settings = (),
    outputs: TableOutputs = TableOutputs(),
) -> int:
    """Find mean and amplitude of the strain of every notch, and the margin below a limit line.

    The steps are a loop, followed until its strains repeat. The line is that of the robot file:
    `--set fatigue.line=cao2020`, or a table `[fatigue]` with `mean` and `amplitude`. No number of
    cycles is predicted. The CSV has a row for every point of every section.

    Args:
        tension: Tension at the base of a tendon [N], step by step, as for `simulate`.
        stroke: Tendon length drawn out at the base [mm], step by step.
    """
    outputs.check(robot_files(robot))
    chosen = chosen_robot(robot, settings)
    columns = load_columns(tension, stroke, chosen.number_of_tendons)
    with terminal.progress(f"solving loops of {chosen.name}"):
        from notchflex import simulate
        from notchflex.fatigue import cycle_columns, cycle_document, line_words, strain_cycle

        load = _load(columns, external)
        cycle = strain_cycle(simulate(chosen, load, refinement=refinement))

    def show(cycle: StrainCycle) -> None:
        terminal.line(changed_title(chosen, settings), "bold")
        tables.show(cycle.to_table(), forms=dict.fromkeys(("mean_%", "margin_%"), ".3f"))
        about = ", ".join(line_words(cycle.limit)) or "none"
        terminal.show("", tables.wrapped(f"Limit line: {about}. Loops: {cycle.loops}."))

    outputs.write(cycle, cycle_document, show, csv=as_csv(cycle_columns))
    for sentence in cycle.warnings():
        terminal.warn(sentence)
    return terminal.failed(cycle.reason) if cycle.reason else DONE
