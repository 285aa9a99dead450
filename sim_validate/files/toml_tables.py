"""The text of a TOML file -> its tables, checked as the values of JSON files are."""

import re
import tomllib
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError
from grasp_core.files.strict_json import DEEPEST, check_values
from sim_validate.files.reading import read_text

MOST_LETTERS = 2**20
"""Settings are short."""
ASIDE = re.compile(
    r'''"""(?:[^\\]|\\.)*?(?:"""|\\?\Z)|"(?:[^"\\\n]|\\.)*(?:"|\n|\\?\Z)|'''
    r"""'''.*?(?:'''|\Z)|'[^'\n]*(?:'|\n|\Z)|\#[^\n]*""",
    re.DOTALL,
)
"""Text in quotes, and comments, each up to its end or that of the line or file."""
LONG_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{DEEPEST}}}")
"""`a.b.c` of many parts, for which tomllib takes time that grows with the cube of their number: two
minutes for a hundred kilobytes."""


def read_tables(path: Path) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises:
        InputError: It cannot be read, or is not TOML; the message names the file and the line.
    """
    text = read_text(path, MOST_LETTERS)
    try:
        return tables_of_toml(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def tables_of_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Raises:
        InputError: It is not TOML, or holds what no setting is.
    """
    if LONG_KEY.search(ASIDE.sub(lambda found: "q" if found[0][0] != "#" else "", text)):
        raise InputError(f"not TOML that is read here: a key of more than {DEEPEST} parts")
    try:
        found = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"not TOML: {_printable(str(error))}") from error
    except RecursionError as error:
        raise InputError("not TOML that is read here: values are too deep inside others") from error
    except ValueError as error:  # numbers of thousands of digits, days that there are not
        raise InputError(f"not TOML: {_printable(str(error))}") from error
    check_values(found)
    return found


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text[:200])
