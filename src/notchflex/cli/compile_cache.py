"""Keeps what XLA compiles between runs of the command line, so that only the first is slow."""

from __future__ import annotations

import os

from notchflex.solver.programs import store


def use_compile_cache() -> None:
    """Let JAX keep its compiled programs beside those of the library.

    The library keeps its own programs in every process (`solver/programs/store.py`). JAX's settings
    belong to the whole process, so that they are changed on the command line only.
    """
    folder = store.program_folder()
    if folder is None or store.VARIABLE in os.environ:
        return
    from notchflex._jax import jax

    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
