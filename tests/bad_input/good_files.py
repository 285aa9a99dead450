"""Whole files of each kind, made by the program itself, for cases to spoil."""

import json
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from sim_validate.main import main
from tests.damaged import value_at


@cache
def _folder() -> TemporaryDirectory[str]:
    """What commands write about the tetrahedron, by name."""
    folder = TemporaryDirectory()
    out = Path(folder.name)
    asked = "--random-wrenches 0 --no-report --limit 1 -q"
    assert main(["run", "tetrahedron", *asked.split(), "--out", str(out)]) == 0
    assert main(
        ["regions", str(out / "grasps.json"), "--max-cones", "64", "--out", str(out), "-q"]
    ) in {0, 1}
    record = ["baseline", "record", str(out / "grasps.json"), "-o", str(out / "a.baseline.json")]
    assert main([*record, "-q"]) == 0
    return folder


def good(name: str) -> bytes:
    """A whole file: grasps.json, verdicts.json, regions.json or a.baseline.json."""
    return (Path(_folder().name) / name).read_bytes()


def changed(text: str | bytes, path: str, *values: Any) -> str:
    """A JSON text with another value at a path of keys and places, or without any there."""
    document = json.loads(text)
    *way, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    place = value_at(document, way)
    if values:
        (place[last],) = values
    else:
        del place[last]
    return json.dumps(document)
