"""Computes units of a dataset again, and tells what comes out otherwise.

With the same packages and code, on processors that round alike, every cell must be the same.
Otherwise each family must have as many grasps as before, and grasps that come out with the same
contacts must have the same verdict and critical friction.
"""

from collections import Counter
from collections.abc import Iterator, Sequence, Set
from itertools import islice

import numpy as np

from grasp_core.errors import GraspError
from grasp_core.files.file_kinds import QUARANTINE
from grasp_core.files.text_files import read_text
from grasp_core.provenance import arithmetic
from sim_validate.datasets.columns import ROUNDOFF, DatasetRows, GraspRow, ObjectRow
from sim_validate.datasets.config import KEYS, TableName
from sim_validate.datasets.given_grasps import read_given
from sim_validate.datasets.hand_files import kept_fault
from sim_validate.datasets.layout import GIVEN_CONTACTS
from sim_validate.datasets.making_rows import compute_rows
from sim_validate.datasets.open_dataset import Dataset
from sim_validate.datasets.parquet import RowCells
from sim_validate.datasets.quarantine import TWIN, read_quarantine
from sim_validate.datasets.row_faults import disagreements
from sim_validate.datasets.work_units import WorkUnit, provenance
from sim_validate.execution.verdict import may_slip

MOST_UNIT_FAULTS = 20


class Recomputing:
    """Computes units of a dataset again, and compares them with their rows."""

    def __init__(self, dataset: Dataset) -> None:
        self._dataset, self._config, manifest = dataset, dataset.config, dataset.manifest
        same = (dict(provenance()), arithmetic())
        self._exact = (manifest.versions, manifest.arithmetic) == same
        self._given = read_given(dataset.folder / GIVEN_CONTACTS) if self._config.contacts else ()
        self._quarantined: dict[tuple[str, float], set[str]] = {}
        """Given grasps without rows, by source and friction; none where grasps are planned."""
        for each in read_quarantine(dataset.folder / QUARANTINE):
            if not each.reason.startswith(TWIN):
                gone = self._quarantined.setdefault((each.source_sha256, each.friction), set())
                gone.update(each.given)

    def hand_fault(self) -> str:
        """Say how the hand is not the one that its files describe, where numbers round alike."""
        asked, folder = self._config.hand, self._dataset.hand_folder
        if asked is None or folder is None or not self._exact:
            return ""
        return kept_fault(asked, folder)

    def frictions(self, row: ObjectRow) -> list[float]:
        """List the frictions at which an object has rows, perhaps without a grasp."""
        return [f for f in self._config.frictions if not self._all_quarantined(row, f)]

    def faults(
        self, row: ObjectRow, rows: DatasetRows, chosen: Set[tuple[str, float]]
    ) -> Iterator[str]:
        """Yield sentences on what is wrong with an object at the chosen frictions."""
        for friction in self._config.frictions:
            stored = rows.of_unit(row, friction)
            where = f"{row.source_name} at friction {friction}"
            if self._all_quarantined(row, friction):
                if stored.grasps:
                    yield f"{where}: {QUARANTINE} lists this object as left out, but it has rows"
            elif (row.object_id, friction) in chosen:
                found = islice(self._unit_faults(row, friction, stored), MOST_UNIT_FAULTS)
                yield from (f"{where}: {fault}" for fault in found)

    def _all_quarantined(self, row: ObjectRow, friction: float) -> bool:
        gone = self._quarantined.get((row.source_sha256, friction))
        return gone is not None and len(gone) == len(self._given)

    def _unit_faults(self, row: ObjectRow, friction: float, stored: DatasetRows) -> Iterator[str]:
        name, source = row.source_name, row.source_sha256
        gone = self._quarantined.get((source, friction), set())
        given = tuple(each for each in self._given if each.id not in gone)
        try:
            body = self._dataset.body(row.object_id, name)
            hand = self._dataset.hand_folder
            unit = WorkUnit(name, None, source, friction, self._config, given, hand)
            made = compute_rows(unit, body)
        except GraspError as error:
            yield f"the grasps cannot be computed again ({error})"
            return
        if not self._exact:
            yield from _differences_beyond_rounding(stored, made.rows)
            return
        for table, columns in self._dataset.manifest.tables.items():
            before, after = (rows.cells(table, columns) for rows in (stored, made.rows))
            yield from _cell_differences(table, before, after)
        for path, text in made.files.items():
            if read_text(self._dataset.folder / path) != text:
                yield f"{path}: the file differs from what is computed again"


def _cell_differences(
    name: TableName, stored: Sequence[RowCells], made: Sequence[RowCells]
) -> Iterator[str]:
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
        for column, one in before[key].items():
            if one != (other := after[key][column]):
                yield f"{name}: {key}: {column} is {one}, but {other} when computed again"


def _differences_beyond_rounding(stored: DatasetRows, made: DatasetRows) -> Iterator[str]:
    """Yield differences beyond rounding, which may choose other, equally good grasps."""
    before, after = (
        {row.grasp_id: row for row in rows.grasps if row.control_of is None}
        for rows in (stored, made)
    )
    counts = [Counter(row.family for row in rows.values()) for rows in (before, after)]
    if counts[0] != counts[1]:
        yield f"grasps: {dict(counts[0])} by family, but {dict(counts[1])} when computed again"
    yield from (
        f"grasps: {name}: {said}" for name in sorted(before.keys() & after.keys())
        for said in verdict_differences(before[name], after[name])
    )  # fmt: skip


def verdict_differences(one: GraspRow, other: GraspRow) -> Iterator[str]:
    """Yield how rows differ where numbers were rounded otherwise.

    A grasp whose contacts slip may be kept or lost by a hair, so its survival does not count.
    """
    same = one.contacts == other.contacts
    if not same or not np.allclose(one.points, other.points, rtol=ROUNDOFF, atol=0.0):
        return  # the best contacts are not unique
    slips = any(map(may_slip, (one.predicted_first_slip, other.predicted_first_slip)))
    names = ("held", "force_closed", "critical_friction", *(() if slips else ("survived",)))
    again = {name: getattr(other, name) for name in names}
    yield from disagreements(one, again, "computing it again")
