"""One function for the picture of any result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

from notchflex.errors import InputError
from notchflex.plot.sheet import Picture

if TYPE_CHECKING:
    from notchflex.statics import Path


def picture(result: Any, *, title: str | None = None) -> Picture:
    """Describe the picture of a result, whatever its kind.

    Args:
        result: A `Path`, an `Equilibrium`, a `Batch`, a `Comparison`, or a dict of label to path
            for several beside each other.
        title: Heading; that of its kind if None.

    Returns:
        The picture: `save` writes it as PNG, SVG, PDF or HTML, `figure` gives that of matplotlib,
        `interactive` that of plotly.

    Raises:
        InputError: It is no result.

    Example:
        >>> import tempfile
        >>> import notchflex as nf
        >>> from notchflex.plot import picture
        >>> state = nf.solve(nf.load_robot("pacheco2021-a"), nf.Load(tension=1.0))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     picture(state).save(f"{folder}/wrist.svg")
    """
    from notchflex.compare import Comparison
    from notchflex.plot.batch import batch_picture
    from notchflex.plot.beside import beside_picture
    from notchflex.plot.comparison import comparison_picture
    from notchflex.plot.equilibrium import state_picture
    from notchflex.plot.path import path_picture
    from notchflex.statics import Batch, Equilibrium, Path

    named = {} if title is None else {"title": title}
    if isinstance(result, Path):
        return path_picture(result, **named)
    if isinstance(result, Equilibrium):
        return state_picture(result.path, result.step, **named)
    if isinstance(result, Batch):
        return batch_picture(result, **named)
    if isinstance(result, Comparison):
        return comparison_picture(result)
    if isinstance(result, Mapping) and all(isinstance(one, Path) for one in result.values()):
        return beside_picture(cast("Mapping[str, Path]", result), **named)
    raise InputError(
        "a picture is made of a Path, an Equilibrium, a Batch, a Comparison or a dict of paths; "
        f"got {type(result).__name__}."
    )
