"""Where the tip of a robot can go: clouds of states, volumes and maps."""

from notchflex.workspaces.cloud import (
    Overlap,
    Workspace,
    hull_of,
    overlaps,
    save_netcdf,
    workspace_document,
)
from notchflex.workspaces.explore import in_python, largest_tensions, workspace

__all__ = ["Overlap", "Workspace", "hull_of", "in_python", "largest_tensions"]
__all__ += ["overlaps", "save_netcdf"]
__all__ += ["workspace", "workspace_document"]
