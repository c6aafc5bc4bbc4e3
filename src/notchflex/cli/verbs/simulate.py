"""`notchflex simulate`: pull the tendons through a series of loads."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.options import (
    NO_LOADS,
    OUTPUT,
    ExternalLoads,
    File,
    PathOutputs,
    Refinement,
    StateFile,
    Strokes,
    Tensions,
    integer,
    texts,
    vector,
)
from notchflex.cli.robots import (
    RobotName,
    Settings,
    beside_files,
    beside_robots,
    changed_title,
    chosen_robot,
    robot_files,
)
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.support import BROWSER, MOVING, PAPER, TendonCommand, Vector, load_columns

if TYPE_CHECKING:
    from notchflex import Bands, EquilibriumPath, LoadPath, Robot, State


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class SimulateOutputs(PathOutputs):
    """Results of `simulate`.

    Attributes:
        plot: Draw a picture to this .png, .svg or .pdf file, or to an interactive .html file, or to
            an animated .gif file.
        nc: Write the whole result as NetCDF to this file (extra `data`); `notchflex.read_path`
            reads it back.
        parquet: Write the columns of the CSV as a Parquet table to this file (extra `data`).
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
    base_rotation: Annotated[Vector | None, vector("angles in deg", "RX,RY,RZ")] = None,
    external: ExternalLoads = NO_LOADS,
    refinement: Refinement = 0,
    settings: Settings = (),
    uncertain: bool = False,
    draws: Annotated[int | None, integer(2, 100_000)] = None,
    from_state: StateFile = None,
    beside: Annotated[tuple[str, ...], texts("--beside", "ROBOT")] = (),
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
            `1=SPEC`, given once for each tendon; tendons that are not named hang slack.
        stroke: Tendon length drawn out at the base [mm], step by step; written as --tension.
        base_rotation: Turn the base by a rotation vector RX,RY,RZ [deg], for example `90,0,0`.
        uncertain: Carry the tolerances of the robot (its [tolerance] table, else assumed ones)
            through all steps: table, picture, CSV and JSON have the 5th, 50th and 95th percentile.
        draws: How many robots `--uncertain` draws within the tolerances; 256 if not given.
        beside: Also simulate another robot under the same load: `ROBOT`, `LABEL: ROBOT`, or this
            one with other values, `LABEL: PATH=VALUE, PATH=VALUE`. May be given up to four times.
            Table, picture and JSON have all of them, other files the first.
        columns: Quantities that the table shows, joined by commas, such as
            `tension,notch_angle,gap`. A wrong name lists all names.
        every_row: Show every step in the table; without it a path of more than 60 steps is thinned.
    """
    import numpy as np

    from notchflex import LoadPath
    from notchflex.cli.path_table import parse_columns

    terminal.be_quiet(outputs.quiet)
    shown = () if columns is None else parse_columns(columns)
    chosen = chosen_robot(robot, settings)
    title = changed_title(chosen, settings)
    robots = beside_robots(chosen, robot, beside)
    if external and not tension and not stroke:
        tension = (TendonCommand("--tension", 1, [math.nan]),)  # all hang slack, in one step
    _check_bands(uncertain, draws, beside, from_state)
    tensions, strokes = load_columns(tension, stroke, chosen.number_of_tendons)
    outputs.check(
        [*robot_files(robot), *beside_files(beside)],
        pictures=PAPER + BROWSER + (() if beside else MOVING),  # several robots do not move
    )
    if outputs.plot is not None and len(tensions) < 2 and _moves(outputs.plot):
        raise InputError.FILE_FORMAT(
            f"--plot {outputs.plot}: one step cannot be animated; write a .png, .svg or .pdf."
        )
    text = f"solving {len(tensions)} steps of {chosen.name}"
    with terminal.progress(text) as progress:
        start = None if from_state is None else _start(from_state)
        turn = np.radians(base_rotation or (0.0, 0.0, 0.0))
        load = LoadPath(tensions, strokes, turn).loaded(**external.arguments())
        bands = None
        if uncertain:
            from notchflex import analysis
            from notchflex.analysis.bands import DRAWS

            bands = analysis.uncertain(
                chosen,
                load,
                outputs=analysis.band_names(shown),
                draws=draws or DRAWS,
                refinement=refinement,
                progress=partial(progress, text),
            )
            paths = {chosen.name: bands.path}
        else:
            paths = _solve(robots, load, start, refinement, partial(progress, text))
    _write(paths, outputs, title, bands)
    if bands is not None:
        for sentence in bands.warnings():
            terminal.warn(sentence)
    if outputs.prints_tables:
        from notchflex.cli import path_table

        path = next(iter(paths.values()))
        path_table.print_path(path, title, columns=shown, every_row=every_row, bands=bands)
        if len(paths) > 1:
            path_table.print_beside(paths, columns=shown, every_row=every_row)
    return max(_report(path, f"{label}: " if beside else "") for label, path in paths.items())


def _check_bands(
    uncertain: bool, draws: int | None, beside: Sequence[str], from_state: str | None
) -> None:
    """Refuse options that `--uncertain` excludes or needs."""
    if uncertain and (beside or from_state is not None):
        excluded = "--beside" if beside else "--from-state"
        raise InputError.CONFLICT(
            f"--uncertain draws robots that start from rest; leave out {excluded}, or --uncertain."
        )
    if draws is not None and not uncertain:
        raise InputError.CONFLICT("--draws counts the robots of --uncertain; give both or neither.")


def _solve(
    robots: Mapping[str, Robot],
    load: LoadPath,
    start: State | None,
    refinement: int,
    progress: Any,
) -> dict[str, EquilibriumPath]:
    """Return the path of every robot; only the first starts from a saved state."""
    from notchflex import analysis

    paths: dict[str, EquilibriumPath] = {}
    for number, (label, robot) in enumerate(robots.items()):
        if number:
            progress(number, len(robots))
        state = None if number else start
        paths[label] = analysis.simulate(robot, load, from_state=state, refinement=refinement)
    return paths


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

    (_, path), *others = paths.items()

    def document() -> dict[str, Any]:
        beside = {label: whole_document(other) for label, other in others}
        more = {"beside": beside} if beside else {}
        return whole_document(path) | more | ({"bands": band_document(bands)} if bands else {})

    def picture() -> Any:
        from notchflex.plotting import beside_picture, path_picture

        if not others:
            return path_picture(path, title=title, bands=bands)
        names = dict.fromkeys([title, *(other.robot.name for _, other in others)])
        return beside_picture(paths, title="; ".join(names))

    moving = outputs.plot if outputs.plot and _moves(outputs.plot) else None
    outputs.write(document, picture=None if moving else picture)
    if outputs.csv:
        write_path_csv(outputs.csv, path, band_columns(bands) if bands else None)
    for target, write in ((outputs.nc, write_netcdf), (outputs.parquet, write_parquet)):
        if target:
            write(target, path)
    if moving:
        text = f"drawing {moving}"
        with terminal.progress(text, compiles=False) as progress:
            from notchflex.plotting import save_animation

            save_animation(path, moving, title=title, progress=partial(progress, text))
    outputs.write_state(path.state)


def _moves(picture: str) -> bool:
    return Path(picture).suffix.lower() in MOVING


def _report(path: EquilibriumPath, label: str) -> int:
    """Write warnings and the first failure, after the label if given; return the exit code."""
    from notchflex.results.path import path_warnings

    for sentence in path_warnings(path):
        terminal.warn(f"{label}{sentence}")
    failed = [row for row, converged in enumerate(path.converged) if not converged]
    if not failed:
        return DONE
    first = failed[0]
    terminal.error(f"{label}not converged: step {first + 1} of {len(path)}: {path.reason[first]}.")
    return NOT_CONVERGED
