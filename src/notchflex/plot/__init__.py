"""Pictures of results, for paper and for a browser (`pip install 'notchflex[plot]'`)."""

from notchflex.plot.animation import save_animation
from notchflex.plot.batch import batch_picture
from notchflex.plot.beside import beside_picture
from notchflex.plot.calibration import calibration_figure, calibration_picture
from notchflex.plot.comparison import comparison_figure, comparison_picture
from notchflex.plot.equilibrium import state_picture
from notchflex.plot.friction import friction_figure, friction_picture
from notchflex.plot.path import path_figure, path_picture
from notchflex.plot.picture import picture
from notchflex.plot.sheet import Picture
from notchflex.plot.style import save

__all__ = [
    "Picture",
    "batch_picture",
    "beside_picture",
    "calibration_figure",
    "calibration_picture",
    "comparison_figure",
    "comparison_picture",
    "friction_figure",
    "friction_picture",
    "path_figure",
    "path_picture",
    "picture",
    "save",
    "save_animation",
    "state_picture",
]
