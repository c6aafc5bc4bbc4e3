"""What a refused input tells: the code of its error, and what its message names."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

import notchflex as nf


@contextmanager
def refused(code: str | nf.ErrorCode, *names: str) -> Iterator[pytest.ExceptionInfo[nf.InputError]]:
    """Expect an InputError of a code, whose message names all of `names`."""
    with pytest.raises(nf.InputError) as caught:
        yield caught
    assert caught.value.code is (nf.ErrorCode[code] if isinstance(code, str) else code)
    for name in names:
        assert name in str(caught.value)
