"""The command line: `notchflex` and `python -m notchflex`."""

import os

# The matrices here are small: NumPy's own threads would wait for each other, at up to twenty times
# the processor time. What takes long (batches, calibration) has threads of its own. It must be said
# before NumPy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from notchflex.cli.app import main, run

__all__ = ["main", "run"]
