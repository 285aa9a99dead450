"""Names of all flags of a command, and how lists and vectors are written on the command line.

A list is written with commas, as in `--families pencil,regulus`, and a vector with spaces.

A TOML file of settings becomes flags of an equivalent command line.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, cast, get_args, get_origin

from tyro.conf import OmitArgPrefixes, UseAppendAction
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec

from grasp_core.declared import default_of
from grasp_core.errors import InputError
from grasp_core.kinds import Vector
from grasp_core.messages import near
from grasp_core.settings import types
from sim_validate.kit.command_flags import PLAIN
from sim_validate.kit.exit_codes import FlagsError

REGISTRY: Any = ConstructorRegistry()
"""How values of types that the parser of flags does not know are read."""


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
        inner = prefix if all_short or PLAIN in marks else f"{prefix}{name}."
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


def with_config(words: list[str], path: Path | None, command: Any) -> list[str]:
    """Put the settings of a TOML file before the flags, which then override them."""
    if path is None:
        return words
    flags = _read(path, command)
    first = next((place for place, word in enumerate(words) if word.startswith("-")), len(words))
    return [*words[:first], *flags, *words[first:]]


def flags_from(settings: Mapping[str, Any], command: Any) -> list[str]:
    """Turn settings into the words of an equivalent command line; tables hold groups of flags."""
    known = {flag.name: flag for flag in flags_of(command)}
    words = list[str]()
    for name, value in _named(settings):
        flag = known.get(name.replace("-", "_"))
        if flag is None:
            meant = near(name.replace("-", "_"), known)
            raise FlagsError(f"{name!r}: unknown flag; {meant or 'keys are long flags'}")
        words += _as_flags(flag, value)
    return words


def _named(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in settings.items():
        if isinstance(value, dict):
            yield from _named(cast("dict[str, Any]", value), f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _read(path: Path, command: Any) -> list[str]:
    """Read a file of settings as words of a command line."""
    # imported only when there is a file to read
    from sim_validate.kit.files import read_tables

    try:
        settings = read_tables(path)
    except InputError as error:
        raise InputError(f"--config {error}") from error
    try:
        return flags_from(settings, command)
    except InputError as error:
        raise type(error)(f"--config {path}: {error}") from None


def _as_flags(flag: Flag, value: Any) -> list[str]:
    word, items = "--" + flag.name.replace("_", "-"), _items(value)
    if any(isinstance(part, dict) for item in items for part in _items(item)):
        raise InputError(f"{flag.name}: expected a value or a list, got a table")
    if isinstance(value, bool):
        usual = next(default_of(each) for each in fields(flag.owner) if each.name == flag.field)
        said = word if value else word.replace("--", "--no-", 1)
        return [] if value is usual else [said]
    if listed(flag.kind) is not None:
        return [word, ",".join(map(str, items))]
    if UseAppendAction in get_args(flag.kind)[1:]:
        return [part for item in items for part in (word, *map(str, _items(item)))]
    return [word, *map(str, items)]


def _items(value: Any) -> Sequence[Any]:
    return cast("Sequence[Any]", value) if isinstance(value, list | tuple) else [value]
