"""The command line: `notchflex` and `python -m notchflex`."""

import os

# The matrices are small: NumPy's own threads would wait for each other, at up to twenty times the
# processor time. Long computations (batches, calibration) have their own threads. This must be set
# before NumPy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# XLA prints two long errors whenever it reads back a program that it has compiled on this machine
# (jax-ml/jax#38445): level 3 leaves only fatal errors.
os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")

from notchflex.cli.app import main, run

__all__ = ["main", "run"]
