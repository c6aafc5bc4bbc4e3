"""Pictures of results, made with matplotlib (`pip install 'notchflex[plot]'`)."""

from notchflex.plot.comparison import comparison_figure
from notchflex.plot.path import path_figure
from notchflex.plot.style import save

__all__ = ["comparison_figure", "path_figure", "save"]
