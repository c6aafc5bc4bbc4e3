"""Long computations in pieces, one file each, by threads or dask; resumed after a stop."""

from notchflex.pieces.folder import (
    ACCEPTED,
    CODES,
    FAILED,
    INVALID,
    REJECTED,
    Manifest,
    PieceTask,
    check_target,
    damaged,
    encoded,
    heads,
    piece_file,
)
from notchflex.pieces.run import PieceFolder, Progress
from notchflex.pieces.statistics import (
    Scale,
    Sketch,
    add_to,
    scale_of,
    sobol_points,
    summed_up,
)

__all__ = ["ACCEPTED", "CODES", "FAILED", "INVALID", "REJECTED"]
__all__ += ["Manifest", "PieceFolder", "PieceTask", "Progress", "Scale", "Sketch"]
__all__ += ["add_to", "check_target", "damaged", "encoded", "heads", "piece_file"]
__all__ += ["scale_of", "sobol_points", "summed_up"]
