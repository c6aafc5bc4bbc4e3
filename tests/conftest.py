"""Settings that all tests share."""

import gc
import os
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

import notchflex as nf
from chromium import browser  # noqa: F401
from margins import margin, pytest_terminal_summary  # noqa: F401
from wordings import pytest_addoption, wording  # noqa: F401

# JAX compiles within a test, which no deadline should time; CI draws the same examples each time.
settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")


def pytest_configure(config: pytest.Config) -> None:
    """Set JAX up by its environment variables: it need not be imported, and subprocesses follow."""
    # A shape that does not fit must not be stretched in silence.
    os.environ["JAX_NUMPY_RANK_PROMOTION"] = "raise"
    if "jax" in sys.modules:  # a plugin of pytest may have imported it before
        sys.modules["jax"].config.update("jax_numpy_rank_promotion", "raise")
    # Functions of the tests' own that JAX compiles run a few times.
    flags = os.environ.get("XLA_FLAGS", "")
    options = ["--xla_backend_optimization_level=0"]
    # The library's own programs go without these emitters (_jax.py); functions that users
    # differentiate can't choose, and are compiled in a third of the time without.
    if version("jax").split(".")[:2] < ["0", "11"]:
        options.append("--xla_cpu_use_fusion_emitters=false")
    os.environ["XLA_FLAGS"] = " ".join([flags, *options]).strip()
    # Tracing makes many objects that stay: looking for garbage that often costs 5 % of the time.
    gc.set_threshold(100_000, 20, 100)
    # Compiled code is kept beside pytest's own cache, for the other process of `-n 2` and later.
    cache = getattr(config, "cache", None)
    if cache is not None:
        os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(cache.mkdir("jax")))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Run all tests of a file in one process: they share programs and solved paths.

    Files go out in the order of their names, the longest first: so both processes end together.
    """
    from xdist.scheduler import LoadFileScheduling

    config.option.loadscopereorder = False
    return LoadFileScheduling(config, log)


# Files with nightly tests of more than a minute.
_LONGEST = (
    "lanewise/test_fuzz.py",
    "validation/test_pacheco2021_tube.py",
    "solver/test_forward_model.py",
    "photographs/test_to_constants.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the longest files; the order is otherwise kept."""
    items.sort(key=lambda item: not item.path.as_posix().endswith(_LONGEST))


# Compiled programs hold pieces of memory, of which Linux gives a process 65,530; the compiler
# crashes where there are none left. A process that runs half of all tests comes near.
_PIECES = 20_000


@pytest.fixture(autouse=True, scope="module")
def room_for_compiled_code() -> Iterator[None]:
    """Let go of compiled programs once there are very many."""
    yield
    maps = Path("/proc/self/maps")
    jax = sys.modules.get("jax")
    if jax is None or not maps.exists():
        return
    with maps.open() as lines:
        if sum(1 for _ in lines) > _PIECES:
            jax.clear_caches()
            sys.modules["notchflex.solver.programs.compiled"].Native.programs.clear()


@pytest.fixture(scope="session")
def wrist() -> nf.Robot:
    """Wrist A of Pacheco 2021."""
    return nf.load_robot("pacheco2021-a")


@pytest.fixture(scope="session")
def loop(wrist: nf.Robot) -> nf.EquilibriumPath:
    """A pull of wrist A until all notches are closed, and back: 8 steps."""
    return nf.simulate(wrist, nf.pull(0.0, 3.0, steps=4).release())
