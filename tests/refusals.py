"""What a refused input tells: the code of its error, and what its message names."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

import notchflex as nf


@contextmanager
def refused(
    code: str | nf.ErrorCode, *names: str, error: type[nf.InputError] = nf.InputError
) -> Iterator[pytest.ExceptionInfo[nf.InputError]]:
    """Expect an InputError (or a class of it) of a code, whose message names all of `names`."""
    with pytest.raises(error) as caught:
        yield caught
    wanted = (
        nf.ErrorCode[code] if isinstance(code, str) and code in nf.ErrorCode.__members__ else code
    )
    assert caught.value.code is wanted, caught.value
    for name in names:
        assert name in str(caught.value)
