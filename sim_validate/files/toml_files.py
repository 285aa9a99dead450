"""Reads tables of TOML files, and writes texts as strings of them."""

import re
import tomllib
from datetime import date, time
from pathlib import Path
from typing import Any, cast

from grasp_core.errors import InputError, about
from grasp_core.files.text_files import read_text
from grasp_core.messages import at

MOST_LETTERS = 2**20
MOST_SAID = 200
QUOTED_OR_COMMENT = re.compile(
    r'''"""(?:[^\\]|\\.)*?(?:"""|\\?\Z)|"(?:[^"\\\n]|\\.)*(?:"|\n|\\?\Z)|'''
    r"""'''.*?(?:'''|\Z)|'[^'\n]*(?:'|\n|\Z)|\#[^\n]*""",
    re.DOTALL,
)
"""Pattern of quoted text and comments, in which dots are no key separators."""
MOST_KEY_PARTS = 64
LONG_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{MOST_KEY_PARTS}}}")
"""Pattern of a key `a.b.c` with too many parts. The time of tomllib grows with the cube of their
number: two minutes for a hundred kilobytes."""


def read_tables(path: Path) -> dict[str, Any]:
    """Read the tables of a TOML file."""
    text = read_text(path, MOST_LETTERS)
    with about(path):
        return tables_of_toml(text)


def tables_of_toml(text: str) -> dict[str, Any]:
    """Parse the tables of a TOML text."""
    if LONG_KEY.search(
        QUOTED_OR_COMMENT.sub(lambda found: "q" if found[0][0] != "#" else "", text)
    ):
        raise InputError(
            f"a key of the TOML file has more than {MOST_KEY_PARTS} parts; use shorter keys"
        )
    try:
        found = tomllib.loads(text)
    except RecursionError as error:
        raise InputError(
            "values of the TOML file are nested too deeply; use fewer levels"
        ) from error
    except ValueError as error:  # numbers of thousands of digits and days that do not exist, too
        raise InputError(f"the text is not TOML: {str(error)[:MOST_SAID]}") from error
    _check_no_dates(found)
    return found


def _check_no_dates(found: Any, where: str = "") -> None:
    if isinstance(found, date | time):
        raise InputError(f"{where}: expected a number or text, got {found}; put it in quotes")
    if isinstance(found, dict):
        for name, each in cast("dict[str, Any]", found).items():
            _check_no_dates(each, at(where, name))
    elif isinstance(found, list):
        for place, each in enumerate(cast("list[Any]", found)):
            _check_no_dates(each, f"{where}[{place}]")


def quoted(text: str) -> str:
    """Write a text as a basic string of TOML, printable and on one line; YAML reads it alike."""
    plain = text.replace("\\", "\\\\").replace('"', '\\"')
    letters = (c if c.isprintable() else f"\\U{ord(c):08x}" for c in plain)
    return f'"{"".join(letters)}"'
