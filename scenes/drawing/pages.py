"""Fills page templates with values; the only module that uses jinja2.

Values are escaped and lose unprintable characters, because names of files and objects come from
anywhere.
"""

import importlib
from functools import cache
from pathlib import Path
from typing import Any

ASSETS = Path(__file__).parent / "assets"
"""Folder of the templates, styles and scripts of single drawings."""
NOTHING = "-"
MILLION = 1e6
"""Size from which numbers are written with a power of ten."""


def filled(template: str, folder: Path = ASSETS, **values: object) -> str:
    """Fill a page template with values."""
    return str(_environment(folder).get_template(template).render(**values))


def text_of(name: str, folder: Path = ASSETS) -> str:
    """Read a style sheet or script of a folder or, if it has none of that name, of this package."""
    own = folder / name
    return (own if own.is_file() else ASSETS / name).read_text(encoding="utf-8")


@cache
def _environment(folder: Path) -> Any:
    jinja2: Any = importlib.import_module("jinja2")
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([folder, ASSETS]),
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


def number(value: float | None, digits: int = 3) -> str:
    """Write a number for people, without powers of ten below a million; None is a dash."""
    if value is None:
        return NOTHING
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+0" in text and abs(value) < MILLION else text
