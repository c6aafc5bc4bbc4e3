"""`notchflex design`: from a design file to a robot file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import DrawnOutputs, Folder, number
from notchflex.cli.terminal import DONE, NOT_CONVERGED

if TYPE_CHECKING:
    from notchflex.designing import Design, DesignFront


def design(
    spec: str,
    /,
    *,
    output: Folder = None,
    front: bool = False,
    robust: bool = False,
    grid: Annotated[float, number("a step in mm, 0 or more", "MM", least=0.0)] = 0.0,
    outputs: DrawnOutputs = DrawnOutputs(),
) -> int:
    """Choose dimensions so that a robot meets a specification.

    The design file names variables, loads, objectives and constraints. Prints what was asked beside
    what is achieved, which limits hold the design and what each costs. Ctrl-C keeps the best robot
    so far.

    Args:
        spec: Design file; `notchflex new NAME --design` writes one.
        output: Write robot.toml, wishes.csv, design.json and design.svg into this folder.
        front: Find the front between two or three objectives: point_01.toml and so on, front.csv.
        robust: Make the yield of robots made within the tolerances as great as possible, or what
            `[robust]` and `wanted_yield` of the design file say.
        grid: Step of all lengths that are chosen [mm], such as 0.005; the numbers are those of the
            robot on this grid.
    """
    from notchflex.designing import FILES

    outputs.check([spec], folder=("-o", output, FILES))
    with terminal.progress("loading the solver"):
        import notchflex.designing as designing
    for option, given, robots in (
        ("--grid", grid, "with any length"),
        ("--robust", robust, "as drawn"),
    ):
        if front and given:
            raise InputError.CONFLICT(
                f"--front is of robots {robots}: leave out {option}, name the point that you "
                f"choose as `robot` of the design file, and run it again with {option} and without "
                "--front."
            )
    if front:
        with terminal.progress("spreading over the front") as progress:
            points = designing.design_front(spec, progress=progress)
        if output is not None:
            terminal.note_written(points.save(output, inputs=[spec]))
        outputs.write(lambda: _front_document(points), lambda: _print_front(points), picture=points)
        reason = points.reason
    else:
        with terminal.progress("ranking robots") as progress:
            result = designing.design(spec, robust=robust, grid=grid, progress=progress)
        if output is not None:
            terminal.note_written(result.save(output, inputs=[spec]))
        outputs.write(
            lambda: designing.design_document(result), lambda: _print(result), picture=result
        )
        reason = "" if result.converged else result.reason
    if reason:
        terminal.error(f"{reason}.")
    return NOT_CONVERGED if reason else DONE


def _front_document(front: DesignFront) -> dict[str, Any]:
    from notchflex.designing import design_document

    points = [design_document(point) for point in front.points]
    return {"objectives": list(front.titles), "reason": front.reason, "points": points}


def _print_front(front: DesignFront) -> None:
    columns = dict(zip(front.titles, front.objectives.T.tolist(), strict=True))
    numbers = map(str, range(1, 1 + len(front.points)))
    forms = dict.fromkeys(columns, ".5g")
    tables.show(tables.frame({"point": numbers, **columns}, **forms), gap=2)


def _print(design: Design) -> None:
    from notchflex.designing import numbers

    wishes = [
        {
            "asked of": wish.title,
            "asked": wish.asked,
            "achieved": numbers(wish.achieved),
            "unit": wish.unit,
            "before": numbers(wish.before),
            "met": "" if wish.met is None else tables.cell(wish.met),
        }
        for wish in design.wishes
    ]
    variables = [
        {
            "variable": variable.name,
            "value": variable.value,
            "unit": variable.unit,
            "before": variable.before,
            "limits": (variable.lower, variable.upper),
        }
        for variable in design.variables
    ]
    console = terminal.output()
    tables.show(tables.records(wishes, achieved=">", before=">"), gap=2)
    if variables:
        console.print()
        tables.show(tables.records(variables, value=".5g", before=".5g", limits="g"), gap=2)
    console.print()
    for sentence in design.explanation:
        console.print(sentence)
    console.print(
        f"{design.starts} searches, {design.solves} robots solved, {design.gradients} derivatives."
    )
