"""Turns the settings of a TOML file into flags on the command line."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, cast, get_args, get_type_hints

from grasp_core.errors import InputError, about
from grasp_core.files.json_text import place
from sim_validate.kit.exit_codes import FlagsError

COMMAND_WORDS = {"dataset": 2, "baseline": 2}
"""Number of words in those command names that have more than one."""


def with_config(arguments: list[str], commands: Mapping[str, type]) -> list[str]:
    """Put the settings of `--config FILE.toml` before the flags, which then override them."""
    words = [
        part
        for word in arguments
        for part in (word.split("=", 1) if word.startswith("--config=") else [word])
    ]
    if "--config" not in words:
        return arguments
    at = words.index("--config")
    if at + 1 >= len(words):
        raise FlagsError("--config needs the path of a TOML file after it")
    rest = words[:at] + words[at + 2 :]
    flags = _read(Path(words[at + 1]), flag_names(commands.get(rest[0])) if rest else set())
    command = COMMAND_WORDS.get(rest[0], 1) if rest else 0
    return [*rest[:command], *flags, *rest[command:]]


def flags_from(settings: dict[str, Any]) -> list[str]:
    """Turn named settings into the words of an equivalent command line."""
    for name, value in settings.items():
        if any(isinstance(part, dict) for item in _items(value) for part in _items(item)):
            raise InputError(f"{place([name])}: expected a value or a list, got a table")
    return [word for name, value in settings.items() for word in _as_flags(name, value)]


def flag_names(kind: Any) -> set[str]:
    """Return the names of a command's flags in config files, with those of its groups of flags."""
    if not is_dataclass(kind):
        return set[str]().union(*(flag_names(part) for part in get_args(kind)))
    names = {field.name for field in fields(kind)}
    return names.union(*(flag_names(inner) for inner in get_type_hints(kind).values()))


def _read(path: Path, known: set[str]) -> list[str]:
    """Read a file of settings as words of a command line."""
    # imported only when there is a file to read
    from sim_validate.kit.toml_tables import read_tables

    try:
        settings = read_tables(path)
    except InputError as error:
        raise InputError(f"--config {error}") from error
    for name in settings:
        if name.replace("-", "_") not in known:
            said = f"--config {path}: {place([name])}: unknown flag; keys are long flags"
            raise FlagsError(said)
    with about(f"--config {path}"):
        return flags_from(settings)


def _as_flags(name: str, value: Any) -> list[str]:
    flag = "--" + name.replace("_", "-")
    if isinstance(value, bool):
        return [flag] if value else []
    return [word for item in _items(value) for word in (flag, *map(str, _items(item)))]


def _items(value: Any) -> list[Any]:
    return cast("list[Any]", value) if isinstance(value, list) else [value]
