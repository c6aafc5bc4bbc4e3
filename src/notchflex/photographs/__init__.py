"""Photographs: the notch angles of bent robots, the notches of straight ones, with deviations."""

from notchflex.photographs.board import Board, board_of
from notchflex.photographs.measure import measure
from notchflex.photographs.measure_cut import measure_cut
from notchflex.photographs.measured import MeasuredCut, MeasuredPhotograph, MeasuredPhotographs

__all__ = [
    "Board",
    "MeasuredCut",
    "MeasuredPhotograph",
    "MeasuredPhotographs",
    "board_of",
    "measure",
    "measure_cut",
]
