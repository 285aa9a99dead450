"""Tells which values an argument or a field may hold, as types that pydantic checks.

`Annotated` narrows a type: `Annotated[float, Interval(ge=0.0)]`. Fields of values are checked by
`declared`, single values that users pass by `value_of`. Numbers of numpy count as numbers, text and
truth values do not; a number is finite unless its interval ends at infinity.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache, partial
from numbers import Integral, Real
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, cast, get_args, get_origin

from annotated_types import Interval
from pydantic import AfterValidator, ConfigDict, GetCoreSchemaHandler, TypeAdapter, ValidationError
from pydantic_core import CoreSchema, core_schema

from grasp_core.errors import InputError
from grasp_core.messages import FieldError, UnfitError, at, near, shown

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
FLAT = "flat"
"""Mark in the type of a field that is a record, whose keys stand among those of the outer one."""


def nonzero(value: tuple[float, ...]) -> tuple[float, ...]:
    """Refuse a vector whose largest part is implausibly small or large, such as a zero vector."""
    if not SMALLEST <= max(map(abs, value)) <= LARGEST:
        raise UnfitError(
            f"must be numbers that are not all zero: the largest is from {SMALLEST:g} to "
            f"{LARGEST:g} in size, got {shown(value)}"
        )
    return value


def ending(*endings: str) -> AfterValidator:
    """Return the rule that a path's name has one of some endings, in upper or lower case."""

    def check(value: Path) -> Path:
        if value.suffix.lower() not in endings:
            raise UnfitError(
                f"must be a path that ends in {' or '.join(endings)}, got {shown(str(value))}"
            )
        return value

    return AfterValidator(check)


@dataclass(frozen=True, slots=True)
class Null:
    """The number that null stands for in a file: infinity, or NaN where a simulation diverged."""

    value: float

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Take null for the number, where a file says it, and write null for it."""
        inner: Any = handler(source)
        inner["allow_inf_nan"] = True
        written = core_schema.plain_serializer_function_ser_schema(_finite)
        return core_schema.with_info_before_validator_function(
            self._taken, inner, serialization=written
        )

    def __get_pydantic_json_schema__(self, made: Any, handler: Any) -> dict[str, Any]:
        """Return the JSON schema of a number or null."""
        return {"anyOf": [handler(made), {"type": "null"}]}

    def _taken(self, value: Any, info: core_schema.ValidationInfo[Any]) -> Any:
        if value is None and info.context:
            return self.value
        if not isinstance(value, float) or math.isfinite(value):
            return value
        if info.context:
            raise UnfitError(f"must be a finite number, or null for {self.value}, got {value}")
        if math.isnan(value) != math.isnan(self.value):
            raise UnfitError(f"must be a number, got {value}")
        return value


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


Quantity = Annotated[float, Interval(ge=SMALLEST, le=LARGEST)]
"""A length, force or similar quantity in SI units of a plausible size."""
Signed = Annotated[float, Interval(ge=-LARGEST, le=LARGEST)]
"""A number of a plausible size, of either sign."""
NotNegative = Annotated[float, Interval(ge=0.0, le=LARGEST)]
Friction = Annotated[float, Interval(ge=SMALLEST, le=LARGEST_FRICTION)]
FrictionOrZero = Annotated[float, Interval(ge=0.0, le=LARGEST_FRICTION)]
Share = Annotated[float, Interval(ge=0.0, le=1.0)]
Gap = Annotated[float, Interval(ge=1e-4, le=0.9)]
"""A gap of a proof: less is left to rounding, and more the first twist proves."""
TimeLimit = Annotated[float, Interval(ge=0.0, le=1e7)]
Cases = Annotated[int, Interval(ge=1, le=10**8)]
Reserve = Annotated[float, Interval(ge=0.0, lt=1.0)]
MaxCones = Annotated[int, Interval(ge=64, le=1_000_000)]
"""Number of cones of a proof of regions, which begins with the 64 orthants."""
FaceTurn = Annotated[float, Interval(ge=0.0, le=45.0)]
"""Angle between normals of like faces [deg]: beyond it, a chamfer would be like its box's face."""
TorqueLimit = Annotated[float, Interval(gt=0.0, le=1e6)]
HandClearance = Annotated[float, Interval(ge=0.0, le=0.02)]
Starts = Annotated[int, Interval(ge=1, le=10_000)]
Edges = Annotated[int, Interval(ge=3, le=MOST_EDGES)]
RandomWrenches = Annotated[int, Interval(ge=0, le=10_000)]
Repeats = Annotated[int, Interval(ge=0, le=100_000)]
Count = Annotated[int, Interval(ge=1, le=MOST_COUNT)]
Number = Annotated[int, Interval(ge=0, le=MOST_COUNT)]
"""A number of things, of which there may be none."""
FaceSets = Annotated[int, Interval(ge=0, le=10**18)]
"""Number of sets of faces, of which 400 faces have more than a thousand million."""
Seed = Annotated[int, Interval(ge=0, le=MOST_SEED)]
Vector = tuple[float, float, float]
Direction = Annotated[Vector, AfterValidator(nonzero)]
OrInfinity = Annotated[float, Null(math.inf)]
"""A number that is infinite where nothing ever happens; null in files."""
Measured = Annotated[float, Null(math.nan)]
"""A number that is NaN where a simulation diverged; null in files."""


def strictly(schema: Any) -> None:
    """Change a schema of pydantic: text and truth values are no numbers, numpy's numbers are.

    Sequences are taken from any sequence of numpy or Python. A part that refers to another class
    is left to that class.
    """
    if isinstance(schema, list):
        for each in cast("list[Any]", schema):
            strictly(each)
    if not isinstance(schema, dict) or "type" not in schema or schema["type"] == "dataclass":
        return
    part = cast("dict[str, Any]", schema)
    kind: str = part["type"]
    before = BEFORE.get(kind)
    for each in list(part.values()):
        strictly(each)
    if kind in STRICT:
        part["strict"] = True
    if kind == "int":  # larger ones are no seeds, counts or indices, nor fit into arrays
        part |= {"ge": part.get("ge", -MOST_SEED), "le": part.get("le", MOST_SEED)}
    if kind == "float" and math.inf in (part.get("le"), -part.get("ge", 0.0)):
        part["allow_inf_nan"] = True
    if kind == "tuple":
        part["fail_fast"] = True
        before = partial(_listed, part.pop("min_length", 0), part.pop("max_length", None))
    if before is not None:
        inner = {key: part.pop(key) for key in list(part)}
        part.update(core_schema.no_info_before_validator_function(before, cast("Any", inner)))


def _real(value: Any) -> Any:
    """Return Python's float of a real number; of anything else itself, which is then refused."""
    if type(value) is float or isinstance(value, bool) or not isinstance(value, Real):
        return value
    try:
        return float(value)
    except OverflowError:
        return None


def _whole(value: Any) -> Any:
    if type(value) in (int, bool) or not isinstance(value, Integral):
        return value
    return int(value)


def _no_truth(value: Any) -> Any:
    if isinstance(value, bool):  # which equals 0 or 1
        raise UnfitError(f"must be one of the words and numbers allowed, got {value}")
    return value


def _named(value: Any) -> Any:
    if isinstance(value, str | Path) and (value == "" or "\0" in str(value)):
        raise UnfitError(f"must be a path, got {shown(str(value))}")
    return value


def _listed(least: int, most: int | None, value: Any) -> Any:
    """Return the numbers of an array as lists; too few or too many items are refused unseen."""
    entries = getattr(getattr(value, "dtype", None), "kind", None)
    if entries not in (None, "i", "u", "f"):
        raise UnfitError(f"must be a sequence of numbers, got {shown(value)}")
    listed: Any = value if entries is None else value.tolist()
    if isinstance(listed, list | tuple):
        count = len(cast("list[Any]", listed))
        if not least <= count <= (count if most is None else most):
            ends = f"{least}" if most is None else f"{least} and at most {most}"
            raise UnfitError(f"must have a length of at least {ends}, got {count}")
    return cast("Any", listed)


STRICT = ("float", "int", "bool", "str")
BEFORE: Mapping[str, Callable[[Any], Any]] = {
    "float": _real, "int": _whole, "literal": _no_truth, "lax-or-strict": _named,
}  # fmt: skip
"""What is done with a value before pydantic takes it, by the type of the schema; paths have the
last one."""


class _Strictly:
    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        made = handler(source)
        strictly(made)
        return made


@lru_cache(maxsize=256)
def adapter(kind: Any) -> TypeAdapter[Any]:
    """Return what checks and writes values of a type, which may be a class of `declared`."""
    if hasattr(kind, "__pydantic_fields__"):
        return TypeAdapter[Any](kind)
    config = ConfigDict(allow_inf_nan=False, arbitrary_types_allowed=True)
    kept: Any = Annotated[kind, _Strictly()]
    return TypeAdapter[Any](kept, config=config)


def value_of(kind: Any, value: Any, name: str) -> Any:
    """Return a value in the plain form of a kind; one that is not of it is an error."""
    try:
        return adapter(kind).validate_python(value)
    except ValidationError as error:
        raise input_error(kind, error, name) from None


def number(value: Any, name: str, where: str = "", **ends: Any) -> float:
    """Check that a value is a number in an interval; `where` says what an end is."""
    kind = Annotated[float, Interval(**ends)]
    try:
        return value_of(kind, value, name)
    except FieldError:
        fault = f"must be {words(kind)}{where}, got {shown(value)}"
        raise FieldError(name, fault) from None


def path_of(value: Any, name: str) -> Path:
    """Check that a value names a file or folder."""
    return value_of(Path, value, name)


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


def input_error(
    kind: Any, error: ValidationError, where: str = "", *, in_file: bool = False
) -> InputError:
    """Return the first fault that pydantic found as our error: the field, the wanted, the given."""
    first = error.errors(include_url=False)[0]
    said, place = first["type"], first["loc"]
    if said == "missing" and isinstance(place[-1], int):  # a vector is too short
        said, place = "", place[:-1]
    place, kind, name = _located(kind, place, where)
    came, ctx = first["input"], first.get("ctx", {})
    ours = ctx["error"].args[0] if said == "value_error" else None
    fault = f"must be {words(kind)}, got {shown(came)}"
    if said == "missing":
        hint = near(name, cast("dict[str, Any]", came)) if isinstance(came, dict) else ""
        return InputError(f"{place}: missing; add it{hint and f' ({hint})'}")
    if said == "unexpected_keyword_argument":
        known = [*bare(kind).__pydantic_fields__]
        hint = near(name, known) or f"choose from {', '.join(known)}"
        return InputError(f"{where and f'{where}: '}no field is named {shown(name)}; {hint}")
    if isinstance(ours, InputError) and not isinstance(ours, FieldError):
        return InputError(f"{place}: {ours}") if place else ours
    if isinstance(ours, FieldError):
        field = bare(kind).__pydantic_fields__.get(ours.name) if in_file else None
        place, fault = at(place, (field and field.alias) or ours.name), ours.fault
    elif ours is not None:
        fault = str(ours)
    elif said in ("too_short", "too_long"):
        end, most = ("least", "min") if said == "too_short" else ("most", "max")
        fault = (
            f"must have a length of at {end} {ctx[f'{most}_length']}, got {ctx['actual_length']}"
        )
    return FieldError(place, fault)


def _located(kind: Any, loc: Iterable[int | str], where: str) -> tuple[str, Any, str]:
    """Return where a fault of pydantic is, the kind that is wanted there, and its last name."""
    name = where
    for part in loc:
        plain = bare(kind)
        own = getattr(plain, "__pydantic_fields__", None)
        if own is not None:
            called = [(key, info) for place, (key, info) in enumerate(own.items())
                      if part in (place, key, info.alias)]  # fmt: skip
            if not called:  # an unknown key, or the branch of a union
                name = str(part)
                continue
            key, info = called[0]
            kind = Annotated[info.annotation, info.alias, *info.metadata]
            if FLAT not in info.metadata:
                name = key if isinstance(part, int) else part
                where = at(where, name)
        elif isinstance(part, int) and (items := get_args(plain)):
            where, kind = f"{where}[{part}]", items[0 if items[-1] is Ellipsis else part]
        elif get_origin(plain) is not None and issubclass(get_origin(plain), Mapping):
            where, kind = at(where, str(part)), get_args(plain)[1]
    return where, kind, name


def bare(kind: Any) -> Any:
    """Return a type without its rules, and without None beside it."""
    if get_origin(kind) is Annotated:
        return bare(get_args(kind)[0])
    parts = get_args(kind) if get_origin(kind) in (Union, UnionType) else ()
    others = [part for part in parts if part is not type(None)]
    return bare(others[0]) if len(others) == 1 else kind


def inside(kind: Any, wanted: type) -> Any:
    """Return the class of a kind that is one of `wanted`, alone or beside None; None if none is."""
    plain = bare(kind)
    return plain if isinstance(plain, type) and issubclass(plain, wanted) else None


def words(kind: Any) -> str:
    """Return in words what values a kind allows: 'a number from 0 to 1'."""
    plain, parts = bare(kind), get_args(bare(kind))
    origin = get_origin(plain)
    if shapes := [rule for rule in rules(kind) if hasattr(rule, "take")]:
        return str(shapes[0])
    if origin in (Union, UnionType):
        return " or ".join(map(words, parts))
    if origin is tuple:
        return _words_of_items(parts)
    if isinstance(plain, type) and issubclass(plain, Enum):
        origin, parts = Literal, [each.value for each in plain]
    if origin is Literal:
        return f"one of {', '.join(map(str, parts))}"
    if parts:
        return f"a table, each key {words(parts[0])}, each value {words(parts[1])}"
    ends = [f"{word} {getattr(rule, name):g}" for rule in rules(kind) if isinstance(rule, Interval)
            for name, word in ENDS.items()
            if getattr(rule, name) is not None and math.isfinite(getattr(rule, name))]  # fmt: skip
    ends += [f"or {rule.value}" for rule in rules(kind) if isinstance(rule, Null)]
    name: str = getattr(cast("Any", plain), "__name__", "value")
    return " ".join([NAMES.get(plain) or f"a {name}", *ends])


def _words_of_items(parts: tuple[Any, ...]) -> str:
    if parts[-1] is Ellipsis:
        return f"a sequence, each item {words(parts[0])}"
    if any(part != parts[0] for part in parts):
        return f"{len(parts)} items: {', '.join(map(words, parts))}"
    each = "" if parts[0] is float else f", each {words(parts[0])}"
    return f"{len(parts)} {'numbers' if bare(parts[0]) in (float, int) else 'items'}{each}"


NAMES: Mapping[Any, str] = {
    float: "a number", int: "a whole number", bool: "true or false", str: "text", Path: "a path",
    type(None): "None",
}  # fmt: skip
ENDS = {"gt": "above", "ge": "from", "lt": "below", "le": "up to"}
"""What ends of intervals are called."""


def rules(kind: Any) -> tuple[Any, ...]:
    """Return the rules that narrow a kind, or one that may be None instead."""
    if get_origin(kind) is Annotated:
        return get_args(kind)[1:] + rules(get_args(kind)[0])
    return tuple(rule for part in get_args(kind) for rule in rules(part))
