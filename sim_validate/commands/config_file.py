"""Turns a TOML file of settings (`--config`) into flags of an equivalent command line."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast, get_args

from tyro.conf import UseAppendAction

from grasp_core.errors import InputError
from grasp_core.messages import near
from sim_validate.commands.exit_codes import FlagsError
from sim_validate.commands.flag_values import Flag, flags_of, listed


def with_config(words: list[str], path: Path | None, command: Any) -> list[str]:
    """Put the settings of a TOML file before the flags, which then override them."""
    if path is None:
        return words
    flags = _read(path, command)
    first = next((place for place, word in enumerate(words) if word.startswith("-")), len(words))
    return [*words[:first], *flags, *words[first:]]


def flags_from(settings: Mapping[str, Any], command: Any) -> list[str]:
    """Turn settings into the words of an equivalent command line; tables hold groups of flags."""
    known = {flag.name: flag for flag in flags_of(command)}
    words = list[str]()
    for name, value in _named(settings):
        flag = known.get(name.replace("-", "_"))
        if flag is None:
            meant = near(name.replace("-", "_"), known)
            raise FlagsError(f"{name!r}: unknown flag; {meant or 'keys are long flags'}")
        words += _as_flags(flag, value)
    return words


def _named(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in settings.items():
        if isinstance(value, dict):
            yield from _named(cast("dict[str, Any]", value), f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _read(path: Path, command: Any) -> list[str]:
    """Read a file of settings as words of a command line."""
    # imported only when there is a file to read
    from sim_validate.files.toml_files import read_tables

    try:
        settings = read_tables(path)
    except InputError as error:
        raise InputError(f"--config {error}") from error
    try:
        return flags_from(settings, command)
    except InputError as error:
        raise type(error)(f"--config {path}: {error}") from None


def _as_flags(flag: Flag, value: Any) -> list[str]:
    word, items = "--" + flag.name.replace("_", "-"), _items(value)
    if any(isinstance(part, dict) for item in items for part in _items(item)):
        raise InputError(f"{flag.name}: expected a value or a list, got a table")
    if isinstance(value, bool):
        return [word] if value else []
    if listed(flag.kind) is not None:
        return [word, ",".join(map(str, items))]
    if UseAppendAction in get_args(flag.kind)[1:]:
        return [part for item in items for part in (word, *map(str, _items(item)))]
    return [word, *map(str, items)]


def _items(value: Any) -> Sequence[Any]:
    return cast("Sequence[Any]", value) if isinstance(value, list | tuple) else [value]
