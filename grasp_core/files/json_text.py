"""Reads JSON text as plain values, and writes it with a line for each item.

A key twice in one object and half characters, which Python's reader takes, are refused here. What
the values are, such as finite numbers, is checked by the records that are made of them.
"""

import json
from collections import Counter
from collections.abc import Mapping
from typing import Any, cast

from grasp_core import messages
from grasp_core.errors import InputError
from grasp_core.files.file_kinds import check_kind, with_article

TOO_DEEP = "objects and lists are nested too deeply; flatten the file"
LONGEST_ECHO = 40
"""Largest number of characters of a key that a message repeats."""


def object_of(text: str, wanted: str, *, schema: int | None = None) -> dict[str, Any]:
    """Return the object that a JSON text holds."""
    found = json_of(text)
    if not isinstance(found, dict):
        raise InputError(f"{with_article(wanted)} must hold one JSON object, got {shown(found)}")
    record = cast("dict[str, Any]", found)
    check_kind(record, wanted)
    if schema is not None:
        check_schema(record, schema)
    return record


def json_of(text: str) -> Any:
    """Return the value that a JSON text holds."""
    try:
        found = json.loads(text, object_pairs_hook=_without_twins)
        if "\\ud" in text.lower():  # a half character has no encoding
            json.dumps(found, ensure_ascii=False).encode()
    except RecursionError as error:
        raise InputError(TOO_DEEP) from error
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        said = error.msg if error.msg.isprintable() else "unexpected text"
        raise InputError(
            f"the text is not complete JSON ({said}: {where}); write the file again"
        ) from error
    except UnicodeEncodeError as error:
        raise InputError("the text holds half a character (a lone surrogate)") from error
    except ValueError as error:  # Python reads no whole number of more than 4300 digits
        raise InputError(
            "a whole number in the file has thousands of digits; shorten it"
        ) from error
    return found


def _without_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        twin, _ = Counter(key for key, _ in pairs).most_common(1)[0]
        said = twin if twin.isidentifier() else ascii(twin)
        said = said if len(said) <= LONGEST_ECHO else f"{said[:LONGEST_ECHO]}..."
        raise InputError(f"{said}: the key occurs twice in one object; remove one")
    return found


def check_schema(found: Mapping[str, Any], schema: int) -> None:
    """Refuse a version of the file format that this package does not read."""
    came = found.get("schema")
    if came is None:
        raise InputError(f"schema: the key is missing; expected {schema}")
    if type(came) is not int or came < 1:
        raise InputError(f"schema: expected {schema}, got {shown(came)}")
    if came != schema:
        said = "a newer graspproof wrote the file; upgrade this one" if came > schema else (
            "an older graspproof wrote the file; write it again"
        )  # fmt: skip
        raise InputError(f"schema: expected {schema}, got {shown(came)}: {said}")


def shown(value: object) -> str:
    """Write a wrong value for a message, in the words of JSON."""
    if isinstance(value, dict | list | tuple):
        return "an object" if isinstance(value, dict) else "a list"
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    return messages.shown(value)


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
