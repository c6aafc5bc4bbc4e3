r"""What stands in a picture as text: our symbols as mathematics, all else letter by letter.

Names of robots, files, trials and models are a user's; `$`, `\frac`, `<b>` or `%{x}` in them must
neither break a picture nor be obeyed. Only the symbols of the table of quantities are taken as
mathematics. Both programs that draw get their texts through `translated`, and nowhere else.
"""

from __future__ import annotations

import dataclasses
import re
import textwrap
from collections.abc import Callable, Iterator, Sequence
from html import escape
from typing import Any, TypeVar, cast

from notchflex.results.quantities.registry import QUANTITIES

SYMBOLS = frozenset(one.symbol for one in QUANTITIES.values() if one.symbol) | {r"\mu"}

# A symbol may have the index of one of its entries: p_x, \theta_3, \theta_{12}.
_INDEX = r"(?:_(?:[xyz]|\d|\{\d+\}))?"
_PLAIN = sorted({symbol.removesuffix("_j") for symbol in SYMBOLS} | SYMBOLS)
_OURS = re.compile(r"\$((?:" + "|".join(map(re.escape, _PLAIN)) + f"){_INDEX})" + r"\$")
# Neither an SVG nor a UTF-8 file can hold these.
_UNPRINTABLE = re.compile("[\x00-\x08\x0b-\x1f\x7f\ud800-\udfff]")
_GREEK = {
    "theta": "θ", "psi": "ψ", "varepsilon": "ε", "eta": "η", "beta": "β", "lambda": "λ",
    "mu": "μ",
}  # fmt: skip
_ONE = ("name", "group", "text", "title", "x_label", "y_label", "z_label")
_MANY = ("names", "rows")
_LETTERS_AN_INCH = 11.0

Drawn = TypeVar("Drawn")


def translated(drawn: Drawn, translate: Callable[[str], str]) -> Drawn:
    """Return a picture, a panel or an item with every text in it translated.

    Args:
        drawn: A dataclass of `sheet.py`.
        translate: `for_paper` or `for_browser`.
    """
    changes: dict[str, Any] = {}
    for field in dataclasses.fields(cast("Any", drawn)):
        value = getattr(drawn, field.name)
        if field.name in _ONE:
            changes[field.name] = translate(value)
        elif field.name in _MANY and all(isinstance(one, str) for one in value):
            changes[field.name] = [translate(one) for one in value]
        elif dataclasses.is_dataclass(value):
            changes[field.name] = translated(value, translate)
        elif field.name in ("cells", "items", "legend") and not isinstance(value, str):
            parts = cast("Sequence[Any]", value)
            changes[field.name] = [translated(one, translate) for one in parts]
    return cast("Drawn", dataclasses.replace(cast("Any", drawn), **changes))


def for_paper(label: str) -> str:
    r"""Return a label as matplotlib takes it.

    Example:
        >>> for_paper(r"5 $ of \frac $\theta$")
        '5 \\$ of \\frac $\\theta$'
    """
    text = "".join(
        f"${part}$" if ours else part.replace("$", r"\$") for part, ours in _parts(label)
    )
    # matplotlib leaves what begins with an underscore out of its legends.
    return f" {text}" if text.startswith("_") else text


def for_browser(label: str) -> str:
    r"""Return a label as plotly takes it: as HTML.

    Example:
        >>> for_browser(r"notch angle $\theta_j$ [deg]")
        'notch angle θ<sub><i>j</i></sub> [deg]'
    """
    return "".join(
        _symbol(part)
        if ours
        # `%{` begins a value in a text that is shown under the pointer.
        else escape(part, quote=False).replace("\n", "<br>").replace("%{", "&#37;{")
        for part, ours in _parts(label)
    )


def heading_lines(title: str, width: float) -> list[str]:
    """Return the heading of a picture so wide [in] on as many lines as it needs."""
    lines = [
        part
        for line in title.split("\n")
        for part in textwrap.wrap(line, max(20, int(_LETTERS_AN_INCH * width)))
    ]
    return lines or [""]


def _parts(label: str) -> Iterator[tuple[str, bool]]:
    """Divide a label into our symbols (True) and what stands between them (False)."""
    label = _UNPRINTABLE.sub("�", label.replace("\t", " "))
    end = 0
    for found in _OURS.finditer(label):
        yield label[end : found.start()], False
        yield found[1], True
        end = found.end()
    yield label[end:], False


def _symbol(text: str) -> str:
    text = re.sub(r"\\mathrm\{(\w+)\}", r"\1", text)
    text = re.sub(r"\\([a-z]+)", lambda found: _GREEK[found[1]], text)
    text = re.sub(r"_\{?(\w+)\}?", r"<sub>\1</sub>", text)
    return re.sub(r"(?<![<\w/])([A-Za-z])(?![\w>])", r"<i>\1</i>", text)
