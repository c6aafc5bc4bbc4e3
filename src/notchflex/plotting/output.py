"""The picture that functions return: it can be shown and saved."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path as FilePath
from typing import Any

from matplotlib.figure import Figure

from notchflex.plotting.marks import Sheet
from notchflex.plotting.style import save
from notchflex.plotting.with_matplotlib import figure_of
from notchflex.plotting.with_plotly import interactive_of, save_html
from notchflex.support import check_picture


@dataclass(frozen=True, repr=False)
class Picture(Sheet):
    """Panels on a grid, under a heading, for matplotlib, plotly and notebooks."""

    def __repr__(self) -> str:
        """Return its title and how to save it."""
        count = len(self.cells)
        return f"Picture {self.title!r} of {count} panel{'s' * (count != 1)}; .save(file) writes it"

    def _repr_png_(self) -> bytes:
        """Return it as a notebook shows it."""
        written = BytesIO()
        self.figure().savefig(written, format="png", dpi=72)
        return written.getvalue()

    def figure(self) -> Figure:
        """Return it as a figure of matplotlib."""
        return figure_of(self)

    def interactive(self) -> Any:
        """Return it as a figure of plotly.

        Raises:
            InputError: plotly is not installed.
        """
        return interactive_of(self)

    def save(self, target: str | FilePath) -> None:
        """Write it as PNG, SVG, PDF or HTML, by the suffix; completely or not at all.

        An HTML file works without a network.

        Args:
            target: Path that ends in .png, .svg, .pdf or .html.

        Raises:
            InputError: Another suffix, a library that is not installed, or it cannot be written.
        """
        check_picture(str(target), "the picture")
        if FilePath(target).suffix.lower() == ".html":
            save_html(self, target)
        else:
            save(self.figure(), target)
