"""How far a test stays inside its tolerance: recorded with the result, listed after the run."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

_KEY = "margin"


class Margin:
    """Holds errors against their tolerance and remembers the worst of each."""

    def __init__(self, record: Callable[[str, object], None]) -> None:
        self._record = record

    def within(self, what: str, error: object, allowed: float, unit: str = "") -> float:
        """Assert that the largest |error| is at most `allowed`; an absent number fails."""
        values = np.abs(np.asarray(error, dtype=float))
        worst = float(np.max(values)) if values.size else float("nan")
        self.note(f"{what}: {worst:.2e} of {allowed:g} {unit}".rstrip())
        assert worst <= allowed, f"{what}: worst {worst:.3e} {unit}, allowed {allowed:g}"
        return worst

    def note(self, text: str) -> None:
        """List a measured number without judging it."""
        print(text)
        self._record(_KEY, text)


@pytest.fixture
def margin(record_property) -> Margin:
    return Margin(record_property)


def pytest_terminal_summary(terminalreporter) -> None:
    """List what every test measured (works under xdist, where prints stay with the workers)."""
    lines = [
        f"{report.nodeid.split('/')[-1]}  {text}"
        for outcome in ("passed", "failed")
        for report in terminalreporter.getreports(outcome)
        for key, text in getattr(report, "user_properties", ())
        if key == _KEY
    ]
    if lines:
        terminalreporter.write_sep("-", "worst error of each check, and what is allowed")
        for line in sorted(set(lines)):
            terminalreporter.write_line(line)
