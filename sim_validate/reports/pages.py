"""Templates and values -> the text of pages; the only module that uses jinja2.

Values are escaped and lose unprintable characters, because names of files and objects come from
anywhere.
"""

import importlib
from functools import cache
from pathlib import Path
from typing import Any

ASSETS = Path(__file__).parent / "assets"
"""Folder of templates, styles and scripts."""
NOTHING = "-"
"""Text that stands for a missing number."""


def page(template: str, **values: object) -> str:
    """Fill a template with values.

    Args:
        template: File name of the template.
        values: Values that the template uses, by name.
    """
    return str(_environment().get_template(template).render(**values))


def asset(name: str) -> str:
    """Read the text of a style or script."""
    return (ASSETS / name).read_text(encoding="utf-8")


@cache
def _environment() -> Any:
    jinja2: Any = importlib.import_module("jinja2")
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(ASSETS),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_printed,
    )
    environment.filters["number"] = number
    return environment


def _printed(value: object) -> object:
    """Remove control characters from text; other values stay as they are."""
    if type(value) is not str or value.isprintable():
        return value
    return "".join(c if c.isprintable() or c == "\n" else " " for c in value)


def number(value: float | None, digits: int = 4) -> str:
    """A number for people."""
    return NOTHING if value is None else f"{value:.{digits}g}"
