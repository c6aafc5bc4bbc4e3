"""Write the table of errors of lanewise's elementary functions into docs/lanewise.md.

Usage: python docs/make/lanewise_accuracy.py. It needs long doubles of 64 digits (x86).
"""

import importlib.util
from pathlib import Path

import numpy as np

from lanewise import Program, lower, machine_code
from lanewise.elementary import ELEMENTARY

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "lanewise.md"
BEGIN, END = "<!-- accuracy -->", "<!-- end of accuracy -->"


def cases() -> dict:
    """Return arguments, functions in long doubles and limits: those of the tests."""
    path = ROOT / "tests" / "lanewise" / "test_elementary.py"
    spec = importlib.util.spec_from_file_location("test_elementary", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.CASES


def row(name: str, arguments: tuple, function, limit: float) -> str:
    """Return a row of the table: errors of the compiled function in units in the last place."""
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
    return f"| `{name}` | {spans} | {size:,} | {error.mean():.2f} | {error.max():.2f} | {limit} |"


def main() -> None:
    """Measure all functions and write the table."""
    lines = [
        "| function | arguments | number | mean error, ulp | largest error, ulp | limit of the tests, ulp |",  # noqa: E501
        "| --- | --- | --- | --- | --- | --- |",
        *(row(name, *case) for name, case in cases().items()),
    ]
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    text = f"{before}{BEGIN}\n" + "\n".join(lines) + f"\n{END}{after}"
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
