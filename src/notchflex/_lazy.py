"""Names of a module that are imported when first used (PEP 562)."""

import sys
from collections.abc import Callable, Mapping


def loader(module: str, homes: Mapping[str, str]) -> Callable[[str], object]:
    """Return a `__getattr__` that imports a name from its home and keeps it."""

    def load(name: str) -> object:
        from importlib import import_module

        if name not in homes:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        value = getattr(import_module(homes[name]), name)
        setattr(sys.modules[module], name, value)
        return value

    return load
