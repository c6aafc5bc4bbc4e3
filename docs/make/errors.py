"""Writes docs/errors.md from the enumerations of failures and of kinds of invalid input.

`python docs/make/errors.py`; a test compares the page with `page()`.
"""

from __future__ import annotations

import re
from pathlib import Path

from notchflex.errors import ErrorCode, Failure

FILE = Path(__file__).resolve().parents[1] / "errors.md"
HEAD = """\
# Errors and failures

Every failure has a code, which programs can compare; messages may change from version to version.

- **Invalid input** raises [`InputError`][notchflex.InputError]. Its message names the value, what
  is allowed and what to do; its `code` is an [`ErrorCode`](#invalid-input). On the command line the
  message goes to standard error, and the exit code is 2.
- **A load without equilibrium** raises nothing. `reason` of the result says why, and `reason_code`
  is the name of a [`Failure`](#failures-of-a-solve); both are in the JSON document too. The exit
  code is 1. `raise_if_failed()` raises [`ConvergenceError`][notchflex.ConvergenceError], whose
  `code` is the `Failure`.

```python
import notchflex as nf

try:
    nf.load_robot("pacheco2021")
except nf.InputError as error:
    print(f"{error.code}: {error.code.remedy}")
```

```text
UNKNOWN_NAME: use one of the names that the message lists
```
"""


def page() -> str:
    """Return the text of the page."""
    failures = "".join(_entry(one) for one in Failure)
    codes = "".join(_entry(one) for one in ErrorCode)
    return f"{HEAD}\n## Failures of a solve\n{failures}\n## Invalid input\n{codes}"


def _entry(code: Failure | ErrorCode) -> str:
    text = re.sub(r"\{[^}]*\}", "…", code.text)  # numbers of the result
    what, remedy = (f"{one[:1].upper()}{one[1:]}." for one in (text, code.remedy))
    return f"\n### `{code.name}` {{#{code.name.lower()}}}\n\n{what}\n\n**Remedy:** {remedy}\n"


if __name__ == "__main__":
    FILE.write_text(page(), encoding="utf-8")
