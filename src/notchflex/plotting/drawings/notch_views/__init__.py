"""Views of every kind of notch for dimensioned drawings."""

from notchflex._imports import import_all
from notchflex.plotting.drawings.notch_views.view import NotchView, notch_view

import_all(__name__, __path__)

__all__ = ["NotchView", "notch_view"]
