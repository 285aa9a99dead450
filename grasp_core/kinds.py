"""Tells which values an argument or a field may hold: by the kinds of types, and in their words.

Kinds are float, int, bool, str, `Path`, `Literal`, enumerations, tuples, mappings, other classes,
and each of them or None. `Annotated` narrows a kind by rules: `Annotated[float, Range(least=0.0)]`.
A rule tells whether a value `holds` and, as text, what it asks for; a rule that can `take` does all
of it, such as `grasp_core.arrays.Shape`. Single values that users pass are checked by `value_of`,
the fields of frozen dataclasses in `declared`. Nothing that is slow to import is imported here,
since command-line help waits for it.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sized
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from numbers import Integral, Real
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, TypeAlias, TypeVar, Union, cast, get_args, get_origin

from grasp_core.errors import InputError

Value = TypeVar("Value")

SMALLEST, LARGEST = 1e-9, 1e9
"""Smallest and largest length, force or similar quantity in SI units: others are mistakes."""
LARGEST_FRICTION = 1e3
"""Largest Coulomb coefficient; no material comes near it. A larger critical friction is reported as
infinite, and a larger input is refused."""
MOST_COUNT = 10**9
"""Largest count accepted: anything larger would take longer than anybody waits."""
MOST_SEED = 2**64 - 1
MOST_EDGES = 10_000
"""Most edges of a pyramid for a friction cone: it equals the cone to seven digits."""
HUGE = 10**100
"""Whole numbers above this are shown by their size: Python does not write the largest ones."""
SHOWN = 60
"""Largest number of characters of a refused value that a message shows."""


Take = Callable[[Any], Any]
"""A function that returns a value in the plain form of a kind; `UnfitError` if it is not of it."""


class UnfitError(ValueError):
    """Error for a value that is not of a kind; its text says why, where the kind's words do not."""


class FieldError(InputError):
    """Error for an argument or a field of the wrong type or size; `name` is its name."""

    owner: type | None = None
    """Class of the field."""

    def __init__(self, name: str, fault: str) -> None:
        super().__init__(name, fault)
        self.name, self.fault = name, fault

    def __str__(self) -> str:
        """Return the name of the field and what is wrong with it: 'must be .., got ..'."""
        return f"{self.name} {self.fault}"


@dataclass(frozen=True, slots=True)
class Range:
    """Ends of a range of numbers; without an upper end numbers must be finite."""

    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    where: str = ""  # what the ends are, for messages that name them

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
        said = " ".join(f"{word} {end:g}" for word, end in ends.items()
                        if end is not None and not math.isinf(end))  # fmt: skip
        return said + self.where


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


@dataclass(frozen=True, slots=True)
class Many:
    """Range of the number of items of a sequence."""

    least: int = 1
    most: int = MOST_COUNT

    def holds(self, value: Sized) -> bool:
        """Return whether a sequence has neither fewer nor more items."""
        return self.least <= len(value) <= self.most

    def __str__(self) -> str:
        """Return the range in words."""
        return f"(at least {self.least}, at most {self.most})"

    def fault(self, value: Sized) -> str:
        """Return in words why a sequence has too few or too many items."""
        most = f" and at most {self.most}" if self.most < MOST_COUNT else ""
        return f"must have a length of at least {self.least}{most}, got {len(value)}"


@dataclass(frozen=True, slots=True)
class Null:
    """The number that null stands for in a file: infinity, or NaN where a simulation diverged."""

    value: float

    def holds(self, _value: float) -> bool:
        """Return True: any number may be there."""
        return True

    def __str__(self) -> str:
        """Return in words which number may be there besides finite ones."""
        return f"or {self.value}"


Quantity = Annotated[float, Range(least=SMALLEST, most=LARGEST)]
"""A length, force or similar quantity in SI units of a plausible size."""
Signed = Annotated[float, Range(least=-LARGEST, most=LARGEST)]
"""A number of a plausible size, of either sign."""
NotNegative = Annotated[float, Range(least=0.0, most=LARGEST)]
Friction = Annotated[float, Range(least=SMALLEST, most=LARGEST_FRICTION)]
FrictionOrZero = Annotated[float, Range(least=0.0, most=LARGEST_FRICTION)]
Share = Annotated[float, Range(least=0.0, most=1.0)]
Gap = Annotated[float, Range(least=1e-4, most=0.9)]
"""A gap of a proof: less is left to rounding, and more the first twist proves."""
TimeLimit = Annotated[float, Range(least=0.0, most=1e7)]
Cases = Annotated[int, Range(least=1, most=10**8)]
Reserve = Annotated[float, Range(least=0.0, below=1.0)]
MaxCones = Annotated[int, Range(least=64, most=1_000_000)]
"""Number of cones of a proof of regions, which begins with the 64 orthants."""
FaceTurn = Annotated[float, Range(least=0.0, most=45.0)]
"""Angle between normals of like faces [deg]: beyond it, a chamfer would be like its box's face."""
TorqueLimit = Annotated[float, Range(above=0.0, most=1e6)]
HandClearance = Annotated[float, Range(least=0.0, most=0.02)]
Starts = Annotated[int, Range(least=1, most=10_000)]
Edges = Annotated[int, Range(least=3, most=MOST_EDGES)]
RandomWrenches = Annotated[int, Range(least=0, most=10_000)]
Repeats = Annotated[int, Range(least=0, most=100_000)]
Count = Annotated[int, Range(least=1, most=MOST_COUNT)]
Number = Annotated[int, Range(least=0, most=MOST_COUNT)]
"""A number of things, of which there may be none."""
FaceSets = Annotated[int, Range(least=0, most=10**18)]
"""Number of sets of faces, of which 400 faces have more than a thousand million."""
Seed = Annotated[int, Range(least=0, most=MOST_SEED)]
Vector = tuple[float, float, float]
Direction = Annotated[Vector, Size()]
Family: TypeAlias = Literal["concurrent", "pencil", "regulus"]
"""The family of a grasp, by how its four lines of force meet."""
Method: TypeAlias = Literal["concurrent", "pencil", "regulus", "free"]
"""How grasps are searched for: by one of the paper's three constructions, or free of any family."""
METHODS: tuple[Method, ...] = get_args(Method)
ConeKind: TypeAlias = Literal["tilted", "normal"]
RankBy: TypeAlias = Literal[
    "radius", "friction-margin", "ferrari-canny", "payload", "placement", "diverse"
]  # fmt: skip
"""What makes one grasp better than another (see `plan`)."""
RANKINGS: Mapping[RankBy, str] = {
    "radius": "the largest discs, of each family in turn",
    "friction-margin": "the least critical friction",
    "ferrari-canny": "the largest Ferrari-Canny quality",
    "payload": "the largest mass in any orientation under one squeeze with pushes up to 10 N, less "
    "for objects with a radius below 25 mm",
    "placement": "the largest proved chance of closure where the object is off by 2 mm, less for "
    "objects with a radius below 25 mm, and 2 degrees",
    "diverse": "for each next grasp, the largest distance from those before it",
}
"""What the best grasps have by each ranking."""
MeasureName: TypeAlias = Literal["ferrari-canny", "weight", "task"]
"""Which loads count: wrenches of unit length, the weight in every orientation, or a user's loads.
"""
HANDS = ("allegro", "allegro-urdf", "leap")
"""The names of the built-in hands."""
OrInfinity = Annotated[float, Null(math.inf)]
"""A number that is infinite where nothing ever happens; null in files."""
Measured = Annotated[float, Null(math.nan)]
"""A number that is NaN where a simulation diverged; null in files."""


@lru_cache(maxsize=1024)
def takes(kind: Any, *, exact: bool = False) -> Take:
    """Return the function that takes values of a kind in plain form; if `exact`, as they are."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin in COMPOUND:
        return COMPOUND[origin](parts, exact)
    if origin is not None and issubclass(origin, Mapping):
        return _mapping(parts, exact)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return _member(kind)
    return (EXACT if exact else PLAIN).get(kind) or _instance(origin or kind, exact)


def _if(allowed: Callable[[Any], bool]) -> Take:
    def take(value: Any) -> Any:
        if not allowed(value):
            raise UnfitError
        return value

    return take


def _literal(parts: tuple[Any, ...], _exact: bool) -> Take:
    return _if(lambda value: type(value) is not bool and isinstance(value, str | int)
               and value in parts)  # fmt: skip


def _narrowed(parts: tuple[Any, ...], exact: bool) -> Take:
    """Take values of a kind that its rules allow."""
    kind, *given = parts
    rules = [rule for rule in given if hasattr(rule, "holds")]
    own = next((rule for rule in given if hasattr(rule, "take")), None)
    if own is not None:
        inner: Take = own.exact if exact else own.take
    elif kind is float and rules:
        nothing = [rule.value for rule in rules if isinstance(rule, Null)]
        endless = any(isinstance(rule, Range) for rule in rules) or any(map(math.isinf, nothing))
        inner = _numbers(endless=endless, nan=any(map(math.isnan, nothing)), exact=exact)
    else:
        inner = takes(kind, exact=exact)

    def take(value: Any) -> Any:
        plain = inner(value)
        for rule in rules:
            if not rule.holds(plain):
                raise UnfitError(rule.fault(plain) if isinstance(rule, Many) else "")
        return plain

    return take if rules else inner


def _first_of(parts: tuple[Any, ...], exact: bool) -> Take:
    each = [takes(part, exact=exact) for part in parts]

    def take(value: Any) -> Any:
        faults: list[str] = []
        for one in each:
            try:
                return one(value)
            except UnfitError as fault:
                faults.append(str(fault))
        raise UnfitError(next(filter(None, faults), ""))

    return take


def _numbers(*, endless: bool, nan: bool = False, exact: bool = False) -> Take:
    """Take real numbers as Python's floats; those that are not finite only if asked to."""
    allowed = float | int if exact else Real  # narrower ones of numpy round what they are beside

    def take(value: Any) -> float:
        if type(value) is not float:
            if isinstance(value, bool) or not isinstance(value, allowed):
                raise UnfitError
            try:
                value = float(value)
            except OverflowError:
                raise UnfitError from None
        if not math.isfinite(value) and not (nan if math.isnan(value) else endless):
            raise UnfitError
        return value

    return take


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise UnfitError
    return int(value)


def _path(value: Any) -> Path:
    if not isinstance(value, str | Path) or value == "" or "\0" in str(value):
        raise UnfitError
    return Path(value)


PLAIN: Mapping[Any, Take] = {
    Any: lambda value: value, float: _numbers(endless=False), int: _whole, Path: _path,
    type(None): _if(lambda value: value is None), bool: _if(lambda value: isinstance(value, bool)),
    str: _if(lambda value: isinstance(value, str)),
}  # fmt: skip
EXACT: Mapping[Any, Take] = {
    **PLAIN, float: _numbers(endless=False, exact=True),
    int: _if(lambda value: isinstance(value, int) and not isinstance(value, bool)),
}  # fmt: skip


def _member(kind: type[Enum]) -> Take:
    def take(value: Any) -> Any:
        try:
            return kind(value)
        except ValueError:
            raise UnfitError from None

    return take


def _instance(kind: Any, exact: bool) -> Take:
    sound = getattr(kind, "is_sound", None) if exact else None
    return _if(lambda value: isinstance(value, kind) and (sound is None or sound(value)))


def _tuple(parts: tuple[Any, ...], exact: bool) -> Take:
    endless = parts[-1:] == (Ellipsis,)
    each = [takes(part, exact=exact) for part in parts if part is not Ellipsis]

    def take(value: Any) -> tuple[Any, ...]:
        if exact and not isinstance(value, tuple):
            raise UnfitError
        entries = getattr(
            getattr(cast("Any", value), "dtype", None), "kind", "f"
        )  # those of numpy's arrays
        text = isinstance(value, str | bytes | Mapping)
        if text or not isinstance(value, Iterable) or entries not in "iuf":
            raise UnfitError
        items = tuple(cast("Iterable[Any]", value))
        if not endless and len(items) != len(each):
            raise UnfitError
        takers = each * len(items) if endless else each
        return tuple(one(item) for one, item in zip(takers, items, strict=True))

    return take


def _mapping(parts: tuple[Any, ...], exact: bool) -> Take:
    key, one = (takes(part, exact=exact) for part in parts)

    def take(value: Any) -> dict[Any, Any]:
        if not isinstance(value, Mapping):
            raise UnfitError
        return {key(name): one(each) for name, each in cast("Mapping[Any, Any]", value).items()}

    return take


COMPOUND: Mapping[Any, Callable[[tuple[Any, ...], bool], Take]] = {
    Annotated: _narrowed, Union: _first_of, UnionType: _first_of, tuple: _tuple, Literal: _literal,
}  # fmt: skip
"""How a kind with parts takes values, by what it is made with."""


def words(kind: Any) -> str:
    """Return in words what values a kind allows: 'a number from 0 to 1'."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        own = next((str(part) for part in parts[1:] if hasattr(part, "take")), words(parts[0]))
        narrower = [str(part) for part in parts[1:]
                    if hasattr(part, "holds") and not hasattr(part, "take")]  # fmt: skip
        return " ".join([own, *filter(None, narrower)])
    if origin in (Union, UnionType):
        return " or ".join(words(part) for part in parts if part is not type(None))
    if origin is tuple or (isinstance(origin, type) and issubclass(origin, Mapping)):
        return _words_of_items(cast("type", origin), parts)
    if origin is Literal:
        return f"one of {', '.join(map(str, parts))}"
    if isinstance(kind, type) and issubclass(kind, Enum):
        return f"one of {', '.join(str(each.value) for each in kind)}"
    plain = {float: "a number", int: "a whole number", bool: "true or false", str: "text",
             Path: "a path", type(None): "None"}  # fmt: skip
    named = cast("Any", origin or kind)
    return plain.get(cast("Any", kind)) or f"a {getattr(named, '__name__', 'value')}"


def _words_of_items(origin: type, parts: tuple[Any, ...]) -> str:
    if origin is not tuple:
        return f"a table, each key {words(parts[0])}, each value {words(parts[1])}"
    if parts[-1] is Ellipsis:
        return f"a sequence, each item {words(parts[0])}"
    if any(part != parts[0] for part in parts):
        return f"{len(parts)} items: {', '.join(map(words, parts))}"
    each = "" if parts[0] is float else f", each {words(parts[0])}"
    inner = get_args(parts[0])[0] if get_origin(parts[0]) is Annotated else parts[0]
    return f"{len(parts)} {'numbers' if inner in (float, int) else 'items'}{each}"


def inside(kind: Any, wanted: type) -> Any:
    """Return the class of a kind that is one of `wanted`, alone or beside None; None if none is."""
    if get_origin(kind) is Annotated:
        return inside(get_args(kind)[0], wanted)
    parts = get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)
    return next((p for p in parts if isinstance(p, type) and issubclass(p, wanted)), None)


def value_of(kind: Any, value: Any, name: str) -> Any:
    """Return a value in the plain form of a kind; one that is not of it is an error."""
    try:
        return takes(kind)(value)
    except UnfitError as fault:
        raise misfit(kind, value, name, fault) from None


def misfit(kind: Any, value: Any, name: str, fault: UnfitError) -> FieldError:
    """Return the error for a value that is not of a kind."""
    given = str(value) if hasattr(value, "__fspath__") else value
    return FieldError(name, str(fault) or f"must be {words(kind)}, got {shown(given)}")


def number(value: Any, name: str, **ends: Any) -> float:
    """Check that a value is a number in a range, with the fields of `Range`."""
    return value_of(Annotated[float, Range(**ends)], value, name)


def path_of(value: Any, name: str) -> Path:
    """Check that a value names a file or folder."""
    return value_of(Path, value, name)


def near(word: str, known: Iterable[str]) -> str:
    """Ask whether known words are meant that are near a mistyped one; empty if none is near."""
    import difflib  # only mistakes need it

    found = [] if len(word) > SHOWN else difflib.get_close_matches(word, list(known))
    return f"did you mean {' or '.join(found)}?" if found else ""


def one_of(value: Any, choices: Iterable[str], name: str) -> None:
    """Refuse a value that is not one of the given words."""
    value_of(Literal[tuple(choices)], value, name)


def instance(value: Any, kind: type[Value], name: str, remedy: str = "") -> Value:
    """Check that a value is an instance of a class."""
    if not isinstance(value, kind):
        hint = f"; {remedy}" if remedy else ""
        raise InputError(f"{name} must be a {kind.__name__}, got {shown(value)}{hint}")
    return value


def function(value: Any, name: str) -> None:
    """Refuse a value that cannot be called."""
    if not callable(value):
        raise InputError(f"{name} must be a function, got {shown(value)}")


def several(value: Any, each: Callable[[Any], Value], name: str, kind: str) -> tuple[Value, ...]:
    """Check every item of a sequence; a string is refused, not split into letters."""
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise InputError(
            f"{name} must be a sequence of {kind}, such as a tuple, got {shown(value)}"
        )
    return tuple(each(thing) for thing in cast("Iterable[Any]", value))


def shown(value: Any) -> str:
    """Write a value for a message: short and on one line; a long value is shown by its kind."""
    if isinstance(value, int) and abs(value) > HUGE:
        return f"a whole number of {value.bit_length()} bits"
    listed = cast("Iterable[Any]", value) if type(value) in {tuple, list} else None
    plain = listed is not None and all(
        isinstance(each, float | str | None) or (isinstance(each, int) and abs(each) <= HUGE)
        for each in listed
    )
    if plain or isinstance(value, Real | str | type(None)):
        said = repr(value)
        if len(said) <= SHOWN:
            return said
        if isinstance(value, str | Real):
            return f"{said[:SHOWN]}..."
    size = getattr(value, "shape", None)
    kind = type(value).__name__
    return f"an array of shape {size}" if isinstance(size, tuple) else f"a value of type {kind}"
