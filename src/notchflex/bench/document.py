"""The document of `notchflex bench --json`, with published figures of other programs."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from dataclasses import asdict
from datetime import date
from typing import Any

from notchflex import __version__
from notchflex._jax import jax
from notchflex.bench.measure import Row

MEASURED = (
    "measured by the authors of notchflex in November 2026 on a 2-core AMD EPYC, one thread, CPU "
    "time per static solution, each peer's own code and example"
)


# Program, what it solves, and the times of its fastest and its slowest model [ms].
PEERS: tuple[tuple[str, str, tuple[float, float]], ...] = (
    ("tdcr-modeling (C++)", "2 segments x 10 disks, four models", (6.0, 233.0)),
    ("ContinuumRobotExamples (C++)", "tendon rod by force", (3.4, 14.5)),
    ("ContinuumRobotExamples (C++)", "tendon rod by displacement", (92.0, 92.0)),
    ("PyElastica 1.0 (numba)", "tip-loaded rod, time steps to rest", (3800.0, 7400.0)),
    ("soromox 0.2 + Newton (JAX)", "10 / 20 segments, tip load", (1.04, 4.3)),
    ("opencr-mujoco", "20 links, settling", (81.0, 81.0)),
    ("Pacheco 2021's class (Octave)", "4-5 notches, friction, superelastic", (17.0, 377.0)),
)


def bench_document(rows: Sequence[Row]) -> dict[str, Any]:
    """Return rows, the machine they were measured on, and the figures of others, for `--json`."""
    peers = [{"name": name, "what": what, "ms": ms} for name, what, ms in PEERS]
    return {
        "notchflex": __version__,
        "date": date.today().isoformat(),
        "machine": {
            "processor": platform.processor() or platform.machine(),
            "cores": os.cpu_count(),
            "python": platform.python_version(),
            "jax": jax.__version__,
            "backend": jax.default_backend(),
        },
        "unit": "lu135: multiples of numpy.linalg.solve of 135 equations on one core, same run",
        "rows": [asdict(row) for row in rows],
        "peers": {"source": MEASURED, "rows": peers},
    }
