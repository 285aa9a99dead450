"""Reads and writes `quarantine.jsonl`: which units of work of a dataset have no rows, and why."""

import json
from collections.abc import Iterable
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from grasp_core.errors import InputError
from grasp_core.files.json_text import record_of
from grasp_core.files.text_files import read_text


class LeftOut(BaseModel):
    """A unit of work without rows, with the reason."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    object: str
    source_sha256: str
    friction: float
    given: list[str]
    """Ids of the given grasps that have no rows, if the unit is about given grasps."""
    reason: str


def left_out_text(units: Iterable[LeftOut]) -> str:
    """Write the text of `quarantine.jsonl`, one line per unit of work without rows."""
    return "".join(json.dumps(each.model_dump(), sort_keys=True) + "\n" for each in units)


def read_left_out(path: Path) -> list[LeftOut]:
    """Read `quarantine.jsonl`: the units of work that have no rows."""
    text = read_text(path)
    try:
        return left_out_from(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def left_out_from(text: str) -> list[LeftOut]:
    """Parse the text of `quarantine.jsonl`."""
    lines = text.removesuffix("\n").split("\n") if text else []
    return [_read(line, number) for number, line in enumerate(lines, start=1)]


def _read(line: str, number: int) -> LeftOut:
    try:
        return record_of(LeftOut, line, "line of quarantine.jsonl")
    except InputError as error:
        raise InputError(f"line {number}: {error}") from error
