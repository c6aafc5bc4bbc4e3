"""`notchflex design`: from a design file to a robot file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import DrawnOutputs, Folder, number
from notchflex.cli.terminal import DONE

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
    if front and (grid or robust):
        raise InputError.CONFLICT(
            "--front is of robots as drawn, with any length: leave out --grid and --robust, name "
            "the point that you choose as `robot` of the design file, and run it again with them."
        )
    with terminal.progress("spreading over the front" if front else "ranking robots") as progress:
        if front:
            result = designing.design_front(spec, progress=progress)
        else:
            result = designing.design(spec, robust=robust, grid=grid, progress=progress)
    if output is not None:
        terminal.note_written(result.save(output, inputs=[spec]))
    if isinstance(result, designing.DesignFront):
        outputs.write(result, _front_document, _print_front)
        reason = result.reason
    else:
        outputs.write(result, designing.design_document, _print)
        reason = "" if result.converged else result.reason
    return terminal.failed(f"{reason}.") if reason else DONE


def _front_document(front: DesignFront) -> dict[str, Any]:
    from notchflex.designing import design_document

    points = [design_document(point) for point in front.points]
    return {"objectives": list(front.titles), "reason": front.reason, "points": points}


def _print_front(front: DesignFront) -> None:
    columns = dict(zip(front.titles, front.objectives.T, strict=True))
    numbers = map(str, range(1, 1 + len(front.points)))
    tables.show({"point": numbers, **columns}, forms=dict.fromkeys(columns, ".5g"))


def _print(design: Design) -> None:
    from notchflex.designing import design_document, numbers

    document = design_document(design)
    wishes = [
        wish | {key: numbers(wish[key]) for key in ("achieved", "before")}
        for wish in document["wishes"]
    ]
    tables.show(wishes, "quantity asked achieved unit before met", {"achieved": ">", "before": ">"})
    variables = [{**row, "limits": (row["lower"], row["upper"])} for row in document["variables"]]
    if variables:
        terminal.line("")
        keys = "name value unit before limits"
        tables.show(variables, keys, {"value": ".5g", "before": ".5g", "limits": "g"})
    terminal.show("", *design.explanation)
    terminal.line(
        f"{design.starts} searches, {design.solves} robots solved, {design.gradients} derivatives."
    )
