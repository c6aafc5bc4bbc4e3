"""Describes the picture of any result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

from notchflex.errors import InputError
from notchflex.plotting.batch import batch_picture
from notchflex.plotting.beside import beside_picture
from notchflex.plotting.designs.design import design_picture
from notchflex.plotting.designs.front import front_picture
from notchflex.plotting.fits.calibration import calibration_picture
from notchflex.plotting.fits.comparison import comparison_picture
from notchflex.plotting.fits.friction import friction_picture
from notchflex.plotting.output import Picture
from notchflex.plotting.path import path_picture, robot_picture, state_picture

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath


def picture(result: Any, *, title: str | None = None) -> Picture:
    """Describe the picture of a result, whatever its kind.

    Args:
        result: A `Robot`, an `EquilibriumPath`, an `Equilibrium`, a `Batch`, `Bands`, a
            `Comparison`, a `Calibration`, a `FrictionRig`, a `Design`, or a dict of label to path
            for several beside each other.
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
    from notchflex.analysis import Bands, Batch
    from notchflex.comparison import Comparison
    from notchflex.results import Equilibrium, EquilibriumPath
    from notchflex.robot import Robot

    kinds: dict[type, Callable[[Any], Picture]] = {
        Robot: robot_picture,
        EquilibriumPath: path_picture,
        Equilibrium: lambda state: state_picture(state.path, state.step),
        Batch: batch_picture,
        Bands: lambda bands: path_picture(bands.path, bands=bands),
        Comparison: comparison_picture,
    }
    is_dict = isinstance(result, Mapping) and not isinstance(result, tuple(kinds))
    if is_dict and all(isinstance(one, EquilibriumPath) for one in result.values()):
        return beside_picture(cast("Mapping[str, EquilibriumPath]", result))
    if not isinstance(result, tuple(kinds)):
        from notchflex.designing import Design, DesignFront
        from notchflex.fit import Calibration, FrictionRig  # takes a second

        kinds |= {Calibration: calibration_picture}
        kinds |= {FrictionRig: friction_picture, Design: design_picture}
        kinds |= {DesignFront: front_picture}
    for kind, describe in kinds.items():
        if isinstance(result, kind):
            return describe(result)
    raise InputError.WRONG_TYPE(
        "a picture is made of a Robot, an EquilibriumPath, an Equilibrium, a Batch, "
        "Bands, a Comparison, a Calibration, a FrictionRig, a Design or a dict of paths; got "
        f"{type(result).__name__}."
    )
