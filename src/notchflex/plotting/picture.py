"""The picture of any result: it can be shown and saved."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, cast

from notchflex.errors import InputError
from notchflex.plotting.sheet import Sheet
from notchflex.results.files.writing import check_picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from notchflex.results import EquilibriumPath

SCREEN_DOTS = 72
"""Dots per inch of a picture in a notebook."""


@dataclass(frozen=True, repr=False)
class Picture(Sheet):
    """Panels on a grid, under a heading, for matplotlib, plotly and notebooks."""

    def figure(self) -> Figure:
        """Return it as a figure of matplotlib."""
        from notchflex.plotting.renderers.with_matplotlib import figure_of

        return figure_of(self)

    def __repr__(self) -> str:
        """Return its title and how to save it."""
        count = len(self.cells)
        return f"Picture {self.title!r} of {count} panel{'s' * (count != 1)}; .save(file) writes it"

    def _repr_png_(self) -> bytes:
        """Return it as a notebook shows it."""
        written = BytesIO()
        self.figure().savefig(written, format="png", dpi=SCREEN_DOTS)
        return written.getvalue()

    def interactive(self) -> Any:
        """Return it as a figure of plotly.

        Raises:
            InputError: plotly is not installed.
        """
        from notchflex.plotting.renderers.with_plotly import interactive_of

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
            from notchflex.plotting.renderers.with_plotly import save_html

            save_html(self, target)
        else:
            from notchflex.plotting.style import save

            save(self.figure(), target)


def picture(result: Any, *, title: str | None = None) -> Picture:
    """Describe the picture of a result, whatever its kind.

    Args:
        result: A `Robot`, an `EquilibriumPath`, an `Equilibrium`, a `Batch`, `Bands`, a
            `Comparison`, a `Calibration`, a `FrictionRig`, or a dict of label to path for several
            beside each other.
        title: Heading; that of its kind if None.

    Returns:
        The picture: `save` writes it as PNG, SVG, PDF or HTML, `figure` gives that of matplotlib,
        `interactive` that of plotly.

    Raises:
        InputError: It is not one of these results.

    Example:
        >>> import tempfile
        >>> import notchflex as nf
        >>> from notchflex.plotting import picture
        >>> state = nf.solve(nf.load_robot("pacheco2021-a"), nf.Load(tension=1.0))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     picture(state).save(f"{folder}/wrist.svg")
    """
    made = _picture(result)
    return made if title is None else replace(made, title=title)


def _picture(result: Any) -> Picture:
    # Imported late: these modules describe a `Picture`, and the fits take a second to import.
    from notchflex import plotting
    from notchflex.analysis import Bands, Batch
    from notchflex.comparison import Comparison
    from notchflex.plotting.path import robot_picture
    from notchflex.results import Equilibrium, EquilibriumPath
    from notchflex.robot import Robot

    kinds: dict[type, Callable[[Any], Picture]] = {
        Robot: robot_picture,
        EquilibriumPath: plotting.path_picture,
        Equilibrium: lambda state: plotting.state_picture(state.path, state.step),
        Batch: plotting.batch_picture,
        Bands: lambda bands: plotting.path_picture(bands.path, bands=bands),
        Comparison: plotting.comparison_picture,
    }
    if isinstance(result, Mapping) and all(
        isinstance(one, EquilibriumPath) for one in result.values()
    ):
        return plotting.beside_picture(cast("Mapping[str, EquilibriumPath]", result))
    if not isinstance(result, tuple(kinds)):
        from notchflex.fit import Calibration, FrictionRig

        kinds |= {Calibration: plotting.calibration_picture}
        kinds |= {FrictionRig: plotting.friction_picture}
    for kind, describe in kinds.items():
        if isinstance(result, kind):
            return describe(result)
    raise InputError.WRONG_TYPE(
        "a picture is made of a Robot, an EquilibriumPath, an Equilibrium, a Batch, a "
        f"Comparison, a Calibration, a FrictionRig or a dict of paths; got {type(result).__name__}."
    )
