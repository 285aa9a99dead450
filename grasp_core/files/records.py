"""Writes declared values as JSON and makes them of it, strictly, from their fields alone.

A record is a frozen dataclass of `declared`: its fields are the keys of an object, in their order,
and what reads a file back is the same class. Properties that are marked as `recorded` are written
too; a file whose other fields say something else contradicts itself and is refused. In a kind,
`Key("position_m")` names the key where it is not the field's name, `Null(math.inf)` the number that
null stands for, `UNRECORDED` a field that only lives in memory and has a default, and `FLAT` a
field whose own fields stand in the object itself; where it may be None, they are all absent then.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from enum import Enum
from functools import cache, partial
from itertools import chain
from pathlib import Path
from types import UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    NamedTuple,
    Self,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

from grasp_core.declared import Declared, check, default_of, rules, types
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import object_of, shown, text_of
from grasp_core.files.text_files import read_text
from grasp_core.kinds import FieldError, Many, Null, inside
from grasp_core.settings import at, named, placed

UNRECORDED = "unrecorded"
"""Mark in the type of a field that no file holds."""
FLAT = "flat"
"""Mark in the type of a field that is a record, whose keys stand among those of the outer one."""
SAME = 1e-9
"""Largest relative difference of a number that a file says and that its other fields say."""
Record = TypeVar("Record")
Convert = Callable[[Any], Any]
Read = Callable[[Any, str], Any]
"""A function of a value of JSON and of where it stands."""


@dataclass(frozen=True, slots=True)
class Key:
    """The key of a field in files, where it is not the field's name."""

    name: str


class recorded(property):  # noqa: N801 - it is used as a decorator, as `property` is
    """A property that files hold as well, for those who read them without this package."""


@dataclass(frozen=True, slots=True)
class Form:
    """How values of a kind are written and read."""

    write: Convert
    read: Read | None
    """Makes values of JSON for the constructor; None if it takes them as they are."""


class Entry(NamedTuple):
    """How a field or a recorded property is written and read."""

    name: str
    key: str
    kind: Any
    default: Any
    form: Form
    flat: type | None
    """The class whose keys stand among those of the outer record; None for other fields."""

    @property
    def may_lack(self) -> bool:
        """Whether the keys of a flat part may all be absent."""
        kind = get_args(self.kind)[0] if get_origin(self.kind) is Annotated else self.kind
        return type(None) in get_args(kind)


class Entries(NamedTuple):
    """How a record is written and read."""

    fields: tuple[Entry, ...]
    recorded: tuple[Entry, ...]


@cache
def entries(kind: type) -> Entries:
    """Return how the fields and the recorded properties of a class are written and read."""
    own: list[Entry] = []
    defaults = {each.name: default_of(each) for each in fields(cast("Any", kind))}
    for name, each in types(kind).items():
        marks = rules(each)
        if UNRECORDED not in marks:
            key = next((rule.name for rule in marks if isinstance(rule, Key)), name)
            flat = inside_record(each) if FLAT in marks else None
            own.append(Entry(name, key, each, defaults[name], form_of(each), flat))
    properties = [
        Entry(name, name, said, MISSING, Form(form_of(said).write, None), None)
        for name, said in property_kinds(kind, recorded).items()
    ]
    return Entries(tuple(own), tuple(properties))


@cache
def property_kinds(kind: type, mark: type[property]) -> Mapping[str, Any]:
    """Return the kinds of a class's properties that a decorator marks, by name."""
    members = {name: each for base in reversed(kind.__mro__) for name, each in vars(base).items()}
    return {
        name: get_type_hints(each.fget, include_extras=True)["return"]
        for name, each in members.items() if isinstance(each, mark)
    }  # fmt: skip


def keys(kind: type) -> tuple[str, ...]:
    """Return the keys of the object that holds a value of a class."""
    own, properties = entries(kind)
    return tuple(
        key for each in (*own, *properties)
        for key in ([each.key] if each.flat is None else keys(each.flat))
    )  # fmt: skip


def record_of(value: object) -> dict[str, Any]:
    """Return a value as an object of JSON."""
    own, properties = entries(type(value))
    found: dict[str, Any] = {}
    for each in (*own, *properties):
        plain = each.form.write(getattr(value, each.name))
        if each.flat is None:
            found[each.key] = plain
        else:
            found.update(plain or {})
    return found


def form_of(kind: Any) -> Form:
    """Return how values of a kind are written as plain JSON and read."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _narrowed(*parts)
    if origin in (Union, UnionType):
        inner = form_of(next(part for part in parts if part is not type(None)))
        read = inner.read
        return Form(
            lambda value: None if value is None else inner.write(value),
            read and (lambda value, where: None if value is None else read(value, where)),
        )
    if origin is tuple:
        return _items(parts)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return _values(parts[1])
    own = inside_record(kind)
    return Form(_plain, None) if own is None else Form(record_of, partial(from_record, own))


def inside_record(kind: Any) -> type | None:
    """Return the class of records of a kind, alone or beside None; None if there is none."""
    found: type | None = inside(kind, object)
    return found if is_dataclass(cast("Any", found)) else None


def _finite(value: Any) -> Any:
    return value if math.isfinite(value) else None


def _array(value: Any) -> Any:
    """Return an array as lists in which null stands for NaN."""
    if value.dtype.kind != "f":
        return value.tolist()
    whole = value.astype(object)
    whole[value != value] = None  # noqa: PLR0124 - only NaN differs from itself
    return whole.tolist()


def _plain(value: Any) -> Any:
    """Return arrays as lists, members of enumerations as their values, and paths as text."""
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Path):
        return str(value)
    return value.tolist() if hasattr(value, "tolist") else value


def from_record(kind: type[Record], found: object, where: str = "", **beside: Any) -> Record:
    """Make a value of an object of JSON at a place such as 'verdicts[0]'; faults name the field."""
    own, properties = entries(kind)
    given = named(found, keys(kind), where, "field")
    taken: dict[str, Any] = {}
    for each in (*own, *properties):
        if each.flat is not None:
            inner = {key: given[key] for key in keys(each.flat) if key in given}
            absent = each.may_lack and not inner
            taken[each.name] = None if absent else from_record(each.flat, inner, where)
        elif each.key not in given:
            if each.default is MISSING:
                raise InputError(f"{at(where, each.key)}: missing; add it")
        else:
            value, read = given[each.key], each.form.read
            taken[each.name] = value if read is None else read(value, at(where, each.key))
    said = {each.name: taken.pop(each.name) for each in properties}
    try:
        made = kind(**taken, **beside)
        if not isinstance(made, Declared):
            check(made)
    except FieldError as error:
        key = next((each.key for each in own if each.name == error.name), error.name)
        raise FieldError(at(where, key), error.fault) from None
    except InputError as error:
        raise placed(error, where) from None
    for each in properties:
        ours = each.form.write(getattr(made, each.name))
        for place, given_there, ours_there in _differences(said[each.name], ours):
            raise InputError(
                f"{at(where, each.key)}{place}: {_told(given_there)} contradicts the other fields, "
                f"which say {_told(ours_there)}; write the file again, or remove it"
            )
    return made


def _narrowed(kind: Any, *given: Any) -> Form:
    null = next((rule for rule in given if isinstance(rule, Null)), None)
    if null is not None:
        return Form(_finite, lambda value, _where: null.value if value is None else value)
    array = next((rule for rule in given if hasattr(rule, "take")), None)
    if array is not None:
        return Form(_array if array.nan else _plain, partial(_array_read, array.shape))
    inner, many = form_of(kind), next((rule for rule in given if isinstance(rule, Many)), None)
    own = inner.read
    if own is None or many is None:
        return inner

    def read(value: Any, where: str) -> Any:
        if isinstance(value, list) and not many.holds(cast("list[Any]", value)):
            raise InputError(f"{where} {many.fault(cast('list[Any]', value))}")
        return own(value, where)

    return Form(inner.write, read)


def _array_read(shape: tuple[int | str | None, ...], value: Any, where: str) -> Any:
    """Refuse true and false, which arrays would take for 1 and 0; an empty list has no rows."""
    if isinstance(value, list) and not cast("list[Any]", value) and not isinstance(shape[0], int):
        import numpy as np

        return np.empty((0, *(size for size in shape[1:] if isinstance(size, int))))
    items: list[Any] = [value]
    while (found := set(map(type, items))) == {list}:
        items = [*chain.from_iterable(items)]
    if bool in found:
        raise InputError(f"{where}: expected numbers, got true or false among them")
    return cast("Any", value)


def _items(parts: tuple[Any, ...]) -> Form:
    """Write and read the items of a list; what is no list is left to the constructor to refuse."""
    each, endless = [form_of(part) for part in parts if part is not Ellipsis], parts[-1] is Ellipsis

    def write(value: Any) -> list[Any]:
        forms = each * len(value) if endless else each
        return [form.write(item) for form, item in zip(forms, value, strict=True)]

    def read(value: Any, where: str) -> Any:
        if not isinstance(value, list):
            return value
        items = cast("list[Any]", value)
        forms = each * len(items) if endless else each
        return [
            item if form.read is None else form.read(item, f"{where}[{place}]")
            for place, (form, item) in enumerate(zip(forms, items, strict=False))
        ] + items[len(forms) :]

    return Form(write, read if any(form.read for form in each) else None)


def _values(kind: Any) -> Form:
    one = form_of(kind)

    def write(value: Any) -> dict[str, Any]:
        return {name: one.write(each) for name, each in value.items()}

    def read(value: Any, where: str) -> Any:
        if one.read is None or not isinstance(value, dict):
            return value
        table = cast("dict[str, Any]", value)
        return {name: one.read(item, at(where, name)) for name, item in table.items()}

    return Form(write, one.read and read)


ABSENT = object()
"""What a file says where it lacks a key, or has one too many."""


def _told(value: Any) -> str:
    """Write a value for a message; of a list, how many items it has."""
    if value is ABSENT:
        return "nothing"
    return f"a list of {len(cast('list[Any]', value))}" if isinstance(value, list) else shown(value)


def _differences(said: Any, ours: Any, place: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield where a file contradicts itself: numbers beyond rounding, and numbers of sentences."""
    if isinstance(said, list) and isinstance(ours, list):
        theirs, own = cast("list[Any]", said), cast("list[Any]", ours)
        texts = all(isinstance(each, str) for each in (*theirs, *own))
        if len(theirs) != len(own):
            yield place, said, ours
        elif not texts:
            for number, (one, two) in enumerate(zip(theirs, own, strict=True)):
                yield from _differences(one, two, f"{place}[{number}]")
    elif isinstance(said, dict) and isinstance(ours, dict):
        mine, its = cast("dict[str, Any]", said), cast("dict[str, Any]", ours)
        for key in its | mine:
            one, two = mine.get(key, ABSENT), its.get(key, ABSENT)
            yield from _differences(one, two, f"{place}.{key}")
    elif isinstance(said, float) and isinstance(ours, float | int):
        if not math.isclose(said, ours, rel_tol=SAME, abs_tol=SAME * SAME):
            yield place, said, ours
    elif type(cast("Any", said)) is not type(ours) or said != ours:
        yield place, said, ours


class RecordFile(Declared):
    """Base of the records that a file of their own holds."""

    __slots__ = ()
    FILE: ClassVar[str]
    """Name of the file, or its kind in words."""
    SCHEMA: ClassVar[int]
    """Version of its form."""

    def document(self) -> dict[str, Any]:
        """Return what the file holds, as plain values."""
        return {"schema": self.SCHEMA, **record_of(self)}

    def text(self) -> str:
        """Return the text of the file; equal records give equal texts."""
        return text_of(self.document())

    @classmethod
    def of_text(cls, text: str) -> Self:
        """Read the text of a file."""
        found = object_of(text, cls.FILE, schema=cls.SCHEMA)
        del found["schema"]
        return from_record(cls, found)

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a file; errors name it and the field."""
        text = read_text(path)
        with about(path):
            return cls.of_text(text)
