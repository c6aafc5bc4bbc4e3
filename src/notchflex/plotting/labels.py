r"""Escapes the texts of a picture: symbols of quantities are mathematics, all else is literal.

Names of robots, files, trials and models are chosen by users; `$`, `\frac`, `<b>` or `%{x}` in them
must neither break a picture nor be interpreted.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from html import escape, unescape

from notchflex.results.quantities.registry import QUANTITIES

SYMBOLS = frozenset(one.symbol for one in QUANTITIES.values() if one.symbol) | {r"\mu"}

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
