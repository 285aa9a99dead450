"""Turns what pydantic finds wrong with a file into a sentence: field, expected, found value."""

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from grasp_core.errors import InputError
from grasp_core.files.strict_json import object_of, place, shown

if TYPE_CHECKING:
    from pydantic import ValidationError

Record = TypeVar("Record")
BOUNDS = {"too_short": ("at least", "min_length"), "too_long": ("at most", "max_length")}
"""Wording and key of the limit in errors about the number of items, by type of error."""
UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
OURS = {
    "float_type": "a number", "int_type": "a whole number", "int_from_float": "a whole number",
    "string_type": "text", "bool_type": "true or false", "list_type": "a list",
    "tuple_type": "a list", "dict_type": "an object", "model_type": "an object",
    "dataclass_type": "an object", "finite_number": "a finite number",
    "greater_than": "more than {gt}", "greater_than_equal": "at least {ge}",
    "less_than": "less than {lt}", "less_than_equal": "at most {le}",
}  # fmt: skip
"""Words for kinds and ranges of values that people who write JSON or TOML use."""


def record_of(
    kind: type[Record], text: str, wanted: str, *, schema: int | None = None, nulls: bool = True
) -> Record:
    """Read the text of a JSON file as a record whose fields are checked."""
    from pydantic import TypeAdapter, ValidationError

    object_of(text, wanted, schema=schema, nulls=nulls)
    try:
        return TypeAdapter(kind).validate_json(text)
    except ValidationError as error:
        raise InputError(complaint(error, kind)) from error


def settings_of(
    kind: type[Record], given: Mapping[str, Any], inside: Sequence[str | int]
) -> Record:
    """Make settings of a class from a part of a file, with every field checked."""
    from pydantic import TypeAdapter, ValidationError

    try:
        return TypeAdapter(kind).validate_json(json.dumps(given), strict=True)
    except ValidationError as error:
        raise InputError(complaint(error, kind, inside)) from error
    except InputError as error:  # raised by the settings' own checks
        raise InputError(f"{place(inside)}: {error}") from error


def complaint(error: "ValidationError", kind: Any, inside: Sequence[str | int] = ()) -> str:
    """Describe the first thing that is wrong with a record."""
    first = error.errors(include_url=False)[0]
    loc, fault, came = first["loc"], first["type"], first["input"]
    where = place([*inside, *loc])
    if fault in UNKNOWN:
        return f"{where}: unknown key; known keys are {', '.join(_fields_at(kind, loc[:-1]))}"
    if fault == "missing":
        return f"{where}: missing; add it"
    limits: Mapping[str, Any] = first.get("ctx", {})
    if fault in BOUNDS:
        side, key = BOUNDS[fault]
        return f"{where}: expected {side} {limits[key]} items, got {limits['actual_length']}"
    if fault == "value_error":
        return f"{where}: {limits['error']}"
    expected = OURS[fault].format(**limits) if fault in OURS else _expected(first["msg"])
    return f"{where}: expected {expected}, got {shown(came)}"


def _expected(said: str) -> str:
    """Return what was expected, as pydantic's own message says it."""
    for beginning, ours in (("Input should be ", ""), ("String should ", "text to ")):
        if said.startswith(beginning):
            return ours + said.removeprefix(beginning)
    return f"something else ({said})"


def _fields_at(kind: Any, loc: Sequence[int | str]) -> list[str]:
    """Return the keys that a record inside another one may have."""
    for part in loc:
        if isinstance(part, str):
            inner = next((f for key, f in _fields(kind).items() if key == part), None)
            kind = None if inner is None else _record_in(inner.annotation)
    return list(_fields(kind))


def _fields(kind: Any) -> dict[str, Any]:
    listed: Mapping[str, Any] = getattr(kind, "__pydantic_fields__", {})
    return {field.alias or name: field for name, field in listed.items()}


def _record_in(annotation: Any) -> Any:
    """Return the class of records that a type holds, as an item or as a value that may be null."""
    if hasattr(annotation, "__pydantic_fields__"):
        return annotation
    inner = (_record_in(part) for part in get_args(annotation))
    return next((kind for kind in inner if kind is not None), None)
