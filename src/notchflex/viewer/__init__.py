"""A robot in the browser, with sliders for its loads (`pip install 'notchflex[viewer]'`).

`Session`, `TargetQueue`, `Controls` and the checks need no browser and none of the libraries of the
extra; `Viewer` and `Correction` need them.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from notchflex.viewer.server import HOST, PORT, check_host, check_installed, exposed

if TYPE_CHECKING:
    from notchflex.viewer.controls import Controls
    from notchflex.viewer.correction import Correction
    from notchflex.viewer.session import Session
    from notchflex.viewer.tasks import TargetQueue
    from notchflex.viewer.viewer import Viewer

__all__ = ["HOST", "PORT", "Controls", "Correction", "Session", "TargetQueue", "Viewer"]
__all__ += ["check_host", "check_installed", "exposed"]


def __getattr__(name: str) -> Any:
    """Import a name on first use: the command line only needs the checks."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = {"TargetQueue": "tasks"}.get(name, name.lower())
    return getattr(import_module(f"{__name__}.{module}"), name)
