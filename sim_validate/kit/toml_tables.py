"""Reads TOML files into tables, with limits on size and nesting."""

import re
import tomllib
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError, about
from grasp_core.files.json_text import DEEPEST, check_values
from grasp_core.files.text_files import read_text

MOST_LETTERS = 2**20
"""Largest number of characters of a settings file, which is usually short."""
ASIDE = re.compile(
    r'''"""(?:[^\\]|\\.)*?(?:"""|\\?\Z)|"(?:[^"\\\n]|\\.)*(?:"|\n|\\?\Z)|'''
    r"""'''.*?(?:'''|\Z)|'[^'\n]*(?:'|\n|\Z)|\#[^\n]*""",
    re.DOTALL,
)
"""Pattern of quoted text and comments, in which dots are no key separators."""
LONG_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{DEEPEST}}}")
"""Pattern of a key `a.b.c` with too many parts. The time of tomllib grows with the cube of their
number: two minutes for a hundred kilobytes."""


def read_tables(path: Path) -> dict[str, Any]:
    """Read the tables of a TOML file."""
    text = read_text(path, MOST_LETTERS)
    with about(path):
        return tables_of_toml(text)


def tables_of_toml(text: str) -> dict[str, Any]:
    """Parse the tables of a TOML text."""
    if LONG_KEY.search(ASIDE.sub(lambda found: "q" if found[0][0] != "#" else "", text)):
        raise InputError(f"a key of the TOML file has more than {DEEPEST} parts; use shorter keys")
    try:
        found = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"the text is not TOML: {_printable(str(error))}") from error
    except RecursionError as error:
        raise InputError(
            "values of the TOML file are nested too deeply; use fewer levels"
        ) from error
    except ValueError as error:  # numbers of thousands of digits, days that do not exist
        raise InputError(f"the text is not TOML: {_printable(str(error))}") from error
    check_values(found)
    return found


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text[:200])
