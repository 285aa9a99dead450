"""The quarantine of a dataset: the list of units of work that have no rows."""

import json
from collections.abc import Iterable
from pathlib import Path

from grasp_core.declared import Declared, declared
from grasp_core.errors import about
from grasp_core.files.file_kinds import QUARANTINE
from grasp_core.files.json_text import object_of
from grasp_core.files.records import from_record, record_of
from grasp_core.files.text_files import read_text

TWIN = "the same object as"
"""First words of the reason why an object with the same mesh as another has no rows."""


@declared
class QuarantinedUnit(Declared):
    """A unit of work without rows, with the reason."""

    object: str
    source_sha256: str
    friction: float
    given: tuple[str, ...]
    """Ids of the given grasps that have no rows, if the unit is about given grasps."""
    reason: str


def quarantine_text(units: Iterable[QuarantinedUnit]) -> str:
    """Write the text of `quarantine.jsonl`, one line per unit of work without rows."""
    return "".join(json.dumps(record_of(each)) + "\n" for each in units)


def read_quarantine(path: Path) -> list[QuarantinedUnit]:
    """Read `quarantine.jsonl`: the units of work that have no rows."""
    text = read_text(path)
    with about(path):
        return quarantine_from(text)


def quarantine_from(text: str) -> list[QuarantinedUnit]:
    """Parse the text of `quarantine.jsonl`."""
    found = list[QuarantinedUnit]()
    lines = text.removesuffix("\n").split("\n") if text else []
    for number, line in enumerate(lines, start=1):
        with about(f"line {number}"):
            found.append(from_record(QuarantinedUnit, object_of(line, f"line of {QUARANTINE}")))
    return found
