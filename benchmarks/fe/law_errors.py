"""Make law_errors.csv of notchflex.mechanics from tests/reference/fem_wrists_drawn.csv (seconds).

    python benchmarks/fe/law_errors.py

To be run again when the law of a notch changes. A wrist of which a notch is more than 10 % off
(root mean square over the loads) lies outside what the law covers: it is printed and left out.
"""

from __future__ import annotations

import sys
from pathlib import Path

from notchflex.mechanics.law_errors import Place

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from fem_wrists import drawn_wrists, errors_by_place

TABLE = Path(__file__).parents[2] / "src/notchflex/mechanics/law_errors.csv"

if __name__ == "__main__":
    lines = [",".join([*Place._fields, "error", "largest"])]
    for rows in drawn_wrists():
        places = errors_by_place(rows)
        if max(error for _, error, _ in places) > 0.1:
            print("left out:", *rows[0].values(), *(f"{error:.2f}" for _, error, _ in places))
            continue
        lines += [
            ",".join([*(f"{value:.5g}" for value in place), f"{error:.4f}", f"{largest:.4f}"])
            for place, error, largest in places
        ]
    TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")
