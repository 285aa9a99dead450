"""Writes declared values as JSON and makes them of it, strictly, from their fields alone.

A record is a class of `declared`: its fields are the keys of an object, in their order, and what
reads a file back is the same class. A `computed_field` is written too; a file whose other fields
say something else contradicts itself and is refused. In a type, `Field(alias="position_m")` names
the key where it is not the field's name, `Null(math.inf)` the number that null stands for,
`UNRECORDED` a field that only lives in memory and has a default, and `FLAT` a field whose own
fields stand in the object itself; where it may be None, they are all absent then.
"""

import math
from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import cache
from itertools import repeat
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self, TypeVar, cast, get_type_hints

from pydantic import Field, ValidationError
from pydantic_core import PydanticSerializationError, to_json

from grasp_core.allowed_values import adapter, input_error
from grasp_core.declared import Declared, default_of, flat_parts, types
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import TOO_DEEP, object_of, shown, text_of
from grasp_core.files.text_files import read_text
from grasp_core.messages import at, near
from grasp_core.time_spent import TIME_SPENT

UNRECORDED: Any = Field(exclude=True)
"""Mark in the type of a field that no file holds."""
SAME = 1e-9
"""Largest relative difference of a number that a file says and that its other fields say."""
Record = TypeVar("Record")


class Entry(NamedTuple):
    """A field or a computed field that files hold."""

    name: str
    key: str
    kind: Any
    default: Any
    flat: type | None
    """The class whose keys stand among those of the outer record; None for other fields."""
    computed: bool = False


@cache
def entries(kind: type) -> tuple[Entry, ...]:
    """Return the fields and computed fields of a class that files hold, in their order."""
    infos: Mapping[str, Any] = cast("Any", kind).__pydantic_fields__
    defaults = {each.name: default_of(each) for each in fields(cast("Any", kind))}
    flat = flat_parts(kind)
    own = [
        Entry(name, infos[name].alias or name, each, defaults[name], flat.get(name))
        for name, each in types(kind).items() if not infos[name].exclude
    ]  # fmt: skip
    computed = cast("Any", kind).__pydantic_decorators__.computed_fields
    return (
        *own,
        *(Entry(name, name, returned(kind, name), MISSING, None, True) for name in computed),
    )


def returned(kind: type, name: str) -> Any:
    """Return the type of a property of a class."""
    return get_type_hints(getattr(kind, name).fget, include_extras=True)["return"]


def keys(kind: type) -> tuple[str, ...]:
    """Return the keys of the object that holds a value of a class."""
    return tuple(
        key for each in entries(kind)
        for key in ([each.key] if each.flat is None else keys(each.flat))
    )  # fmt: skip


def record_of(value: object, *, computed: bool = True) -> dict[str, Any]:
    """Return a value as an object of JSON, with its computed fields unless they are not wanted."""
    return adapter(type(value)).dump_python(
        value, mode="json", exclude_computed_fields=not computed
    )


def from_record(kind: type[Record], found: object, where: str = "", **beside: Any) -> Record:
    """Make a value of an object of JSON at a place such as 'verdicts[0]'; faults name the field."""
    if not isinstance(found, dict):
        raise InputError(f"{where and f'{where}: '}expected an object, got {shown(found)}")
    said = cast("dict[str, Any]", found)
    try:
        made: Record = adapter(kind).validate_python(
            said | beside, by_alias=True, by_name=False, extra="ignore", context=kind
        )
    except ValidationError as error:
        raise input_error(kind, error, where, in_file=True) from None
    ours = record_of(made)
    try:
        same = to_json(said, inf_nan_mode="constants") == to_json(ours)  # where true is not 1
    except PydanticSerializationError as error:
        raise InputError(f"{where and f'{where}: '}{TOO_DEEP}") from error
    if not same:
        _check_said(said, ours, record_of(made, computed=False), where)
    return made


ABSENT: Any = object()
"""What the fields of a record say of a key that is computed from them."""


def _check_said(said: Any, ours: Any, own: Any, where: str) -> None:
    """Refuse unknown keys, and what is computed where a file says something else.

    `ours` is what the record would be written as, and `own` the same without computed fields.
    """
    if said == ours == own:  # nothing is computed
        return
    both: Any = (type(said), type(ours))
    if both == (dict, dict):
        _check_keys(said, ours, {} if own is ABSENT else own, where)
    elif both == (list, list) and len(said) == len(ours):
        parts: Any = repeat(ABSENT) if own is ABSENT else own
        for number, each in enumerate(zip(said, ours, parts, strict=False)):
            if set(map(type, each[:2])) != {str}:  # sentences may be reworded
                _check_said(*each, f"{where}[{number}]")
    elif own is ABSENT and not _close(said, ours):
        raise InputError(
            f"{where}: {_told(said)} contradicts the other fields, which say {_told(ours)}; write "
            "the file again, or remove it"
        )


def _check_keys(
    said: dict[str, Any], ours: dict[str, Any], own: dict[str, Any], where: str
) -> None:
    for key in said:
        if key not in ours:
            hint = near(key, ours) or f"choose from {', '.join(ours)}"
            raise InputError(f"{where and f'{where}: '}no field is named {shown(key)}; {hint}")
    for key, value in ours.items():
        if key in said:
            _check_said(said[key], value, own.get(key, ABSENT), at(where, key))
        elif key not in own:
            raise InputError(f"{at(where, key)}: missing; add it")


def _close(said: Any, ours: Any) -> bool:
    if type(said) is float and type(ours) in (float, int):
        return math.isclose(said, ours, rel_tol=SAME, abs_tol=SAME * SAME)
    return type(said) is type(ours) and said == ours


def _told(value: Any) -> str:
    """Write a value for a message; of a list, how many items it has."""
    return f"a list of {len(cast('list[Any]', value))}" if isinstance(value, list) else shown(value)


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

    @TIME_SPENT.on("files")
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
