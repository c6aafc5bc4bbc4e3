"""Describes the picture of any result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, cast

from notchflex import InputError
from notchflex.plotting.beside import beside_picture
from notchflex.plotting.output import Picture
from notchflex.plotting.path import path_picture, state_picture

if TYPE_CHECKING:
    from notchflex import Bands, Equilibrium, EquilibriumPath

# The class of a result, and what describes its picture: module in this folder, and function.
_KINDS = {
    "Robot": "path:robot_picture",
    "EquilibriumPath": "path:path_picture",
    "Equilibrium": "picture:equilibrium_picture",
    "Batch": "batch:batch_picture",
    "Bands": "picture:bands_picture",
    "Comparison": "fits.comparison:comparison_picture",
    "Calibration": "fits.calibration:calibration_picture",
    "FrictionRig": "fits.friction:friction_picture",
    "Design": "designs:design_picture",
    "DesignFront": "designs:front_picture",
    "ToleranceAnalysis": "tolerances.tolerances:tolerance_picture",
    "Following": "following:following_picture",
    "SensedForce": "following:sensed_picture",
    "Workspace": "workspace:workspace_picture",
}


def picture(result: Any, *, title: str | None = None) -> Picture:
    """Describe the picture of a result, whatever its kind.

    Args:
        result: A robot, a path, a state, a batch, bands, a comparison, a calibration or any other
            result that the library can draw, or a dict of label to path for several beside each
            other.
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
    drawn = _picture(result)
    return drawn if title is None else replace(drawn, title=title)


def _picture(result: Any) -> Picture:
    for kind in type(result).__mro__:
        if kind.__name__ in _KINDS and kind.__module__.startswith("notchflex."):
            module, _, function = _KINDS[kind.__name__].partition(":")
            return getattr(import_module(f"notchflex.plotting.{module}"), function)(result)
    paths = result.values() if isinstance(result, Mapping) else [result]
    if all(type(one).__name__ == "EquilibriumPath" for one in paths):
        return beside_picture(cast("Mapping[str, EquilibriumPath]", result))
    raise InputError.WRONG_TYPE(
        f"a picture is made of one of these: {', '.join(_KINDS)}, or of a dict of paths; got "
        f"{type(result).__name__}."
    )


def equilibrium_picture(state: Equilibrium) -> Picture:
    """Describe the picture of a state: that of its path, with the state in it."""
    return state_picture(state.path, state.step)


def bands_picture(bands: Bands) -> Picture:
    """Describe the picture of bands: that of the path that they surround."""
    return path_picture(bands.path, bands=bands)
