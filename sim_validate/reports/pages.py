"""Fills page templates with values; the only module that uses jinja2.

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
    """Fill a page template with values.

    Args:
        template: File name of the template.
        values: Values that the template uses, by name.
    """
    return str(_environment().get_template(template).render(**values))


def asset(name: str) -> str:
    """Read the text of a style sheet or script that pages use."""
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
    """Remove control characters from text; return other values unchanged."""
    if type(value) is not str or value.isprintable():
        return value
    return "".join(c if c.isprintable() or c == "\n" else " " for c in value)


def number(value: float | None, digits: int = 4) -> str:
    """Write a number for people; a missing one becomes a dash."""
    return NOTHING if value is None else f"{value:.{digits}g}"
