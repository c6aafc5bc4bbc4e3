"""Loads: tensions, strokes and external loads, one after the other along a path."""

from notchflex.loads.external import BodyForce, ExternalLoad
from notchflex.loads.load import Load
from notchflex.loads.load_path import LoadPath
from notchflex.loads.ramps import pull, stroke_path

__all__ = ["BodyForce", "ExternalLoad", "Load", "LoadPath", "pull", "stroke_path"]
