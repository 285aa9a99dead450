"""Reads and writes baselines as JSON that people can review: a header, then one line per grasp."""

import json
from dataclasses import asdict, fields
from pathlib import Path, PurePath

from pydantic import TypeAdapter, ValidationError

from grasp_core.errors import InputError
from grasp_core.files.json_text import check_schema, complaint, object_of, shown
from grasp_core.files.text_files import read_text, write_text
from sim_validate.baselines.entries import Baseline, fields_of

SCHEMA = 1
MARK = '"grasps_file"'
"""Text that stands in every baseline, and in no other file."""


def baseline_to_json(baseline: Baseline) -> str:
    """Write the text of a baseline; equal verdicts give equal texts."""
    header = {
        "schema": SCHEMA,
        **{each.name: getattr(baseline, each.name) for each in fields(Baseline)},
    }
    del header["entries"], header["part"]
    for name in ("unit", "scale"):
        if header[name] is None:
            del header[name]
    head = json.dumps(header, indent=1, sort_keys=True, allow_nan=False).removesuffix("\n}")
    lines = ",\n  ".join(
        json.dumps(fields_of(entry), allow_nan=False) for entry in baseline.entries
    )
    part = ""
    if (now := baseline.part) is not None:
        record = asdict(now) | {"surface": now.surface.model_dump()}
        part = f' "part": {json.dumps(record)},\n'
    return f'{head},\n{part} "grasps": [\n  {lines}\n ]\n}}\n'


def baseline_from_json(text: str, path: str) -> Baseline:
    """Parse the text of a baseline."""
    try:
        return _from_text(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _from_text(text: str) -> Baseline:
    record = object_of(text, "baseline")
    if "grasps_file" not in record:
        raise InputError("expected a baseline, as `graspproof baseline record` writes it")
    check_schema(record, SCHEMA)
    del record["schema"]
    # an empty list is refused, because it would check nothing
    record["entries"] = record.pop("grasps", None) or None
    try:
        found = TypeAdapter(Baseline).validate_json(json.dumps(record))
    except ValidationError as error:
        said = complaint(error, Baseline)
        raise InputError("grasps" + said.removeprefix("entries")
                         if said.startswith("entries") else said) from error  # fmt: skip
    if PurePath(found.grasps_file).is_absolute() or not found.grasps_file.isprintable():
        raise InputError(
            "grasps_file: expected a path relative to this baseline's folder, got "
            f"{shown(found.grasps_file)}; name the file with --grasps"
        )
    return found


def read_baseline(path: Path) -> Baseline:
    """Read the baseline in a file."""
    return baseline_from_json(read_text(path), str(path))


def write_baseline(path: Path, baseline: Baseline) -> None:
    """Write a baseline to a new file, or over another baseline."""
    check_writable(path)
    write_text(path, baseline_to_json(baseline))


def check_writable(path: Path) -> None:
    """Refuse a path where a file stands that is not a baseline of any version."""
    if path.exists() and MARK not in read_text(path):
        raise InputError(
            f"{path}: this file is not a baseline and will not be overwritten; choose another path"
        )
