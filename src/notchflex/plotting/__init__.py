"""Pictures of results, for paper and for a browser (`pip install 'notchflex[plot]'`)."""

from notchflex.plotting.curves import COLOUR, LOADING, UNLOADING, branches
from notchflex.plotting.drawing import (
    INK,
    LETTER,
    MM,
    TEXT,
    dimensioned_figure,
    draw_row,
    label,
    notch_rows,
    paper,
    scale_text,
    usual_scale,
)
from notchflex.plotting.fits import (
    calibration_picture,
    comparison_figure,
    comparison_picture,
    friction_picture,
)
from notchflex.plotting.marks import Curve, Mark, Panel, dots, line
from notchflex.plotting.output import Picture
from notchflex.plotting.pictures import (
    beside_picture,
    path_figure,
    path_picture,
    picture,
    plot_on_axes,
    save_animation,
    state_picture,
)
from notchflex.plotting.results import (
    batch_picture,
    cycle_picture,
    following_picture,
    sensed_picture,
    sweep_picture,
    tolerance_picture,
    workspace_picture,
    workspaces_picture,
)
from notchflex.plotting.shapes import (
    HELD,
    AppliedLoad,
    applied_loads,
    bending_plane,
    body_corners,
    fair_growth,
    lips,
    prism,
    project,
    ring_solid,
    shape_at,
    shape_from_angles,
    state_shape,
    strip,
    tendon_line,
)
from notchflex.plotting.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    house_style,
    save,
)
from notchflex.plotting.with_matplotlib import draw_marks, draw_panel
from notchflex.plotting.with_plotly import chart_of

__all__ = [
    "BLACK", "BLUE", "COLOUR", "GREEN", "GREY", "HELD", "INK", "LETTER", "LOADING", "MM", "ORANGE",
    "PURPLE", "SKY", "TEXT", "UNLOADING", "VERMILLION", "AppliedLoad", "Curve", "Mark", "Panel",
    "Picture", "applied_loads", "batch_picture", "bending_plane", "beside_picture", "body_corners",
    "branches", "calibration_picture", "chart_of", "comparison_figure", "comparison_picture",
    "cycle_picture", "dimensioned_figure", "dots", "draw_marks", "draw_panel", "draw_row",
    "fair_growth", "following_picture", "friction_picture", "house_style", "label", "line", "lips",
    "notch_rows", "paper", "path_figure", "path_picture", "picture", "plot_on_axes", "prism",
    "project", "ring_solid", "save", "save_animation", "scale_text", "sensed_picture", "shape_at",
    "shape_from_angles", "state_picture", "state_shape", "strip", "sweep_picture", "tendon_line",
    "tolerance_picture", "usual_scale", "workspace_picture", "workspaces_picture",
]  # fmt: skip
