"""Turns the text of a flag into its value, where tyro does not know its type, and lists all flags.

A list is written with commas, as in `--families pencil,regulus`, and a vector with spaces.
"""

from collections.abc import Iterator
from dataclasses import dataclass, is_dataclass
from typing import Annotated, Any, Literal, get_args, get_origin

from tyro.conf import OmitArgPrefixes, UseAppendAction
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec

from grasp_core.allowed_values import Vector
from grasp_core.settings import types
from sim_validate.commands.flags import BARE

REGISTRY: Any = ConstructorRegistry()


@dataclass(frozen=True, slots=True)
class Flag:
    """A flag of a command: its name without dashes, and the field that it sets."""

    name: str
    owner: type
    field: str
    kind: Any


def flags_of(command: Any, prefix: str = "", *, short: bool = False) -> Iterator[Flag]:
    """Yield the flags of a command, or of each command in a group, with those of their groups."""
    if not is_dataclass(command):
        for part in get_args(command):
            yield from flags_of(part, prefix, short=short)
        return
    for name, kind in types(command).items():  # type: ignore[arg-type]
        marks = get_args(kind)[1:] if get_origin(kind) is Annotated else ()
        groups = [part for part in parts_of(kind) if isinstance(part, type) and is_dataclass(part)]
        if not groups:
            yield Flag(prefix + name, command, name, kind)  # type: ignore[arg-type]
        all_short = short or OmitArgPrefixes in marks
        inner = prefix if all_short or BARE in marks else f"{prefix}{name}."
        for group in groups:
            yield from flags_of(group, inner, short=all_short)


def parts_of(kind: Any) -> Iterator[Any]:
    """Yield a type, and all types that it is made of."""
    yield kind
    for part in get_args(kind):
        yield from parts_of(part)


def listed(kind: Any) -> Any:
    """Return the type of the items of a list that is written with commas; None for other types."""
    if get_origin(kind) is Annotated:
        return None if UseAppendAction in get_args(kind)[1:] else listed(get_args(kind)[0])
    if get_origin(kind) is not tuple or get_args(kind)[-1] is not Ellipsis:
        return None
    item = get_args(kind)[0]
    item = get_args(item)[0] if get_origin(item) is Annotated else item
    return item if get_origin(item) is Literal or item in (int, float) else None


@REGISTRY.primitive_rule
def _list(info: Any) -> PrimitiveConstructorSpec[Any] | None:
    item = None if UseAppendAction in info.markers else listed(info.type)
    if item is None:
        return None
    choices = f"{{{','.join(map(str, get_args(item)))}}}" if get_args(item) else "NUMBER"
    read = str if get_args(item) else item
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=f"{choices},...",
        instance_from_str=lambda words: tuple(
            read(word.strip()) for word in words[0].split(",") if word
        ),
        is_instance=lambda value: isinstance(value, tuple),
        str_from_instance=lambda value: [",".join(map(str, value))],
    )


@REGISTRY.primitive_rule
def _vector(info: Any) -> PrimitiveConstructorSpec[Any] | None:
    if info.type != Vector:
        return None
    return PrimitiveConstructorSpec(
        nargs=3,
        metavar="X Y Z",
        instance_from_str=lambda words: tuple(map(float, words)),
        is_instance=lambda value: isinstance(value, tuple),
        str_from_instance=lambda value: [f"{part:g}" for part in value],
    )
