"""Asserts that something is refused with a code."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from notchflex.errors import InputError


@contextmanager
def refused(code: str) -> Iterator[pytest.ExceptionInfo[InputError]]:
    """Expect an `InputError` with a code."""
    with pytest.raises(InputError) as caught:
        yield caught
    assert caught.value.code is not None
    assert caught.value.code.name == code
