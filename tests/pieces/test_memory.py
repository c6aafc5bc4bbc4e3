"""A sweep sets options of the C library for its threads, and puts them back at its end."""

import notchflex as nf
from notchflex.pieces import running
from swept import plan

PAD = -2  # M_TOP_PAD of <malloc.h>


class Library:
    """A C library that remembers what it was told."""

    def __init__(self):
        self.calls = []

    def mallopt(self, option, value):
        self.calls.append((option, value))

    def malloc_trim(self, pad):
        self.calls.append(("trim", pad))


def test_options_of_the_process_are_put_back(tmp_path, monkeypatch):
    library = Library()
    monkeypatch.setattr(running, "_c_library", lambda: library)
    nf.sweep(plan(), tmp_path / "s")
    pads = [value for option, value in library.calls if option == PAD]
    assert pads[0] == 64 * 2**20
    assert pads[-1] == 128 * 2**10
    assert library.calls[-1] == ("trim", 0)
