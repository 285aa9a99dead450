"""Writes a document as JSON text in which each grasp, verdict or other item has its own line.

Lines can be counted, searched and compared, and each of them is written by the compiled encoder of
Python, which knows no layout but one line.
"""

import json
from collections.abc import Mapping
from typing import Any, cast


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
