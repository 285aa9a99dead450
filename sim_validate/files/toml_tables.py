"""Reads TOML files into tables, with limits on size and nesting."""

import re
import tomllib
from collections.abc import Collection, Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar, cast

from grasp_core.errors import InputError, about
from grasp_core.files.json_text import DEEPEST, check_values, settings_of, shown
from grasp_core.files.text_files import read_text

Settings = TypeVar("Settings")
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


def check_names(given: Iterable[str], known: Collection[str], where: str) -> None:
    """Refuse a setting that does not exist."""
    for name in given:
        if name not in known:
            raise InputError(
                f"{where}: no setting is named {shown(name)}; choose from {', '.join(known)}"
            )


def settings_in(kind: type[Settings], table: object, where: str) -> Settings:
    """Make settings of a class from a table with some of them, each checked."""
    if not isinstance(table, Mapping):
        raise InputError(f"{where}: expected a table of settings, got {shown(table)}")
    given = cast("Mapping[str, Any]", table)
    check_names(given, [each.name for each in fields(cast("type[Any]", kind))], where)
    return settings_of(kind, given, [where])


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text[:200])
