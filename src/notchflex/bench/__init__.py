"""Speed of the solver, in multiples of a reference time that every machine can measure."""

from notchflex.bench.document import MEASURED, PEERS, bench_document
from notchflex.bench.measure import Row, measured

__all__ = ["MEASURED", "PEERS", "Row", "bench_document", "measured"]
