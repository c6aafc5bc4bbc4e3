"""Pictures of results, for paper and for a browser (`pip install 'notchflex[plot]'`)."""

from notchflex.plotting.animation import save_animation
from notchflex.plotting.batch import batch_picture
from notchflex.plotting.beside import beside_picture
from notchflex.plotting.drawings.dimensioned import dimensioned_figure
from notchflex.plotting.fits.calibration import calibration_picture
from notchflex.plotting.fits.comparison import comparison_figure, comparison_picture
from notchflex.plotting.fits.friction import friction_picture
from notchflex.plotting.following import following_picture, sensed_picture
from notchflex.plotting.output import Picture
from notchflex.plotting.path import path_figure, path_picture, state_picture
from notchflex.plotting.picture import picture
from notchflex.plotting.style import save
from notchflex.plotting.tolerances.tolerances import tolerance_picture
from notchflex.plotting.workspace import workspace_picture, workspaces_picture

__all__ = [
    "Picture",
    "batch_picture",
    "beside_picture",
    "calibration_picture",
    "comparison_figure",
    "comparison_picture",
    "dimensioned_figure",
    "following_picture",
    "friction_picture",
    "path_figure",
    "path_picture",
    "picture",
    "save",
    "save_animation",
    "sensed_picture",
    "state_picture",
    "tolerance_picture",
    "workspace_picture",
    "workspaces_picture",
]
