"""Plan and simulate a sample of a dataset again: do the same rows come out?

With the same packages, code and processor architecture every cell must be the same. With others,
the same grasps must be there with the same verdicts; numbers of the simulation may differ, and
those of the analysis by rounding.
"""

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, cast

from grasp_core.errors import GraspError
from sim_validate.datasets.columns import KEYS, TABLES, Name
from sim_validate.datasets.config import config_from_toml
from sim_validate.datasets.finish import CONFIG, CONTACTS, QUARANTINE, TWIN
from sim_validate.datasets.given import read_given
from sim_validate.datasets.making import made_of
from sim_validate.datasets.manifest import Manifest
from sim_validate.datasets.meshes import stored_body
from sim_validate.datasets.rows import id_beginning
from sim_validate.datasets.tables import as_read
from sim_validate.datasets.units import WorkUnit, provenance
from sim_validate.files import read_text

ROUNDING = 1e-6
"""How far numbers of the analysis may be apart with other packages, relative to the larger."""
MEASURED: Mapping[Name, tuple[str, ...]] = {
    "objects": (),
    "grasps": ("mismatches", "simulated_critical_friction"),
    "trials": (
        "reason", "displacement_m", "rotation_rad", "slip_m", "failed_after_s", "simulated_limit",
    ),
}  # fmt: skip
"""Columns that the simulation decides."""
MOST_NAMED = 20
"""Faults of one unit that are listed."""

Rows = Mapping[Name, Sequence[Mapping[str, Any]]]


@dataclass(frozen=True, slots=True)
class Sample:
    """Which units to do again."""

    share: float
    """Of all units; at least one is done."""
    seed: int = 0
    """For which ones."""


def sample_faults(folder: Path, manifest: Manifest, rows: Rows, sample: Sample) -> Iterator[str]:
    """What comes out otherwise, a line each.

    Args:
        folder: Of the dataset.
        manifest: What made it.
        rows: All of them.
        sample: Which units to do again.
    """
    config = config_from_toml(folder / CONFIG)
    exact = manifest.versions == dict(provenance())
    objects = {row["object_id"]: row for row in rows["objects"]}
    given = read_given(folder / CONTACTS) if config.contacts else ()
    left_out = _left_out(folder)
    units = list[tuple[str, float]]()
    for object_id, friction in product(sorted(objects), sorted(config.frictions)):
        gone = left_out.get((objects[object_id]["source_sha256"], friction))
        if gone is None or (gone and len(gone) < len(given)):
            units.append((object_id, friction))
        elif _of_unit(rows, object_id, friction)["grasps"]:
            name = objects[object_id]["source_name"]
            yield f"{name} at friction {friction}: is quarantined, but has rows"
    for object_id, friction in drawn(units, sample):
        about = objects[object_id]
        gone = left_out.get((about["source_sha256"], friction), set())
        part = tuple(each for each in given if each.id not in gone)
        where = f"{about['source_name']} at friction {friction}"
        try:
            body = stored_body(folder, object_id, about["source_name"], config.faces)
            unit = WorkUnit(
                about["source_name"], None, about["source_sha256"], friction, config, part
            )
            made = made_of(unit, body)
        except GraspError as error:
            yield f"{where}: cannot be done again ({error})"
            continue
        stored = _of_unit(rows, object_id, friction)
        faults = [
            fault
            for name in TABLES
            for fault in _differences(name, stored[name], as_read(name, made.rows[name]), exact)
        ]
        if exact:
            faults += [
                f"{path}: is not what comes out again"
                for path, text in made.files.items()
                if read_text(folder / path) != text
            ]
        yield from (f"{where}: {fault}" for fault in faults[:MOST_NAMED])


def _left_out(folder: Path) -> dict[tuple[str, float], set[str]]:
    """Units that have no rows, with the given grasps that are missing if they are some."""
    found: dict[tuple[str, float], set[str]] = {}
    for line in read_text(folder / QUARANTINE).splitlines():
        each = json.loads(line)
        if not each["reason"].startswith(TWIN):
            found.setdefault((each["source_sha256"], each["friction"]), set()).update(each["given"])
    return found


def drawn(units: Sequence[tuple[str, float]], sample: Sample) -> list[tuple[str, float]]:
    """Units in an order that only the seed decides, so that a larger share holds a smaller one."""

    def place(unit: tuple[str, float]) -> bytes:
        return hashlib.sha256(f"{sample.seed} {unit}".encode()).digest()

    return sorted(units, key=place)[: math.ceil(sample.share * len(units))]


def _of_unit(rows: Rows, object_id: str, friction: float) -> Rows:
    beginning = id_beginning(object_id, friction)
    return {
        "objects": [row for row in rows["objects"] if row["object_id"] == object_id],
        "grasps": [row for row in rows["grasps"] if row["grasp_id"].startswith(beginning)],
        "trials": [row for row in rows["trials"] if row["grasp_id"].startswith(beginning)],
    }


def _differences(
    name: Name,
    stored: Sequence[Mapping[str, Any]],
    made: Sequence[Mapping[str, Any]],
    exact: bool,
) -> Iterator[str]:
    before = {tuple(row[key] for key in KEYS[name]): row for row in stored}
    after = {tuple(row[key] for key in KEYS[name]): row for row in made}
    yield from (f"{name}: {key[-1]} is not found again" for key in before.keys() - after.keys())
    yield from (
        f"{name}: {key[-1]} is found, but not there" for key in after.keys() - before.keys()
    )
    for key in before.keys() & after.keys():
        for column in TABLES[name]:
            one, other = before[key][column.name], after[key][column.name]
            told = exact or column.name not in MEASURED[name]
            if told and not _same(one, other, 0.0 if exact else ROUNDING):
                yield f"{name}: {key}: {column.name} is {one}, done again {other}"


def _same(one: Any, other: Any, apart: float) -> bool:
    if isinstance(one, list) and isinstance(other, list):
        pairs = zip(cast("list[Any]", one), cast("list[Any]", other), strict=True)
        return all(_same(x, y, apart) for x, y in pairs)
    if isinstance(one, float) and isinstance(other, float):
        return abs(one - other) <= apart * max(abs(one), abs(other))
    return bool(one == other)
