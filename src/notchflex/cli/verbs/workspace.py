"""`notchflex workspace`: where the tip of a robot can go."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import (
    NO_FOLDER,
    NO_LOADS,
    OUTPUT,
    DrawnOutputs,
    ExternalLoads,
    File,
    InPieces,
    converted,
    integer,
    low_high,
    named,
    number,
    texts,
)
from notchflex.cli.robots import (
    RobotName,
    Settings,
    beside_files,
    beside_robots,
    chosen_robot,
    robot_files,
)
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.support import parse_number

if TYPE_CHECKING:
    from notchflex.workspaces import Overlap, Workspace

_LIMIT = "NAME=LARGEST or NAME=SMALLEST:LARGEST, such as strain=0.04 or gap=0.05:"
_SPREADS = {
    "total_angle_deg": "total angle [deg]",
    "peak_strain": "peak strain",
    "tension_N": "largest tension [N]",
    "hysteresis_mm": "error by hysteresis [mm]",
    "softest_stiffness_N_mm": "softest stiffness [N/mm]",
}


def _tensions(text: str) -> list[float]:
    form = "tensions of 0 N or more, one or one per tendon joined by commas"
    return [parse_number(word, form, least=0.0) for word in text.split(",")]


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class WorkspaceOutputs(DrawnOutputs):
    """Results of `workspace`.

    Attributes:
        nc: Write all states as NetCDF to this file (extra `data`).
    """

    nc: File = None


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
        ),
    ] = (),
    tension: Annotated[list[float] | None, converted(_tensions, "N[,N...]")] = None,
    states: Annotated[int, integer(32, 20_000_000_000)] = 100_000,
    pretension: Annotated[float, number("a tension in N, 0 or more", "N", least=0.0)] = 0.0,
    stiffness: Annotated[int, integer(0, 5000)] = 0,
    beside: Annotated[tuple[str, ...], texts("--beside", "ROBOT")] = (),
    external: ExternalLoads = NO_LOADS,
    settings: Settings = (),
    pieces: InPieces = NO_FOLDER,
    outputs: WorkspaceOutputs = WorkspaceOutputs(),
) -> int:
    """Explore where the tip of a robot can go, while its tendons are pulled and let go.

    Tensions rise along rays to a peak and fall again, so that every tension is there with both
    histories. Prints extent, convex hull, alpha shape, dexterity, and how far the tip is off at the
    same tensions by hysteresis.

    Args:
        limit: Keep a quantity within a limit: `strain=0.04` (the largest peak strain), `angle=90`
            [deg], `gap=0.05:` (no notch closes further) or any quantity of a result. May be given
            several times.
        tension: Largest tension [N] of all tendons, or one per tendon joined by commas; by default
            that which closes all notches.
        states: How many states are solved, half of them while the tendons are let go. More than
            20 000 000 need `--folder`, which keeps one state of each small voxel and direction.
        pretension: Tension that every tendon has at least [N].
        stiffness: Compute the stiffness of the tip at so many states.
        beside: Also explore another robot with the same limits and compare: `ROBOT`,
            `LABEL: ROBOT`, or this one with other values, `LABEL: PATH=VALUE, PATH=VALUE`. May be
            given up to four times.
    """
    names = [name for name, _ in limit]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InputError.CONFLICT(
            f"--limit {twice[0]} is given twice; give both bounds at once, as {twice[0]}=LOW:HIGH."
        )
    inputs = [*robot_files(robot), *beside_files(beside)]
    outputs.check(inputs)
    robots = beside_robots(chosen_robot(robot, settings), robot, beside)
    if pieces.folder is not None and beside:
        raise InputError.CONFLICT("--folder takes one robot; leave --beside out.")
    folder = pieces.chosen("workspace", inputs)
    if folder is None and states > 20_000_000:
        raise InputError.OUT_OF_RANGE(
            f"--states {states}: more than 20000000 states need --folder DIR, which keeps them in "
            "pieces."
        )
    with terminal.progress("exploring") as progress:
        from notchflex import pull
        from notchflex import workspaces as exploring
        from notchflex.workspaces import in_python

        load = pull(0.0, 0.0, steps=1).loaded(**external.arguments())[0]
        limits = in_python(dict(limit))
        explored = {
            label: exploring.workspace(
                each,
                limits=limits,
                tension=tension if tension is None or len(tension) > 1 else tension[0],
                states=states,
                pretension=pretension,
                load=load,
                stiffness=stiffness,
                progress=partial(progress, label),
                folder=folder,
            )
            for label, each in robots.items()
        }
    _write(explored, outputs)
    return _report(explored)


def _write(explored: Mapping[str, Workspace], outputs: WorkspaceOutputs) -> None:
    from notchflex.workspaces import (
        overlaps,
        save_netcdf,
        workspace_document,
    )

    compared = overlaps(explored) if all(map(len, explored.values())) else []
    documents = {label: workspace_document(each) for label, each in explored.items()}
    (_, alone), *others = documents.items()

    def document() -> dict[str, Any]:
        overlap = [vars(each) for each in compared]
        return alone | ({"beside": dict(others), "overlaps": overlap} if others else {})

    def picture() -> Any:
        from notchflex.plotting import workspace_picture, workspaces_picture

        if others:
            return workspaces_picture(explored)
        return workspace_picture(next(iter(explored.values())))

    def show() -> None:
        for label, each in documents.items():
            _print(f"{label}: " if others else "", each)
        for overlap in compared:
            _print_overlap(overlap)

    outputs.write(document, show, picture=picture)
    if outputs.nc:
        save_netcdf(explored, outputs.nc)


def _report(explored: Mapping[str, Workspace]) -> int:
    """Write what is missing; return the exit code."""
    code = DONE
    for label, each in explored.items():
        name = f"{label}: " if len(explored) > 1 else ""
        if not len(each):
            terminal.error(f"{name}no state is left: none converged within the limits.")
            code = NOT_CONVERGED
        elif each.failed:
            terminal.warn(f"{name}{each.failed} of {each.tried} states did not converge.")
    return code


def _print(label: str, document: dict[str, Any]) -> None:
    """Print one workspace, from its document."""
    counts = document["states"]
    largest = [f"{tension:.4g}" for tension in document["largest_tension_N"]]
    pulled = ", ".join(largest if len({*largest}) > 1 else largest[:1])
    lines = [
        f"Workspace of {label}{document['name']}, tendons up to {pulled} N",
        *(f"limit: {text}" for text in document["limits"]),
        f"{counts['kept']} of {counts['solved']} states kept, {counts['not_converged']} not "
        f"converged, {counts['beyond_limits']} beyond limits",
    ]
    if extent := document.get("extent_mm"):
        hull, alpha, voxels = document["convex_hull"], document["alpha_shape"], document["voxels"]
        lines += [f"{axis}  {low:.3f} to {high:.3f} mm" for axis, (low, high) in extent.items()]
        lines += [
            f"convex hull {hull['size']:.5g} {hull['unit']}, alpha shape {alpha['size']:.4g} "
            f"{alpha['unit']}",
            f"dexterity {100 * voxels['dexterity_mean']:.2g} % of directions in a voxel of "
            f"{voxels['edge_mm']:.3g} mm, up to {100 * voxels['dexterity_largest']:.2g} %",
        ]
    for line in lines:
        terminal.output().print(line, soft_wrap=True)
    if not extent:
        return
    spreads = {title: document[key] for key, title in _SPREADS.items()}
    rows = [
        {"": title} | {f"{name[1:]} %" if name.startswith("p") else name: one[name] for name in one}
        for title, one in spreads.items()
        if one["largest"] is not None
    ]
    tables.show(tables.records(rows, **dict.fromkeys(rows[0].keys() - {""}, ".4g")), gap=2)


def _print_overlap(overlap: Overlap) -> None:
    """Print what two workspaces have in common."""
    first, second = overlap.first, overlap.second
    terminal.output().print(
        f"{first} and {second}: of voxels of {overlap.voxel:.3g} mm {overlap.both} hold tips of "
        f"both, {overlap.first_alone} of {first} alone, {overlap.second_alone} of {second} alone; "
        f"{100 * overlap.first_in_second:.0f} % of {first} lie in the hull of {second}, "
        f"{100 * overlap.second_in_first:.0f} % of {second} in that of {first}",
        soft_wrap=True,
    )
