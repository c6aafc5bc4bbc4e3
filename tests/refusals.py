"""Input that is refused: asserted by its error code, not by its sentence."""

from collections.abc import Generator
from contextlib import contextmanager

import pytest

from notchflex.errors import ErrorCode, InputError


@contextmanager
def refused(code: ErrorCode) -> Generator[pytest.ExceptionInfo[InputError]]:
    """Assert that the block raises an `InputError` with a code."""
    with pytest.raises(InputError) as problem:
        yield problem
    assert problem.value.code is code, problem.value
