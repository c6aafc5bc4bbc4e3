"""The table of `notchflex follow`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from notchflex.cli import terminal
from notchflex.cli.tables.path_table import MAX_ROWS
from notchflex.support import DEGREES

if TYPE_CHECKING:
    from notchflex.control import Following


def print_following(following: Following) -> None:
    """Print drives, tip and error of every target; of many targets some."""
    console, tendons = terminal.output(terminal.width()), following.tension.shape[1]
    met = int(following.reached.sum())
    console.print(f"{following.robot.name}: {met} of {len(following)} targets met", soft_wrap=True)
    heads = [">target\n"]
    for what, unit in (("tension", "N"), ("stroke", "mm")):
        heads += [f">{what}{'' if tendons == 1 else f' {i + 1}'}\n{unit}" for i in range(tendons)]
    errors = {"mm": following.error_mm, "deg": following.error_deg}
    errors = {unit: values for unit, values in errors.items() if values.any()}
    heads += [">tip x\nmm", ">tip y\nmm", ">tip z\nmm", ">angle\ndeg"]
    heads += [*(f">error\n{unit}" for unit in errors), "\n"]
    numbers = np.concatenate([following.tension, following.stroke, following.tip_position], axis=1)
    angle = following.path.total_angle[following.step] * DEGREES
    stride = -(-len(following) // MAX_ROWS)
    shown = sorted({*range(0, len(following), stride), len(following) - 1})
    vias = np.diff(following.step, prepend=-1) > 1
    rows = [
        [
            str(i + 1),
            *(f"{value:.4f}" for value in numbers[i]),
            f"{angle[i]:.2f}",
            *(f"{values[i]:.2g}" for values in errors.values()),
            " ".join([*(["overshoot"] if vias[i] else []), following.code[i]]).strip(),
        ]
        for i in shown
    ]
    console.print(terminal.table(heads, rows))
    if stride > 1:
        terminal.note(f"every {stride}th target is shown; --csv FILE writes all.")
