"""Reads JSON text as plain values, and writes it with a line for each item.

Cases that JSON leaves open are refused: a key twice in one object, numbers that are too large or
not finite, very deep nesting, and characters that cannot be encoded.
"""

import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, cast

from grasp_core import kinds
from grasp_core.errors import InputError
from grasp_core.files.file_kinds import check_kind, with_article

DEEPEST = 64
"""Largest number of objects and lists inside each other; files of graspproof have less than ten."""
TOO_DEEP = f"objects and lists are nested more than {DEEPEST} deep; flatten the file"
LARGEST_WHOLE = 2**64 - 1
"""Largest whole number: larger ones are no seeds, counts or indices, nor fit into arrays."""
LONGEST_ECHO = 40
"""Largest number of characters of a key that a message repeats."""


def object_of(
    text: str, wanted: str, *, schema: int | None = None, nulls: bool = True
) -> dict[str, Any]:
    """Return the object that a JSON text holds."""
    found = json_of(text, nulls=nulls)
    if not isinstance(found, dict):
        raise InputError(f"{with_article(wanted)} must hold one JSON object, got {shown(found)}")
    record = cast("dict[str, Any]", found)
    check_kind(record, wanted)
    if schema is not None:
        check_schema(record, schema)
    return record


def json_of(text: str, *, nulls: bool = True) -> Any:
    """Return the value that a JSON text holds."""
    try:
        found = json.loads(text, object_pairs_hook=_without_twins)
    except RecursionError as error:
        raise InputError(TOO_DEEP) from error
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        said = error.msg if error.msg.isprintable() else "unexpected text"
        raise InputError(
            f"the text is not complete JSON ({said}: {where}); write the file again"
        ) from error
    except ValueError as error:  # Python reads no whole number of more than 4300 digits
        raise InputError(
            "a whole number in the file has thousands of digits; shorten it"
        ) from error
    check_values(found, nulls=nulls)
    return found


def check_values(document: object, *, nulls: bool = True) -> None:
    """Refuse plain values that no file of graspproof may hold, whatever its format."""
    _check([document], nulls, ())


def _check(holder: Any, nulls: bool, where: tuple[object, ...]) -> None:
    if len(where) > DEEPEST:
        raise InputError(TOO_DEEP)
    for key, value in _items(holder):
        if isinstance(value, dict | list):
            if not _all_plain(value):
                _check(value, nulls, (*where, key))
        elif fault := _fault(value, nulls=nulls):
            raise InputError(f"{place([*where, key][1:])}: {fault}")


def check_schema(found: Mapping[str, Any], schema: int) -> None:
    """Refuse a version of the file format that this package does not read."""
    came = found.get("schema")
    if came is None:
        raise InputError(f"schema: the key is missing; expected {schema}")
    if isinstance(came, bool) or not isinstance(came, int) or came < 1:
        raise InputError(f"schema: expected {schema}, got {shown(came)}")
    if came > schema:
        raise InputError(
            f"schema: expected {schema}, got {shown(came)}: a newer graspproof wrote the file; "
            "upgrade this one"
        )
    if came < schema:
        raise InputError(
            f"schema: expected {schema}, got {came} of an older graspproof; write the file again"
        )


def place(parts: Sequence[object]) -> str:
    """Write where a value is in a document, for messages: `grasps[0].contacts[2].normal`."""
    said = "".join(
        f"[{part}]" if isinstance(part, int) else f".{_key(str(part))}" for part in parts
    )
    return said.lstrip(".") or "the document"


def shown(value: object) -> str:
    """Write a wrong value for a message, in the words of JSON."""
    if isinstance(value, dict | list | tuple):
        return "an object" if isinstance(value, dict) else "a list"
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    return kinds.shown(value)


def _key(key: str) -> str:
    said = key if key.isidentifier() else ascii(key)
    return said if len(said) <= LONGEST_ECHO else f"{said[:LONGEST_ECHO]}..."


def _without_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        counts = Counter(key for key, _ in pairs)
        twin = next(key for key, _ in pairs if counts[key] > 1)
        raise InputError(f"{_key(twin)}: the key occurs twice in one object; remove one")
    return found


def _all_plain(holder: Any) -> bool:
    """Return whether a list holds only finite floats, as most lists do."""
    if not isinstance(holder, list):
        return False
    values = cast("list[Any]", holder)
    return set(map(type, values)) == {float} and all(map(math.isfinite, values))


def _items(holder: Any) -> Iterable[tuple[Any, Any]]:
    if not isinstance(holder, dict):
        return enumerate(cast("list[Any]", holder))
    record = cast("dict[str, Any]", holder)
    if not "".join(record).isascii():
        for key in filter(_has_no_encoding, record):
            raise InputError(f"{_key(key)}: the key holds half a character (a lone surrogate)")
    return record.items()


def _fault(value: object, *, nulls: bool) -> str | None:
    """Return what is wrong with a value that contains no other values; None if nothing is."""
    if isinstance(value, float):
        return None if math.isfinite(value) else f"expected a finite number, got {value}"
    if isinstance(value, int):
        return None if abs(value) <= LARGEST_WHOLE else f"{shown(value)} is larger than 2^64 - 1"
    if isinstance(value, str):
        wrong = not value.isascii() and _has_no_encoding(value)
        return "the text holds half a character (a lone surrogate)" if wrong else None
    if value is None:
        return None if nulls else "null is not allowed; give a value, or leave the key out"
    return f"expected a number or text, got {value}; put it in quotes"  # a day or time of TOML


def _has_no_encoding(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return True
    return False


def text_of(document: Mapping[str, object]) -> str:
    """Write an object as JSON: one line per key, and per item of a list of objects."""
    lines = (f" {_line(key)}: {_value(value)}" for key, value in document.items())
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _value(value: object) -> str:
    if not isinstance(value, list | tuple):
        return _line(value)
    items = cast("list[Any]", value)
    if not any(isinstance(item, dict) for item in items):
        return _line(items)
    return "[\n  " + ",\n  ".join(map(_line, items)) + "\n ]"


def _line(value: object) -> str:
    return json.dumps(value, allow_nan=False)
