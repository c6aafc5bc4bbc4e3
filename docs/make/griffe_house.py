"""How griffe, which reads the sources for the Python reference, is to take what is ours.

A class under `@part` (notchflex.robot) or `@record` (notchflex.specification) is a dataclass whose
annotations carry units and limits; the reference shows its plain types. A section `Example:` of a
docstring is one that is executed. A public function may have the name of the module that it stands
in; the reference shows the function.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

from notchflex.results.quantities import QUANTITIES

_DATACLASS = griffe.ExprName("dataclasses.dataclass", None)
_KEYWORDS = (griffe.ExprKeyword("kw_only", "True"),)
"""What `@record` means unless it says otherwise."""


class House(griffe.Extension):
    """Take `@part` as a dataclass, `Annotated` as its plain type, `Example:` as code."""

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        """Let `notchflex.solve` be the function in `analysis/solve.py`, not that module."""
        for name, member in list(pkg.members.items()):
            if not isinstance(member, griffe.Alias) or not member.target_path.startswith(pkg.path):
                continue
            folder = pkg[member.target_path.split(".")[1:-1]]
            function = folder.imports.get(name, "")
            inside = function.startswith(f"{member.target_path}.")
            if inside and folder.members[name].is_module:
                pkg.set_member(name, griffe.Alias(name, function, parent=pkg))

    def on_class_instance(self, *, cls: griffe.Class, **_: Any) -> None:
        """Take `@part`, `@part(kw_only=True)` and `@record()` as `@dataclass`."""
        for decorator in cls.decorators:
            value = decorator.value
            called = isinstance(value, griffe.ExprCall)
            name = str(value.function if called else value)
            if name not in ("part", "record"):
                continue
            if called:
                told = value.arguments if name == "part" else [*_KEYWORDS, *value.arguments]
                decorator.value = griffe.ExprCall(_DATACLASS, told)
            else:
                decorator.value = _DATACLASS

    def on_attribute_instance(self, *, attr: griffe.Attribute, **_: Any) -> None:
        """Show `float` for `Annotated[Float, quantity("mm", ...)]`; quantities with their text."""
        if attr.parent is not None and attr.parent.name == "_Quantities" and attr.docstring:
            attr.docstring.value += f"\n\n{QUANTITIES[attr.name].text}"
            attr.value = None
        annotation = attr.annotation
        if isinstance(annotation, griffe.ExprSubscript) and str(annotation.left) == "Annotated":
            inner = annotation.slice
            plain = inner.elements[0] if isinstance(inner, griffe.ExprTuple) else inner
            known = {"Float": "float", "FloatOrInf": "float", "Int": "int"}
            attr.annotation = known.get(str(plain), plain)

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        """Let griffe find the examples."""
        if obj.docstring is not None:
            text = re.sub(r"(?m)^(\s*)Example:$", r"\1Examples:", obj.docstring.value)
            obj.docstring.value = text
