"""Outcome codes of one row of a computation in pieces, and of one drawn robot."""

CODES = ("accepted", "rejected", "NOT_CONVERGED", "INVALID_ROBOT")
"""Outcome of a robot; the last two meet no limit and count as rejected."""

ACCEPTED, REJECTED, FAILED, INVALID = range(len(CODES))
