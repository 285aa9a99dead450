"""Declares a setting once: its name, type, range and help are a field of a frozen dataclass.

    @dataclass(frozen=True, slots=True, repr=False)
    class Noise(Settings):
        shift: Annotated[float, Range(least=0.0, most=1.0)] = 0.01
        \"\"\"Deviation of the object's position along each axis, in object radii.\"\"\"

What functions take, tables of files and flags of commands are such classes, and all are checked
here, against their types and in the same words. Types are float, int, bool, str, Path, `Literal`,
tuples, other settings, and each of them or None. `Annotated` narrows them by rules such as `Range`,
which tell whether a value `holds` and, as text, what they ask for. Nothing that is slow to import
is imported here, since command-line help waits for it.
"""

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, fields, replace
from functools import cache
from numbers import Integral, Real
from pathlib import Path
from textwrap import shorten
from types import UnionType
from typing import (
    Annotated,
    Any,
    Literal,
    Self,
    TypeAlias,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

from grasp_core.checked import (
    LARGEST,
    LARGEST_FRICTION,
    MOST_COUNT,
    MOST_EDGES,
    MOST_SEED,
    SMALLEST,
    shown,
)
from grasp_core.errors import InputError

Given = TypeVar("Given", bound="Settings")
LONGEST_LINE = 200
"""Largest number of characters of the text that shows settings."""


@dataclass(frozen=True, slots=True)
class Range:
    """Ends of a range of numbers; without an upper end numbers must be finite."""

    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None

    def holds(self, value: float) -> bool:
        """Return whether a number is in the range."""
        inside = math.isfinite(value) if self.most is None else value <= self.most
        return (
            inside
            and (self.above is None or value > self.above)
            and (self.least is None or value >= self.least)
            and (self.below is None or value < self.below)
        )

    def __str__(self) -> str:
        """Return the ends in words."""
        words = {"above": "above", "least": "from", "below": "below", "most": "up to"}
        ends = {word: getattr(self, name) for name, word in words.items()}
        return " ".join(f"{word} {end:g}" for word, end in ends.items()
                        if end is not None and not math.isinf(end))  # fmt: skip


@dataclass(frozen=True, slots=True)
class Ending:
    """Endings of a path's name, in upper or lower case."""

    endings: tuple[str, ...]

    def holds(self, value: Path) -> bool:
        """Return whether a path has one of the endings."""
        return value.suffix.lower() in self.endings

    def __str__(self) -> str:
        """Return the endings in words."""
        return f"that ends in {' or '.join(self.endings)}"


@dataclass(frozen=True, slots=True)
class Size:
    """Range of the largest part of a vector in size, so that it is no zero vector."""

    least: float = SMALLEST
    most: float = LARGEST

    def holds(self, value: tuple[float, ...]) -> bool:
        """Return whether the largest part is in the range."""
        return self.least <= max(map(abs, value)) <= self.most

    def __str__(self) -> str:
        """Return the range in words."""
        return f"that are not all zero: the largest is from {self.least:g} to {self.most:g} in size"


Quantity = Annotated[float, Range(least=SMALLEST, most=LARGEST)]
"""A length, force or similar quantity in SI units of a plausible size."""
NotNegative = Annotated[float, Range(least=0.0, most=LARGEST)]
Friction = Annotated[float, Range(least=SMALLEST, most=LARGEST_FRICTION)]
Count = Annotated[int, Range(least=1, most=MOST_COUNT)]
Seed = Annotated[int, Range(least=0, most=MOST_SEED)]
Vector = tuple[float, float, float]
Direction = Annotated[Vector, Size()]


CHOSEN = "chosen by the program"
"""Mark in the type of a field that a file cannot set, because each trial or command chooses it."""


class SettingError(InputError):
    """Error for a setting of the wrong type or size; `name` is that of its field."""

    owner: type | None = None
    """Class of the settings."""

    def __init__(self, name: str, fault: str) -> None:
        super().__init__(name, fault)
        self.name, self.fault = name, fault

    def __str__(self) -> str:
        """Return the name of the field and what is wrong with it: 'must be .., got ..'."""
        return f"{self.name} {self.fault}"


class Settings:
    """Base of frozen dataclasses of settings, whose fields are checked against their types."""

    __slots__ = ()

    def __post_init__(self) -> None:
        try:
            check(self)
        except SettingError as error:
            error.owner = type(self)
            raise
        self._check_together()

    def _check_together(self) -> None:
        """Refuse fields that do not fit each other; classes replace it where some may not."""

    @classmethod
    def of_table(cls, table: object, where: str = "", usual: Any = None) -> Self:
        """Make settings from a table of a file, with those of `usual` where it says nothing.

        `where` leads to the table, such as 'execution'. An unknown name, a missing one and a value
        that the class refuses are errors that name the setting.
        """
        given = named(table, for_users(cls), where)
        for each in fields(cast("Any", cls)):
            inner = _settings_in(types(cls)[each.name])
            if each.name in given and inner is not None:
                own = default_of(each) if usual is None else getattr(usual, each.name)
                own = own if isinstance(own, inner) else None
                given[each.name] = inner.of_table(given[each.name], _at(where, each.name), own)
            elif usual is None and each.name not in given and default_of(each) is MISSING:
                raise InputError(f"{_at(where, each.name)}: missing; add it")
        try:
            return cls(**given) if usual is None else replace(usual, **given)
        except SettingError as error:
            raise SettingError(_at(where, error.name), error.fault) from None
        except InputError as error:  # settings that do not fit each other
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


def default_of(each: Field[Any]) -> Any:
    """Return the default of a field; `MISSING` if it has none."""
    return each.default if each.default_factory is MISSING else each.default_factory()


def check(settings: object) -> None:
    """Check all fields of a dataclass against their types, and keep them in plain form."""
    for name, kind in types(type(settings)).items():
        value = getattr(settings, name)
        try:
            plain = taken(value, kind)
        except ValueError:
            came = str(value) if isinstance(value, Path) else value
            said = f"must be {words(kind)}, got {shown(came)}"
            raise SettingError(name, said) from None
        if plain is not value:
            object.__setattr__(settings, name, plain)


def for_users(kind: type) -> tuple[str, ...]:
    """Return the names of the settings that users choose, in a file or by flags."""
    return tuple(name for name, each in types(kind).items() if CHOSEN not in get_args(each))


@cache
def types(kind: type) -> Mapping[str, Any]:
    """Return the types of a dataclass's fields, with their rules."""
    hints = get_type_hints(kind, include_extras=True)
    return {each.name: hints[each.name] for each in fields(cast("Any", kind))}


def taken(value: Any, kind: Any) -> Any:
    """Return a value in the plain form of a type: lists as tuples, numbers as Python's.

    A value that the type does not allow is a `ValueError`.
    """
    parts = get_args(kind)
    if get_origin(kind) is Annotated:
        rules = [part for part in parts[1:] if hasattr(part, "holds")]
        ranged = any(isinstance(rule, Range) for rule in rules)
        found = _number(value) if ranged and parts[0] is float else taken(value, parts[0])
        if not all(rule.holds(found) for rule in rules):
            raise ValueError
        return found
    if get_origin(kind) in (Union, UnionType):
        for part in parts:
            try:
                return taken(value, part)
            except ValueError:
                continue
        raise ValueError
    if get_origin(kind) is tuple:
        return _tuple(value, parts)
    if get_origin(kind) is Literal:
        allowed = isinstance(value, str | int) and value in parts and not isinstance(value, bool)
    elif kind is float:
        value = _number(value)
        allowed = math.isfinite(value)
    elif kind is Path:
        allowed = isinstance(value, str | Path) and value != "" and "\0" not in str(value)
        value = Path(value) if allowed else value
    elif kind is int:
        allowed = not isinstance(value, bool) and isinstance(value, Integral)
        value = int(value) if allowed else value
    else:
        allowed = value is None if kind is type(None) else isinstance(value, kind)
    if not allowed:
        raise ValueError
    return value


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ValueError
    try:
        number = float(value)
    except OverflowError:
        raise ValueError from None
    if math.isnan(number):
        raise ValueError
    return number


def _tuple(value: Any, parts: tuple[Any, ...]) -> tuple[Any, ...]:
    entries = getattr(getattr(value, "dtype", None), "kind", "f")  # those of numpy's arrays
    if isinstance(value, str | bytes) or not isinstance(value, Iterable) or entries not in "iuf":
        raise ValueError
    items = tuple(cast("Iterable[Any]", value))
    kinds = parts[:1] * len(items) if parts[-1] is Ellipsis else parts
    if len(kinds) != len(items):
        raise ValueError
    return tuple(map(taken, items, kinds))


def words(kind: Any) -> str:
    """Return in words what values a type allows: 'a number from 0 to 1'."""
    parts = get_args(kind)
    if get_origin(kind) is Annotated:
        return " ".join(
            [words(parts[0]), *(str(part) for part in parts[1:] if hasattr(part, "holds"))]
        )
    if get_origin(kind) in (Union, UnionType):
        return " or ".join(words(part) for part in parts if part is not type(None))
    if get_origin(kind) is tuple and parts[-1] is Ellipsis:
        return f"a sequence, each item {words(parts[0])}"
    if get_origin(kind) is tuple:
        each = "" if parts[0] is float else f", each {words(parts[0])}"
        return f"{len(parts)} numbers{each}"
    if get_origin(kind) is Literal:
        return f"one of {', '.join(map(str, parts))}"
    plain = {float: "a number", int: "a whole number", bool: "true or false", str: "text",
             Path: "a path", type(None): "None"}  # fmt: skip
    return plain.get(kind) or f"a {kind.__name__}"


def named(table: object, known: Collection[str], where: str) -> dict[str, Any]:
    """Return a table of a file by name, if it is one and nothing in it is unknown."""
    start = f"{where}: " if where else ""
    if not isinstance(table, Mapping):
        raise InputError(f"{start}expected a table of settings, got {shown(table)}")
    given = {**cast("Mapping[str, Any]", table)}
    for name in given:
        if name not in known:
            raise InputError(
                f"{start}no setting is named {shown(name)}; choose from {', '.join(known)}"
            )
    return given


def _at(where: str, name: str) -> str:
    return f"{where}.{name}" if where else name


def _settings_in(kind: Any) -> type[Settings] | None:
    """Return the class of settings that a type names, alone or beside None."""
    parts = get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)
    return next((p for p in parts if isinstance(p, type) and issubclass(p, Settings)), None)


AnyFriction = Annotated[float, Range(least=0.0, most=LARGEST_FRICTION)]
Share = Annotated[float, Range(least=0.0, most=1.0)]
Gap = Annotated[float, Range(least=1e-4, most=0.9)]
"""A gap of a proof: less is left to rounding, and more the first twist proves."""
TimeLimit = Annotated[float, Range(least=0.0, most=1e7)]
Cases = Annotated[int, Range(least=1, most=10**8)]
Reserve = Annotated[float, Range(least=0.0, below=1.0)]
MaxCones = Annotated[int, Range(least=64, most=1_000_000)]
"""Number of cones of a proof of regions, which begins with the 64 orthants."""
FaceTurn = Annotated[float, Range(least=0.0, most=45.0)]
"""An angle between normals of like faces [deg]: beyond it, a face of a box and its chamfer would be
like each other."""
TorqueLimit = Annotated[float, Range(above=0.0, most=1e6)]
HandClearance = Annotated[float, Range(least=0.0, most=0.02)]
Starts = Annotated[int, Range(least=1, most=10_000)]
Edges = Annotated[int, Range(least=3, most=MOST_EDGES)]
RandomWrenches = Annotated[int, Range(least=0, most=10_000)]
Repeats = Annotated[int, Range(least=0, most=100_000)]

Family: TypeAlias = Literal["concurrent", "pencil", "regulus"]
"""The family of a grasp, by how its four lines of force meet: concurrent, pencil or regulus among
others."""
Method: TypeAlias = Literal["concurrent", "pencil", "regulus", "free"]
"""How grasps are searched for: by one of the paper's three constructions, or free of any family."""
METHODS: tuple[Method, ...] = get_args(Method)
ConeKind: TypeAlias = Literal["tilted", "normal"]
RankBy: TypeAlias = Literal["radius", "friction-margin", "ferrari-canny", "payload", "diverse"]
"""What makes one grasp better than another (see `plan`)."""


def extended(kind: type[Given], part: Settings, **more: Any) -> Given:
    """Make settings of a class from those of a class that it extends, and from `more`.

    Settings inside them are extended in the same way.
    """
    given: dict[str, Any] = {name: getattr(part, name) for name in types(type(part))} | more
    for name, value in given.items():
        inner = _settings_in(types(kind)[name])
        if inner is not None and isinstance(value, Settings) and not isinstance(value, inner):
            given[name] = extended(inner, value)
    return kind(**given)


def value_of(kind: Any, value: Any, name: str) -> Any:
    """Return a single value in the plain form of a type; one that it does not allow is an error."""
    try:
        return taken(value, kind)
    except ValueError:
        raise SettingError(name, f"must be {words(kind)}, got {shown(value)}") from None


def as_table(settings: Settings) -> dict[str, Any]:
    """Return the settings of users as the table of a file that gives them when it is read.

    What is None is left out, as TOML has no word for it.
    """
    given = {name: getattr(settings, name) for name in for_users(type(settings))}
    return {
        name: as_table(value) if isinstance(value, Settings) else value
        for name, value in given.items()
        if value is not None
    }
