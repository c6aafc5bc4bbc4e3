"""`notchflex design`: from a design file to a robot file."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import converted, flag
from notchflex.cli.outputs import OUTPUT, JsonFile, Outputs, PlotFile, Quiet
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.support import check_folder, parse_number

if TYPE_CHECKING:
    from notchflex.designing import Design


def design(
    spec: Annotated[str, Parameter(help="Design file; `notchflex new NAME --design` writes one.")],
    /,
    *,
    output: Annotated[
        str | None,
        Parameter(
            name=("--output", "-o"),
            group=OUTPUT,
            metavar="FOLDER",
            help="Write robot.toml, wishes.csv, design.json and design.svg into this folder.",
        ),
    ] = None,
    front: Annotated[
        bool,
        flag("Find the front between two or three objectives: point_01.toml and so on, front.csv."),
    ] = False,
    robust: Annotated[
        bool,
        flag(
            "Make the yield of robots made within the tolerances as great as possible, or what "
            "`[robust]` and `wanted_yield` of the design file say."
        ),
    ] = False,
    grid: Annotated[
        float,
        converted(
            partial(parse_number, form="a step in mm, 0 or more", least=0.0),
            "MM",
            help="Step of all lengths that are chosen [mm], such as 0.005; the numbers are those "
            "of the robot on this grid.",
        ),
    ] = 0.0,
    json: JsonFile = None,
    plot: PlotFile = None,
    quiet: Quiet = False,
) -> int:
    """Choose dimensions so that a robot meets a specification.

    The design file names variables, loads, objectives and constraints. Prints what was asked beside
    what is achieved, which limits hold the design and what each costs. Ctrl-C keeps the best robot
    so far.
    """
    from notchflex.designing.result import file_names, write_design

    checked = () if output is None else check_folder(output, file_names(), "-o", inputs=[spec])
    files = {f"-o ({file.name})": str(file) for file in checked}
    outputs = Outputs([spec], quiet=quiet, files=files, json=json, plot=plot)
    with terminal.working("loading the solver"):
        terminal.use_compile_cache()
        import notchflex.designing as designing
    if front and grid:
        raise InputError.CONFLICT(
            "--front is of robots with any length: leave out --grid, name the point that you "
            "choose as `robot` of the design file, and run it again with --grid and without "
            "--front."
        )
    if front and robust:
        raise InputError.CONFLICT(
            "--front is of robots as drawn: leave out --robust, name the point that you choose as "
            "`robot` of the design file, and run it again with --robust and without --front."
        )
    if front:
        return _front(spec, output, outputs)
    with terminal.bars("ranking robots") as progress:
        result = designing.design(spec, robust=robust, grid=grid, progress=progress)
    if output is not None:
        written = write_design(result, output, inputs=[spec])
        terminal.note(f"written: {', '.join(map(str, written))}.")
    outputs.write_json(lambda: designing.design_document(result))
    outputs.draw(result)
    if outputs.prints_tables:
        _print(result)
    if not result.converged:
        terminal.error(f"{result.reason}.")
    return DONE if result.converged else NOT_CONVERGED


def _front(spec: str, output: str | None, outputs: Outputs) -> int:
    """Find a front, write and print it."""
    import notchflex.designing as designing

    with terminal.bars("spreading over the front") as progress:
        front = designing.design_front(spec, progress=progress)
    if output is not None:
        written = designing.write_front(front, output, inputs=[spec])
        terminal.note(f"written: {', '.join(map(str, written))}.")
    outputs.write_json(
        lambda: {
            "objectives": list(front.titles),
            "reason": front.reason,
            "points": [designing.design_document(point) for point in front.points],
        }
    )
    outputs.draw(front)
    if outputs.prints_tables:
        heads = ["point", *(f">{title}" for title in front.titles)]
        rows = [
            (str(number), *(f"{value:.5g}" for value in values))
            for number, values in enumerate(front.objectives.tolist(), start=1)
        ]
        terminal.output().print(terminal.table(heads, rows, gap=2))
    if front.reason:
        terminal.error(f"{front.reason}.")
    return NOT_CONVERGED if front.reason else DONE


def _print(design: Design) -> None:
    from notchflex.designing.result import numbers

    console = terminal.output()
    heads = ("asked of", "asked", ">achieved", "unit", ">before", "met")
    rows = [
        (
            one.title,
            one.asked,
            numbers(one.achieved),
            one.unit,
            numbers(one.before),
            "" if one.met is None else "yes" if one.met else "no",
        )
        for one in design.wishes
    ]
    console.print(terminal.table(heads, rows, gap=2))
    heads = ("\nvariable", ">\nvalue", "\nunit", ">\nbefore", ">\nlimits")
    rows = [
        (v.name, f"{v.value:.5g}", v.unit, f"{v.before:.5g}", f"{v.lower:g} to {v.upper:g}")
        for v in design.variables
    ]
    if rows:
        console.print(terminal.table(heads, rows, gap=2))
    console.print()
    for sentence in design.explanation:
        console.print(sentence)
    console.print(
        f"{design.starts} searches, {design.solves} robots solved, {design.gradients} derivatives."
    )
