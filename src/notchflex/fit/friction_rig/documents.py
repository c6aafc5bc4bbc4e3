"""The friction rig as a JSON document."""

from __future__ import annotations

from typing import Any

from notchflex import __version__
from notchflex.fit.friction_rig.readings import COLUMNS
from notchflex.fit.friction_rig.rig import FrictionRig
from notchflex.results.quantities.registry import DEGREES


def friction_document(rig: FrictionRig) -> dict[str, Any]:
    """Return an estimate as a document for `notchflex.results.files.json.write_json`.

    Args:
        rig: The estimate.

    Returns:
        `coefficient`, `interval_95`, `standard_error`, `spread`, `scatter`, `outliers` (numbers of
        readings from 1), `without_outliers`, `constant` (the test), what it means in `words`, and
        every reading with its own coefficient.
    """
    readings, test = rig.readings, rig.constancy
    rows: list[dict[str, Any]] = []
    for number in range(len(readings)):
        row: dict[str, Any] = {"line": readings.lines[number]} if readings.lines else {}
        for place, (name, columns) in enumerate(COLUMNS.items()):
            scale = DEGREES if columns[0].endswith("_deg") else 1.0
            row[columns[0]] = getattr(readings, name)[number] * scale
            row[columns[1]] = readings.deviation[number, place] * scale
        row["coefficient"] = readings.coefficient[number]
        row["coefficient_sd"] = readings.coefficient_deviation[number]
        rows.append(row)
    return {
        "program": "notchflex",
        "version": __version__,
        "data": readings.source,
        "coefficient": rig.coefficient,
        "interval_95": rig.interval,
        "standard_error": rig.standard_error,
        "spread": rig.spread,
        "scatter": rig.scatter,
        "outliers": [number + 1 for number in rig.outliers],
        "without_outliers": rig.without_outliers,
        "constant": {
            "enough": test.enough,
            "statistic": test.statistic,
            "degrees_of_freedom": test.degrees_of_freedom,
            "p_value": test.p_value,
            "by_turn_per_rad": test.by_turn,
            "by_turn_standard_error": test.by_turn_error,
            "by_log_load": test.by_load,
            "by_log_load_standard_error": test.by_load_error,
        },
        "words": rig.words,
        "ignored_columns": readings.ignored,
        "readings": rows,
    }
