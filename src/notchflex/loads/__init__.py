"""Loads: tensions, strokes and external loads, one after the other along a path."""

from notchflex.loads.load import BodyForce, ExternalLoad, Load
from notchflex.loads.load_path import LoadPath, pull, stroke_path

__all__ = ["BodyForce", "ExternalLoad", "Load", "LoadPath", "pull", "stroke_path"]
