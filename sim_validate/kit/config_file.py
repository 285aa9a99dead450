"""Turns the settings of a TOML file into flags on the command line."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

from grasp_core.errors import InputError
from sim_validate.kit.exit_codes import FlagsError
from sim_validate.kit.flag_values import Flag, flags_of, listed

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
    known = {flag.name: flag for flag in flags_of(commands.get(rest[0]))} if rest else {}
    flags = _read(Path(words[at + 1]), known)
    command = COMMAND_WORDS.get(rest[0], 1) if rest else 0
    return [*rest[:command], *flags, *rest[command:]]


def flags_from(settings: Mapping[str, Any], known: Mapping[str, Flag]) -> list[str]:
    """Turn settings into the words of an equivalent command line; tables hold groups of flags."""
    words = list[str]()
    for name, value in _named(settings):
        flag = known.get(name.replace("-", "_"))
        if flag is None:
            raise FlagsError(f"{name!r}: unknown flag; keys are long flags")
        words += _as_flags(flag, value)
    return words


def _named(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in settings.items():
        if isinstance(value, dict):
            yield from _named(cast("dict[str, Any]", value), f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _read(path: Path, known: Mapping[str, Flag]) -> list[str]:
    """Read a file of settings as words of a command line."""
    # imported only when there is a file to read
    from sim_validate.kit.toml_tables import read_tables

    try:
        settings = read_tables(path)
    except InputError as error:
        raise InputError(f"--config {error}") from error
    try:
        return flags_from(settings, known)
    except InputError as error:
        raise type(error)(f"--config {path}: {error}") from None


def _as_flags(flag: Flag, value: Any) -> list[str]:
    words = "--" + flag.name.replace("_", "-")
    if any(isinstance(part, dict) for item in _items(value) for part in _items(item)):
        raise InputError(f"{flag.name}: expected a value or a list, got a table")
    if isinstance(value, bool):
        return [words] if value else []
    if listed(flag.kind) is not None:
        return [words, ",".join(map(str, _items(value)))]
    return [word for item in _items(value) for word in (words, *map(str, _items(item)))]


def _items(value: Any) -> list[Any]:
    return cast("list[Any]", value) if isinstance(value, list) else [value]
