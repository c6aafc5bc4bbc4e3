"""What others take for one static solution: figures with their source and date."""

from __future__ import annotations

from dataclasses import dataclass

MEASURED = (
    "measured by the authors of notchflex in November 2026 on a 2-core AMD EPYC, one thread, CPU "
    "time per static solution, each peer's own code and example"
)


@dataclass(frozen=True)
class Peer:
    """Another program.

    Attributes:
        name: Its name.
        what: What it solves.
        ms: Time of one static solution, ms, from the fastest of its models to the slowest.
    """

    name: str
    what: str
    ms: tuple[float, float]


PEERS = (
    Peer("tdcr-modeling (C++)", "2 segments x 10 disks, four models", (6.0, 233.0)),
    Peer("ContinuumRobotExamples (C++)", "tendon rod by force", (3.4, 14.5)),
    Peer("ContinuumRobotExamples (C++)", "tendon rod by displacement", (92.0, 92.0)),
    Peer("PyElastica 1.0 (numba)", "tip-loaded rod, time steps to rest", (3800.0, 7400.0)),
    Peer("soromox 0.2 + Newton (JAX)", "10 / 20 segments, tip load", (1.04, 4.3)),
    Peer("opencr-mujoco", "20 links, settling", (81.0, 81.0)),
    Peer("Pacheco 2021's class (Octave)", "4-5 notches, friction, superelastic", (17.0, 377.0)),
)
