"""Where the tip of a robot can go: clouds of states, volumes and maps."""

from notchflex.workspaces.cloud import Workspace
from notchflex.workspaces.explore import workspace

__all__ = ["Workspace", "workspace"]
