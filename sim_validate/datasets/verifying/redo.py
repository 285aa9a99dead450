"""Plans and simulates a sample of a dataset again, and compares the rows.

With the same packages and code, on processors that round alike, every cell must be the same.
Otherwise each family must have as many grasps as before, and grasps that come out with the same
contacts must have the same verdict and critical friction.
"""

import hashlib
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.errors import GraspError
from grasp_core.files.text_files import read_text
from grasp_core.provenance import arithmetic
from sim_validate.datasets.building.make_unit import made_of
from sim_validate.datasets.building.write_tables import CONFIG, CONTACTS, QUARANTINE, TWIN
from sim_validate.datasets.columns import KEYS, Name, Tables
from sim_validate.datasets.config import config_from_toml
from sim_validate.datasets.given_contacts import read_given
from sim_validate.datasets.manifest import Manifest
from sim_validate.datasets.meshes import stored_body
from sim_validate.datasets.open_dataset import Selection
from sim_validate.datasets.parquet import as_read
from sim_validate.datasets.quarantine import read_left_out
from sim_validate.datasets.rows import id_beginning
from sim_validate.datasets.units import WorkUnit, provenance
from sim_validate.datasets.verifying.executions import loose_difference
from sim_validate.datasets.verifying.rows_by_object import ObjectRows, Row, by_object

OTHER_ROUNDING = 1e-6
"""Relative difference that numbers may have when other packages or processors round them."""
MOST_NAMED = 20
"""Largest number of faults that are listed for one object at one friction."""


@dataclass(frozen=True, slots=True)
class Sample:
    """Which part of a dataset to compute again."""

    share: float
    """Share of all objects at frictions that is computed again, at least one of them."""
    seed: int = 0
    """Seed of the random choice."""


def sample_faults(folder: Path, manifest: Manifest, sample: Sample) -> Iterator[str]:
    """Compute a sample of a dataset again, and yield a sentence about each difference."""
    redoing = _Redoing(folder, manifest)
    everything = Selection(folder, manifest, None)
    units = [
        (row["object_id"], friction)
        for row in everything.rows("objects")
        for friction in redoing.frictions(row)
    ]
    chosen = set(drawn(sorted(units), sample))
    splits = sorted({each.split for each in manifest.files if each.split is not None})
    for split in splits:
        for rows in by_object(Selection(folder, manifest, split)):
            for row in rows["objects"]:
                yield from redoing.faults(row, rows, chosen)


class _Redoing:
    """Computes parts of a dataset again."""

    def __init__(self, folder: Path, manifest: Manifest) -> None:
        self._folder = folder
        self._config = config_from_toml(folder / CONFIG)
        same = (dict(provenance()), arithmetic())
        self._exact = (manifest.versions, manifest.arithmetic) == same
        self._given = read_given(folder / CONTACTS) if self._config.contacts else ()
        self._left_out = _left_out(folder)

    def frictions(self, row: Mapping[str, Any]) -> list[float]:
        """List the frictions at which an object has rows, perhaps without a grasp."""
        return [f for f in self._config.frictions if not self._all_left_out(row, f)]

    def faults(
        self, row: Mapping[str, Any], rows: ObjectRows, chosen: Set[tuple[str, float]]
    ) -> Iterator[str]:
        """Yield sentences on what is wrong with an object at the chosen frictions."""
        for friction in self._config.frictions:
            stored = _of_unit(rows, row["object_id"], friction)
            where = f"{row['source_name']} at friction {friction}"
            if self._all_left_out(row, friction):
                if stored["grasps"]:
                    yield f"{where}: {QUARANTINE} lists this object as left out, but it has rows"
            elif (row["object_id"], friction) in chosen:
                found = islice(self._unit_faults(row, friction, stored), MOST_NAMED)
                yield from (f"{where}: {fault}" for fault in found)

    def _all_left_out(self, row: Mapping[str, Any], friction: float) -> bool:
        gone = self._left_out.get((row["source_sha256"], friction))
        return gone is not None and len(gone) == len(self._given)

    def _unit_faults(
        self, row: Mapping[str, Any], friction: float, stored: ObjectRows
    ) -> Iterator[str]:
        name, source = row["source_name"], row["source_sha256"]
        gone = self._left_out.get((source, friction), set())
        given = tuple(each for each in self._given if each.id not in gone)
        try:
            body = stored_body(self._folder, row["object_id"], name, self._config.faces)
            made = made_of(WorkUnit(name, None, source, friction, self._config, given), body)
        except GraspError as error:
            yield f"the grasps cannot be computed again ({error})"
            return
        tables = self._config.tables
        now: ObjectRows = {each: as_read(each, made.rows[each], tables) for each in tables}
        if not self._exact:
            yield from _loose_differences(stored, now)
            return
        for table in tables:
            yield from _differences(table, tables, stored[table], now[table])
        for path, text in made.files.items():
            if read_text(self._folder / path) != text:
                yield f"{path}: the file differs from what is computed again"


def _left_out(folder: Path) -> dict[tuple[str, float], set[str]]:
    """Read which objects have no rows at a friction, with the given grasps that are missing."""
    found: dict[tuple[str, float], set[str]] = {}
    for each in read_left_out(folder / QUARANTINE):
        if not each.reason.startswith(TWIN):
            found.setdefault((each.source_sha256, each.friction), set()).update(each.given)
    return found


def drawn(units: Sequence[tuple[str, float]], sample: Sample) -> list[tuple[str, float]]:
    """Choose units at random, in an order that only the seed decides."""

    def place(unit: tuple[str, float]) -> bytes:
        return hashlib.sha256(f"{sample.seed} {unit}".encode()).digest()

    return sorted(units, key=place)[: math.ceil(sample.share * len(units))]


def _of_unit(rows: ObjectRows, object_id: str, friction: float) -> ObjectRows:
    beginning = id_beginning(object_id, friction)
    return {
        name: [
            row
            for row in of_table
            if (row["object_id"] == object_id if name == "objects"
                else row["grasp_id"].startswith(beginning))
        ]
        for name, of_table in rows.items()
    }  # fmt: skip


def _differences(
    name: Name, tables: Tables, stored: Sequence[Row], made: Sequence[Row]
) -> Iterator[str]:
    """Yield sentences on cells that differ, and on rows that only one side has."""
    before = {tuple(row[key] for key in KEYS[name]): row for row in stored}
    after = {tuple(row[key] for key in KEYS[name]): row for row in made}
    yield from (
        f"{name}: {key[-1]} has a row, but is not computed again"
        for key in before.keys() - after.keys()
    )
    yield from (
        f"{name}: {key[-1]} is computed again, but has no row"
        for key in after.keys() - before.keys()
    )
    for key in before.keys() & after.keys():
        for column in tables[name]:
            one, other = before[key][column.name], after[key][column.name]
            if one != other:
                yield f"{name}: {key}: {column.name} is {one}, but {other} when computed again"


def _loose_differences(stored: ObjectRows, made: ObjectRows) -> Iterator[str]:
    """Yield differences beyond rounding, which may choose other, equally good grasps."""
    before = {row["grasp_id"]: row for row in stored["grasps"] if row["control_of"] is None}
    after = {row["grasp_id"]: row for row in made["grasps"] if row["control_of"] is None}
    counts = [Counter(row["family"] for row in rows.values()) for rows in (before, after)]
    if counts[0] != counts[1]:
        yield f"grasps: {dict(counts[0])} by family, but {dict(counts[1])} when computed again"
    for name in sorted(before.keys() & after.keys()):
        one, other = before[name], after[name]
        points = [np.array(row["contact_points_m"], dtype=np.float64) for row in (one, other)]
        if not np.allclose(*points, rtol=OTHER_ROUNDING, atol=0.0):
            continue  # the best contacts are not unique
        if one["held"] != other["held"] or one["force_closed"] != other["force_closed"]:
            yield (
                f"grasps: {name}: outcome is {one['outcome']}, but {other['outcome']} when "
                "computed again"
            )
        if said := loose_difference(one, other):
            yield f"grasps: {name}: {said}"
        frictions = [float(row["critical_friction"] or 0.0) for row in (one, other)]
        if not np.isclose(*frictions, rtol=OTHER_ROUNDING, atol=0.0):
            yield f"grasps: {name}: critical friction {frictions[0]}, done again {frictions[1]}"
