"""`notchflex workspace`: where the tip of a robot can go."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import converted, low_high, named, texts
from notchflex.cli.arguments.loads import ExternalLoads
from notchflex.cli.arguments.pieces import InPieces
from notchflex.cli.arguments.robots import (
    RobotName,
    Settings,
    beside_files,
    beside_robots,
    chosen_robot,
    robot_files,
)
from notchflex.cli.outputs import JsonFile, Outputs, PlotFile, Quiet, output_file
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.support import parse_number, parse_whole

if TYPE_CHECKING:
    from notchflex.workspaces import Workspace

_LIMIT = "NAME=LARGEST or NAME=SMALLEST:LARGEST, such as strain=0.04 or gap=0.05:"


def _tensions(text: str) -> list[float]:
    form = "tensions of 0 N or more, one or one per tendon joined by commas"
    return [parse_number(word, form, least=0.0) for word in text.split(",")]


def workspace(
    robot: RobotName,
    /,
    *,
    limit: Annotated[
        tuple[tuple[str, tuple[float | None, float | None]], ...],
        converted(
            partial(named, _LIMIT, partial(low_high, _LIMIT, alone_is_high=True)),
            "NAME=VALUE",
            several=True,
            name="--limit",
        ),
        Parameter(
            help="Keep a quantity within a limit: `strain=0.04` (the largest peak strain), "
            "`angle=90` [deg], `gap=0.05:` (no notch closes further) or any quantity of a result. "
            "May be given several times."
        ),
    ] = (),
    tension: Annotated[
        list[float] | None,
        converted(_tensions, "N[,N...]"),
        Parameter(
            help="Largest tension [N] of all tendons, or one per tendon joined by commas; by "
            "default that which closes all notches."
        ),
    ] = None,
    states: Annotated[
        int,
        converted(parse_whole(32, 20_000_000_000), "N"),
        Parameter(
            help="How many states are solved, half of them while the tendons are let go. More than "
            "20 000 000 need `--folder`, which keeps one state of each small voxel and direction."
        ),
    ] = 100_000,
    pretension: Annotated[
        float,
        converted(partial(parse_number, form="a tension in N, 0 or more", least=0.0), "N"),
        Parameter(help="Tension that every tendon has at least [N]."),
    ] = 0.0,
    stiffness: Annotated[
        int,
        converted(parse_whole(0, 5000), "N"),
        Parameter(help="Compute the stiffness of the tip at so many states."),
    ] = 0,
    beside: Annotated[
        tuple[str, ...],
        texts(
            "--beside",
            "ROBOT",
            "Also explore another robot with the same limits and compare: `ROBOT`, "
            "`LABEL: ROBOT`, or this one with other values, `LABEL: PATH=VALUE, PATH=VALUE`. May "
            "be given up to four times.",
        ),
    ] = (),
    external: ExternalLoads = ExternalLoads(),  # noqa: B008 - frozen
    settings: Settings = (),
    pieces: InPieces = InPieces(),  # noqa: B008 - frozen
    json: JsonFile = None,
    nc: Annotated[
        str | None,
        output_file("--nc", "Write all states as NetCDF to this file (extra `data`)."),
    ] = None,
    plot: PlotFile = None,
    quiet: Quiet = False,
) -> int:
    """Explore where the tip of a robot can go, while its tendons are pulled and let go.

    Tensions rise along rays to a peak and fall again, so that every tension is there with both
    histories. Prints extent, convex hull, alpha shape, dexterity, and how far the tip is off at the
    same tensions by hysteresis.
    """
    if twice := [name for name, _ in limit if [one for one, _ in limit].count(name) > 1]:
        raise InputError.CONFLICT(
            f"--limit {twice[0]} is given twice; give both bounds at once, as {twice[0]}=LOW:HIGH."
        )
    inputs = [*robot_files(robot), *beside_files(beside)]
    outputs = Outputs(inputs, quiet=quiet, json=json, nc=nc, plot=plot)
    robots = beside_robots(chosen_robot(robot, settings), robot, beside)
    if pieces.folder is not None and beside:
        raise InputError.CONFLICT("--folder takes one robot; leave --beside out.")
    folder = pieces.chosen("workspace", inputs)
    if folder is None and states > 20_000_000:
        raise InputError.OUT_OF_RANGE(
            f"--states {states}: more than 20000000 states need --folder DIR, which keeps them in "
            "pieces."
        )
    found: dict[str, Workspace] = {}
    with terminal.bars("exploring") as show:
        terminal.use_compile_cache()
        from notchflex import pull
        from notchflex import workspaces as exploring
        from notchflex.workspaces import in_python

        load = external.on(pull(0.0, 0.0, steps=1))[0]
        limits = in_python(dict(limit))
        for label, one in robots.items():
            found[label] = exploring.workspace(
                one,
                limits=limits,
                tension=tension if tension is None or len(tension) > 1 else tension[0],
                states=states,
                pretension=pretension,
                load=load,
                stiffness=stiffness,
                progress=None if show is None else partial(show, label),
                folder=folder,
            )
    _write(found, outputs)
    return _report(found)


def _write(found: Mapping[str, Workspace], outputs: Outputs) -> None:
    from notchflex.workspaces import (
        overlap_documents,
        overlaps,
        save_netcdf,
        workspace_document,
    )

    compared = overlaps(found) if all(len(one) for one in found.values()) else []
    documents = {label: workspace_document(one) for label, one in found.items()}

    def document() -> dict[str, Any]:
        first, *others = documents
        if not others:
            return documents[first]
        beside = {label: documents[label] for label in others}
        return documents[first] | {"beside": beside, "overlaps": overlap_documents(compared)}

    def picture() -> Any:
        from notchflex.plotting import workspace_picture, workspaces_picture

        if len(found) > 1:
            return workspaces_picture(found)
        return workspace_picture(next(iter(found.values())))

    outputs.write_json(document)
    if target := outputs.targets.get("nc"):
        save_netcdf(found, target)
    outputs.save_picture(picture)
    if outputs.prints_tables:
        from notchflex.cli.tables.workspace_table import print_overlaps, print_workspace

        for label, one in documents.items():
            print_workspace(label if len(documents) > 1 else "", one)
        print_overlaps(compared)


def _report(found: Mapping[str, Workspace]) -> int:
    """Write what is missing; return the exit code."""
    code = DONE
    for label, one in found.items():
        name = f"{label}: " if len(found) > 1 else ""
        if not len(one):
            terminal.error(f"{name}no state is left: none converged within the limits.")
            code = NOT_CONVERGED
        elif one.failed:
            terminal.warn(f"{name}{one.failed} of {one.tried} states did not converge.")
    return code
