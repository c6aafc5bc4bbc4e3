"""`notchflex workspace`: where the tip of a robot can go."""

from __future__ import annotations

import re
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
    Bounds,
    DrawnOutputs,
    ExternalLoads,
    File,
    InPieces,
    converted,
    integer,
    low_high,
    named,
    number,
    once,
)
from notchflex.cli.robots import (
    Beside,
    RobotName,
    Settings,
    beside_robots,
    chosen_robot,
    robot_files,
)
from notchflex.cli.terminal import DONE
from notchflex.support import parse_number

if TYPE_CHECKING:
    from notchflex.workspaces import Workspace

_LIMIT = "NAME=LARGEST or NAME=SMALLEST:LARGEST, such as strain=0.04 or gap=0.05:"
_SPREADS = (
    "total_angle_deg",
    "peak_strain",
    "tension_N",
    "hysteresis_mm",
    "softest_stiffness_N_mm",
)
"""Numbers of the document of which percentiles are shown."""


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
        tuple[tuple[str, Bounds], ...],
        named(_LIMIT, low_high(_LIMIT, alone_is_high=True), "NAME=VALUE"),
    ] = (),
    tension: Annotated[list[float] | None, converted(_tensions, "N[,N...]")] = None,
    states: Annotated[int, integer(32, 20_000_000_000)] = 100_000,
    pretension: Annotated[float, number("a tension in N, 0 or more", "N", least=0.0)] = 0.0,
    stiffness: Annotated[int, integer(0, 5000)] = 0,
    beside: Beside = (),
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
    once("--limit", (name for name, _ in limit))
    inputs = robot_files(robot, *(variant.robot for variant in beside))
    outputs.check(inputs)
    robots = beside_robots(chosen_robot(robot, settings), robot, beside)
    if pieces.folder is not None and beside:
        raise InputError.CONFLICT("--folder takes one robot; leave --beside out.")
    folder = pieces.chosen("workspace", inputs)
    with terminal.progress("exploring") as progress:
        from notchflex import Load
        from notchflex import workspaces as exploring
        from notchflex.workspaces import in_python

        load = Load(tension=0.0, **external.arguments())
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
    code = DONE
    for label, each in explored.items():
        name = f"{label}: " if beside else ""
        if not len(each):
            code = terminal.failed(f"{name}no state is left: none converged within the limits.")
        elif each.failed:
            terminal.warn(f"{name}{each.failed} of {each.tried} states did not converge.")
    return code


def _write(explored: Mapping[str, Workspace], outputs: WorkspaceOutputs) -> None:
    from notchflex.workspaces import (
        overlaps,
        save_netcdf,
        workspace_document,
    )

    pairs = overlaps(explored) if all(map(len, explored.values())) else []
    compared = [vars(overlap) for overlap in pairs]
    documents = {label: workspace_document(each) for label, each in explored.items()}
    (_, alone), *others = documents.items()
    more = {"beside": dict(others), "overlaps": compared} if others else {}

    def draw(first: Workspace, target: str, _: object) -> None:
        from notchflex import plotting

        picture = plotting.workspaces_picture(explored) if others else plotting.picture(first)
        picture.save(target)

    def show(_: object) -> None:
        for label, each in explored.items():
            if others:
                terminal.line(f"{label}:", "bold")
            _print(each, documents[label])
        tables.show(compared)

    outputs.write(
        next(iter(explored.values())),
        lambda _: alone | more,
        show,
        plot=draw,
        nc=lambda _, target: save_netcdf(explored, target),
    )


def _print(workspace: Workspace, document: dict[str, Any]) -> None:
    """Print one workspace."""
    *lines, _ = repr(workspace).splitlines()
    for line in lines:
        terminal.line(line)
    if not len(workspace):
        return
    alpha, voxels = document["alpha_shape"], document["voxels"]
    terminal.line(
        f"  tendons up to {', '.join(f'{tension:.4g}' for tension in workspace.largest)} N"
    )
    terminal.line(
        f"  alpha shape {alpha['size']:.4g} {alpha['unit']}; dexterity "
        f"{100 * voxels['dexterity_mean']:.2g} % of directions in a voxel of "
        f"{voxels['edge_mm']:.3g} mm, up to {100 * voxels['dexterity_largest']:.2g} %"
    )
    parts = [re.sub(r"^p(\d+)$", r"\1 %", part) for part in document[_SPREADS[0]]]
    spreads = {name.replace("N_mm", "N/mm"): document[name].values() for name in _SPREADS}
    tables.show({"states": parts, **spreads}, forms=dict.fromkeys(spreads, ".4g"))
