"""Fields of the parts of a robot, as pydantic records them: kinds, lists and keys."""

import dataclasses
import functools
import types
import typing
from collections.abc import Mapping
from typing import Annotated, Any, Union


def kinds_in(annotation: Any) -> list[type]:
    """List the part classes that an annotation of a field allows."""
    if typing.get_origin(annotation) is Annotated:
        return kinds_in(typing.get_args(annotation)[0])
    if typing.get_origin(annotation) in (Union, types.UnionType, tuple):
        return [cls for item in typing.get_args(annotation) for cls in kinds_in(item)]
    is_part = isinstance(annotation, type) and dataclasses.is_dataclass(annotation)
    return [annotation] if is_part else []


def is_list(field: Any) -> bool:
    """Return whether a field (pydantic's record of it; None takes nothing) takes a list."""

    def takes(annotation: Any) -> bool:
        origin = typing.get_origin(annotation)
        if origin in (Annotated, Union, types.UnionType):
            return any(map(takes, typing.get_args(annotation)))
        return origin is tuple

    return field is not None and takes(field.annotation)


def is_unsaid(name: str, value: object) -> bool:
    """Return whether files and lists leave a key out: without a value, or a factor of 1."""
    return value is None or (name.endswith("_factor") and value == 1.0)


@functools.cache
def kind_of(cls: type) -> str:
    """Return the word that names a kind in a file, "" for a part that comes in one kind only."""
    kind = fields_of(cls).get("kind")
    return "" if kind is None else str(kind.default)


@functools.cache  # asked for each value that is set by its name
def fields_of(cls: type) -> Mapping[str, Any]:
    """Return pydantic's field records, in the order in which a file lists the keys.

    That is `kind`, then what the class itself declares, then what all kinds share.
    """
    pydantic_fields: dict[str, Any] = getattr(cls, "__pydantic_fields__", {})
    shared = {f.name for f in dataclasses.fields(cls) if f.kw_only}
    order = sorted(pydantic_fields.items(), key=lambda item: (item[0] != "kind", item[0] in shared))
    return types.MappingProxyType(dict(order))
