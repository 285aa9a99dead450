"""Declares a setting once: its name, type, range and help are a field of a frozen dataclass.

    @dataclass(frozen=True, slots=True, repr=False)
    class Noise(Settings):
        shift: Annotated[float, Interval(ge=0.0, le=1.0)] = 0.01
        \"\"\"Deviation of the object's position along each axis, in object radii.\"\"\"

What functions take, tables of files and flags of commands are such classes, and all are checked in
`declared`, by their kinds and in the same words.
"""

from collections.abc import Collection, Mapping
from dataclasses import MISSING, fields, replace
from textwrap import shorten
from typing import Any, Self, TypeVar, cast, get_args

from grasp_core.allowed_values import inside
from grasp_core.declared import Declared, default_of, types
from grasp_core.errors import InputError
from grasp_core.messages import FieldError, at, shown

Given = TypeVar("Given", bound="Settings")
LONGEST_LINE = 200
"""Largest number of characters of the text that shows settings."""
CHOSEN = "chosen by the program"
"""Mark in the type of a field that a file cannot set, because each trial or command chooses it."""


class Settings(Declared):
    """Base of frozen dataclasses of settings, which tables of files and flags can give."""

    __slots__ = ()

    @classmethod
    def of_table(cls, table: object, where: str = "", usual: Any = None) -> Self:
        """Make settings from a table of a file; those of `usual` stand where it says nothing."""
        users, every = for_users(cls), fields(cast("Any", cls))
        chosen = {each.name: default_of(each) for each in every if each.name not in users}
        given = named(table, users, where, usual=chosen)
        for each in every:
            inner = inside(types(cls)[each.name], Settings)
            if each.name in given and inner is not None:
                own = default_of(each) if usual is None else getattr(usual, each.name)
                own = own if isinstance(own, inner) else None
                given[each.name] = inner.of_table(given[each.name], at(where, each.name), own)
            elif usual is None and each.name not in given and default_of(each) is MISSING:
                raise InputError(f"{at(where, each.name)}: missing; add it")
        try:
            return cls(**given) if usual is None else replace(usual, **given)
        except FieldError as error:
            raise FieldError(at(where, error.name), error.fault) from None
        except InputError as error:
            raise InputError(f"{where}: {error}" if where else str(error)) from None

    def __repr__(self) -> str:
        """Return the settings that differ from the usual ones, in a line."""
        differing = (
            f"{each.name}={value!r}"
            for each in fields(cast("Any", self))
            if (value := getattr(self, each.name)) != default_of(each)
        )
        said = f"{type(self).__name__}({', '.join(differing)})"
        return shorten(said, LONGEST_LINE, placeholder=" ...)")


def for_users(kind: type) -> tuple[str, ...]:
    """Return the names of the settings that users choose, in a file or by flags."""
    return tuple(name for name, each in types(kind).items() if CHOSEN not in get_args(each))


NONE_USUAL: Mapping[str, Any] = {}


def named(
    table: object, known: Collection[str], where: str, what: str = "setting",
    usual: Mapping[str, Any] = NONE_USUAL,
) -> dict[str, Any]:  # fmt: skip
    """Return a table of a file by name, without names of `usual` values; refuse unknown names."""
    start = f"{where}: " if where else ""
    if not isinstance(table, Mapping):
        raise InputError(f"{start}expected a table of {what}s, got {shown(table)}")
    entries = cast("Mapping[str, Any]", table)
    given = {
        name: value
        for name, value in entries.items()
        if not (name in usual and usual[name] == value)
    }
    for name in given:
        if name not in known:
            raise InputError(
                f"{start}no {what} is named {shown(name)}; choose from {', '.join(known)}"
            )
    return given


def extended(kind: type[Given], part: Settings, **more: Any) -> Given:
    """Make settings of a class, and those inside, from those of a class that it extends."""
    given: dict[str, Any] = {name: getattr(part, name) for name in types(type(part))} | more
    for name, value in given.items():
        own = inside(types(kind)[name], Settings)
        if own is not None and isinstance(value, Settings) and not isinstance(value, own):
            given[name] = extended(own, value)
    return kind(**given)


def as_table(settings: Settings) -> dict[str, Any]:
    """Return the settings of users as a table of a file, which has no word for None."""
    given = {name: getattr(settings, name) for name in for_users(type(settings))}
    return {
        name: as_table(value) if isinstance(value, Settings) else value
        for name, value in given.items()
        if value is not None
    }
