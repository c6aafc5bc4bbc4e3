"""How fast the solver is, in multiples of a time that every machine knows."""

from notchflex.bench.cases import CASES, Case
from notchflex.bench.clock import Clock, Row
from notchflex.bench.document import bench_document, measured
from notchflex.bench.peers import MEASURED, PEERS, Peer
from notchflex.bench.processes import PROCESSES, Process

__all__ = [
    "CASES",
    "MEASURED",
    "PEERS",
    "PROCESSES",
    "Case",
    "Clock",
    "Peer",
    "Process",
    "Row",
    "bench_document",
    "measured",
]
