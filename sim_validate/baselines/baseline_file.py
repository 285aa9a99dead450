"""Baselines <-> JSON that is read in reviews: a header, then a line for each grasp, sorted."""

import json
from dataclasses import asdict, fields
from typing import Any, cast

from grasp_core.errors import InputError
from sim_validate.baselines.values import Baseline, Entry

SCHEMA = 1


def baseline_to_json(baseline: Baseline) -> str:
    """The text of a baseline: the same for the same verdicts."""
    header = {
        "schema": SCHEMA,
        **{each.name: getattr(baseline, each.name) for each in fields(Baseline)},
    }
    del header["entries"]
    head = json.dumps(header, indent=1, sort_keys=True).removesuffix("\n}")
    lines = ",\n  ".join(json.dumps(asdict(entry)) for entry in baseline.entries)
    return f'{head},\n "grasps": [\n  {lines}\n ]\n}}\n'


def baseline_from_json(text: str, path: str) -> Baseline:
    """Read a baseline.

    Args:
        text: Of the file.
        path: Of the file, for messages.

    Raises:
        InputError: It is no baseline of this version; the message names the field.
    """
    try:
        found: object = json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not JSON ({error})") from error
    if not isinstance(found, dict):
        raise InputError(f"{path}: expected an object")
    record = cast("dict[str, Any]", found)
    if record.get("schema") != SCHEMA:
        raise InputError(f"{path}: schema: expected {SCHEMA}, got {record.get('schema')!r}")
    names = {each.name for each in fields(Baseline)} - {"entries"}
    if odd := sorted((record.keys() - {"schema", "grasps"}) ^ names):
        raise InputError(f"{path}: {odd[0]}: is missing, or not known")
    listed = record.pop("grasps", None)
    if not isinstance(listed, list) or not listed:
        raise InputError(f"{path}: grasps: expected a list of one or more")
    entries = tuple(_entry(each, f"{path}: grasps[{i}]") for i, each in enumerate(listed))  # pyright: ignore
    if len({entry.id for entry in entries}) < len(entries):
        raise InputError(f"{path}: grasps: two have the same id")
    return Baseline(**{name: record[name] for name in names}, entries=entries)


def _entry(given: Any, where: str) -> Entry:
    kinds = {each.name: getattr(each.type, "__name__", str(each.type)) for each in fields(Entry)}
    if not isinstance(given, dict) or set(cast("dict[str, Any]", given)) != set(kinds):
        raise InputError(f"{where}: expected {', '.join(kinds)}")
    record = cast("dict[str, Any]", given)
    for name, value in record.items():
        if not _fits(value, kinds[name]):
            raise InputError(f"{where}.{name}: expected {kinds[name]}, got {value!r}")
    return Entry(**record)


def _fits(value: object, kind: str) -> bool:
    if value is None:
        return "None" in kind
    if isinstance(value, bool):
        return False
    wanted = str if "str" in kind else int if "int" in kind else (int, float)
    return isinstance(value, wanted)
