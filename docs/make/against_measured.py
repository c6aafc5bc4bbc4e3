"""Printed errors of Pacheco 2021 against its measurement; needs the data outside the repository."""

from __future__ import annotations

import numbers_pacheco2021


def tables() -> dict[str, str]:
    """Return what stands on the page; FileNotFoundError where there are no data."""
    made = numbers_pacheco2021.measured_numbers()
    return {name: made[name] for name in ("table4", "tips")}
