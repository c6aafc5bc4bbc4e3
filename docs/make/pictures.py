"""How pictures of the pages are made: a function draws into axes, `@picture` does the rest."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

from notchflex.plotting.style import house_style, new_figure, save

DOCS = Path(__file__).resolve().parents[1]
IMAGES = DOCS / "images"
TENSION = "tendon tension [N]"
TOTAL = "total bending angle [deg]"
HOLLOW: dict[str, Any] = {"mfc": "none", "ms": 3.5}
"""How numbers of others look: circles beside lines of our own."""


def picture(
    file: str, width: float, height: float, columns: int = 1, rows: int = 1, **subplots: Any
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Let a function that draws into axes write a picture of so many inches into a folder.

    What the function takes beside the axes is given by name.
    """

    def decorate(draw: Callable[..., None]) -> Callable[..., None]:
        @wraps(draw)
        def written(folder: Path = IMAGES, **options: Any) -> None:
            with house_style():
                figure = new_figure(width, height)
                draw(*figure.subplots(rows, columns, squeeze=False, **subplots).flat, **options)
                save(figure, folder / file)

        return written

    return decorate


def beside(axes: Axes, dots: tuple[Any, Any], colour: str, label: str | None = None, **look: Any):
    """Draw numbers of others as circles; a label stands for them and for a line of our own."""
    look = HOLLOW | look
    axes.plot(*dots, "o", color=colour, **look)
    if label:
        axes.plot([], [], "o-", color=colour, label=label, **look)


def label_all(axes: tuple[Axes, ...], xlabel: str, *ylabels: str) -> None:
    """Label axes that have the same x."""
    for column, one in enumerate(axes):
        one.set_xlabel(xlabel)
        if column < len(ylabels):
            one.set_ylabel(ylabels[column])


def shown_file(page: str, name: str, folder: Path) -> Path:
    """Write the file that a page shows under its name."""
    text = (DOCS / page).read_text(encoding="utf-8")
    match = re.search(rf'```toml title="{name}"\n(.*?)```', text, re.DOTALL)
    assert match is not None, f"the page shows no {name}"
    (folder / name).write_text(match[1], encoding="utf-8")
    return folder / name
