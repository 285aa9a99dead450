"""Whole files of each kind, made by the program itself, for cases to spoil."""

import json
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from sim_validate.main import main


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


def reading(file: str, command: str, folder: Path) -> list[str]:
    """The words of a command in which FILE stands for a file, or comes last, and {grasps} for one.

    The other file is made there: a whole `good.json`.
    """
    words = command.split()
    if "{grasps}" in words:
        (folder / "good.json").write_bytes(good("grasps.json"))
        words[words.index("{grasps}")] = "good.json"
    words = words if "FILE" in words else [*words, "FILE"]
    return [file if word == "FILE" else word for word in words]


def grasps_text() -> str:
    """A grasps.json with one grasp of the tetrahedron."""
    return good("grasps.json").decode()


def with_value(text: str | bytes, path: str, value: Any) -> str:
    """A JSON text with another value at a path of keys and places; `raw:` stands for itself."""
    document = json.loads(text)
    *way, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    place = document
    for part in way:
        place = place[part]
    place[last] = value
    made = json.dumps(document)
    if isinstance(value, str) and value.startswith("raw:"):
        made = made.replace(json.dumps(value), value.removeprefix("raw:"), 1)
    return made


def without(text: str | bytes, path: str) -> str:
    """A JSON text without the value at a path."""
    document = json.loads(text)
    *way, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    place = document
    for part in way:
        place = place[part]
    del place[last]
    return json.dumps(document)
