"""The command line: `notchflex` and `python -m notchflex`."""

import os

# The matrices here are small: NumPy's own threads would wait for each other, at up to twenty times
# the processor time. What takes long (batches, calibration) has threads of its own. It must be said
# before NumPy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# XLA prints two long errors whenever it reads a program back that it has compiled on this very
# machine (jax-ml/jax#38445): level 3 leaves only what ends the process.
os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")

from notchflex.cli.app import main, run

__all__ = ["main", "run"]
