"""Speed of the solver, in multiples of a reference time that every machine can measure."""

from notchflex.bench.measure import MEASURED, PEERS, BenchRow, bench_document, measured

__all__ = ["MEASURED", "PEERS", "BenchRow", "bench_document", "measured"]
