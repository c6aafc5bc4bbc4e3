"""Write the table of errors of lanewise's elementary functions into docs/lanewise.md.

Usage: python docs/make/lanewise_accuracy.py. It needs long doubles of 64 digits (x86).
"""

import importlib.util
import sys
from pathlib import Path

import numpy as np

from lanewise import Program, lower, machine_code
from lanewise.elementary import ELEMENTARY

sys.path.append(str(Path(__file__).resolve().parents[1] / "papers"))
from page import rewrite, table

ROOT = Path(__file__).resolve().parents[2]
PAGE = "../lanewise.md"  # from the folder of page.py


def cases() -> dict:
    """Return arguments, functions in long doubles and limits: those of the tests."""
    path = ROOT / "tests" / "lanewise" / "test_elementary.py"
    spec = importlib.util.spec_from_file_location("test_elementary", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.CASES


def row(name: str, case: tuple) -> tuple:
    """Return a row of the table: errors of the compiled function in units in the last place."""
    arguments, function, limit = case
    size = len(arguments[0])
    lowered, _ = lower(ELEMENTARY[name], arguments, (size,))
    program = Program(machine_code(lowered.text), lowered.sizes, lowered.memory, None)
    (result,) = program(arguments)
    with np.errstate(all="ignore"):
        exact = function(*(one.astype(np.longdouble) for one in arguments))
    rounded = exact.astype(float)
    kept = np.isfinite(rounded) & (abs(rounded) > 2.0**-1022)
    unit = np.spacing(abs(rounded[kept])).astype(np.longdouble)
    error = (abs(result[kept] - exact[kept]) / unit).astype(float)
    spans = "; ".join(f"{one.min():.3g} to {one.max():.3g}" for one in arguments)
    print(name, round(error.max(), 2))
    return f"`{name}`", spans, f"{size:,}", f"{error.mean():.2f}", f"{error.max():.2f}", limit


def main() -> None:
    """Measure all functions and write the table."""
    head = ("function", "arguments", "number")
    errors = (f"{what}, ulp" for what in ("mean error", "largest error", "limit of the tests"))
    rewrite(PAGE, {"accuracy": table((*head, *errors), (row(*case) for case in cases().items()))})


if __name__ == "__main__":
    main()
