"""Keeping compiled programs between runs of the command line, so that only the first is slow."""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from pathlib import Path

VARIABLE = "JAX_COMPILATION_CACHE_DIR"


def use_compile_cache() -> None:
    """Keep compiled programs in the user's cache folder.

    Called before the first computation. The user may choose another folder
    (`JAX_COMPILATION_CACHE_DIR`, empty for none); nothing happens where no folder can be written.
    Compiled code belongs to one kind of processor, so each has a folder of its own: a home folder
    may be shared.
    """
    folder = cache_folder()
    if folder is None:
        return
    from notchflex._jax import jax
    from notchflex._kept import keep_in

    if VARIABLE not in os.environ:
        jax.config.update("jax_compilation_cache_dir", str(folder))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
        jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    # A folder that the user has chosen may be shared by machines that are not alike.
    keep_in(folder / f"programs-{_machine()}")


def cache_folder() -> Path | None:
    """Return where compiled code is kept, made if need be; None where it is not kept.

    What the user chose may be an address of a store, which JAX can write to and we cannot.
    """
    if VARIABLE in os.environ:
        chosen = os.environ[VARIABLE]
        return Path(chosen) if chosen and "://" not in chosen else None
    folder = _user_cache() / "notchflex" / f"compiled-{_machine()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return folder if os.access(folder, os.W_OK) else None
    except OSError:
        return None


def _user_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def _machine() -> str:
    """Return a short name of the kind of processor, its instruction sets included."""
    facts = [platform.machine(), platform.processor()]
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
        lines = text.splitlines()
        facts += [line for line in lines if line.startswith(("flags", "model name"))][:2]
    except OSError:
        pass
    return hashlib.sha256("\n".join(facts).encode()).hexdigest()[:12]
