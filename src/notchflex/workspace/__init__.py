"""Where the tip of a robot can go: clouds of states, volumes and maps."""

from notchflex.workspace.cloud import Workspace
from notchflex.workspace.explore import workspace

__all__ = ["Workspace", "workspace"]
