r"""Style of all pictures: colours for all kinds of colour vision, sizes, texts, saving.

Figures are objects (`matplotlib.figure.Figure`), made without pyplot: no window, no global state.

Names of robots, files, trials and models are chosen by users; `$`, `\frac`, `<b>` or `%{x}` in them
must neither break a picture nor be interpreted.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from html import escape, unescape
from pathlib import Path as FilePath
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from notchflex.support import PAPER, QUANTITIES, check_picture, replacing

Colour = str | tuple[float, ...]

# notation: the eight colours of Okabe and Ito (2008), made for all kinds of colour vision.
BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#7F7F7F"

MODEL_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE)
"""Colours of models, robots or workspaces beside each other."""

DOTS_PER_INCH = 200

SETTINGS: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.alpha": 0.3,
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.4,
    # Note stays text in SVG and PDF: small files, and the words can be searched and edited.
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    "svg.hashsalt": "notchflex",  # the same picture gives the same file
}


@contextmanager
def house_style() -> Generator[None]:
    """Apply the settings of our pictures inside the `with` only."""
    with matplotlib.rc_context(SETTINGS):
        yield


def new_figure(width: float, height: float, title: str = "") -> Figure:
    """Return an empty figure of a size [in] that arranges its axes by itself."""
    figure = Figure(figsize=(width, height), layout="constrained")
    if title:
        figure.suptitle(title, fontsize=11.0)
    return figure


def rgb(colour: Any) -> tuple[float, float, float]:
    """Return red, green and blue of a colour, each from 0 to 1."""
    return to_rgb(colour)


def pale(colour: Colour, part: float) -> Colour:
    """Return a part of a colour, the rest white."""
    return tuple(1.0 - part * (1.0 - channel) for channel in rgb(colour))


def sequence_colours(count: int) -> list[Colour]:
    """Return `count` colours from dark to light, also in grey print."""
    # The lightest fifth of the map is too pale for lines on white paper.
    return [tuple(c) for c in matplotlib.colormaps["viridis"](np.linspace(0.0, 0.82, count))]


def diverging_colour(value: float) -> Colour:
    """Return the colour of a value from -1 (orange) to 1 (purple), white in the middle."""
    return matplotlib.colormaps["PuOr"](0.5 + 0.5 * value)


def save(figure: Figure, target: str | FilePath) -> None:
    """Write a figure as PNG, SVG or PDF, by the suffix; completely or not at all.

    Args:
        figure: What to write.
        target: Path that ends in .png, .svg or .pdf.

    Raises:
        InputError: Another suffix, or the file cannot be written.
    """
    check_picture(str(target), "the picture", kinds=PAPER)
    suffix = FilePath(target).suffix.lower()
    # Without dates the same picture is the same file, byte for byte.
    dates = {".svg": "Date", ".pdf": "CreationDate"}
    options: dict[str, Any] = {"format": suffix[1:], "dpi": DOTS_PER_INCH, "bbox_inches": None}
    options["metadata"] = {dates[suffix]: None} if suffix in dates else {}
    with house_style(), replacing(target) as temporary:
        figure.savefig(temporary, **options)


SYMBOLS = frozenset(row.symbol for row in QUANTITIES.values() if row.symbol) | {r"\mu"}

# A symbol may have the index of one of its entries: p_x, \theta_3, \theta_{12}.
_INDEX = r"(?:_(?:[xyz]|\d|\{\d+\}))?"
_PLAIN = sorted({symbol.removesuffix("_j") for symbol in SYMBOLS} | SYMBOLS)
_SYMBOL = re.compile(r"\$((?:" + "|".join(map(re.escape, _PLAIN)) + f"){_INDEX})" + r"\$")
# Neither an SVG nor a UTF-8 file can hold these.
_UNPRINTABLE = re.compile("[\x00-\x08\x0b-\x1f\x7f\ud800-\udfff]")
_LETTERS_PER_INCH = 11.0


def for_paper(label: str) -> str:
    r"""Return a label as matplotlib takes it.

    Example:
        >>> for_paper(r"5 $ of \frac $\theta$")
        '5 \\$ of \\frac $\\theta$'
    """
    parts = (f"${part}$" if symbol else part.replace("$", r"\$") for part, symbol in _parts(label))
    text = "".join(parts)
    # matplotlib omits legend entries that begin with an underscore.
    return f" {text}" if text.startswith("_") else text


def for_browser(label: str) -> str:
    r"""Return a label as plotly takes it: as HTML.

    Example:
        >>> for_browser(r"notch angle $\theta_j$ [deg]")
        'notch angle <i>θ<sub>j</sub></i> [deg]'
    """
    # `%{` begins a value in a text that is shown under the pointer.
    return "".join(
        _html(part)
        if symbol
        else escape(part, quote=False).replace("\n", "<br>").replace("%{", "&#37;{")
        for part, symbol in _parts(label)
    )


def heading_lines(title: str, width: float) -> list[str]:
    """Break the heading of a picture of a width [in] into lines."""
    letters = max(20, int(_LETTERS_PER_INCH * width))
    return [part for line in title.split("\n") for part in textwrap.wrap(line, letters)] or [""]


def _parts(label: str) -> Iterator[tuple[str, bool]]:
    """Split a label into symbols of quantities (True) and the text between them (False)."""
    # Splitting by one group returns what it matched at every second place.
    for index, part in enumerate(_SYMBOL.split(_UNPRINTABLE.sub("�", label.replace("\t", " ")))):
        yield part, index % 2 == 1


def _html(symbol: str) -> str:
    text = re.sub(r"\\mathrm\{(\w+)\}", r"\1", symbol)
    text = unescape(re.sub(r"\\(?:var)?([a-z]+)", r"&\1;", text))
    return "<i>" + re.sub(r"_\{?(\w+)\}?", r"<sub>\1</sub>", text) + "</i>"
