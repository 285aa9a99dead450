"""Checks whether a dataset is as its manifest says, and computes a sample of it again.

With the same packages and code, on processors that round alike, every cell of the sample must be
the same. Otherwise each family must have as many grasps as before, and grasps that come out with
the same contacts must have the same verdict and critical friction.
"""

import hashlib
import math
from collections import Counter
from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from grasp_core.errors import GraspError, InputError
from grasp_core.files.text_files import read_text
from grasp_core.provenance import arithmetic
from sim_validate.datasets.build import CONFIG, CONTACTS, TWIN
from sim_validate.datasets.columns import Cells
from sim_validate.datasets.config import KEYS, DatasetConfig, Name, config_from_toml, id_beginning
from sim_validate.datasets.make_unit import made_of
from sim_validate.datasets.open_dataset import (
    MANIFEST,
    QUARANTINE,
    Listed,
    Manifest,
    Selection,
    by_object,
    read_left_out,
    read_manifest,
    stored_body,
)
from sim_validate.datasets.parquet import pyarrow
from sim_validate.datasets.rows import GraspRow, ObjectRow, Rows
from sim_validate.datasets.units import WorkUnit, provenance, read_given
from sim_validate.datasets.verify_rows import object_faults
from sim_validate.execution.verdict import may_slip

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


def verify(folder: Path, sample: Sample | None = None) -> list[str]:
    """List what is wrong with a dataset, one line each; an empty list means that all is well.

    Checked are hashes, sizes and page checksums of all files; counts, keys and references of rows;
    for each contact set its normals, its closure (proved again), and that its trials agree with its
    row; for each execution what its squeeze carries (proved again), and that its trials agree with
    the row; and for a sample, whether planning and simulating again gives the same rows.
    """
    pyarrow()  # before any work, so that a missing library is named at once
    manifest, faults = read_manifest(folder), list[str]()
    try:
        if faults := list(_file_faults(folder, manifest.files)):
            return faults
        config = config_from_toml(folder / CONFIG)
        faults += _manifest_faults(folder, manifest, config)
        faults += _content_faults(folder, manifest, config)
        if sample is not None and not faults:
            faults += _sample_faults(folder, manifest, sample)
    except InputError as error:
        faults.append(str(error))
    return faults


def _content_faults(folder: Path, manifest: Manifest, config: DatasetConfig) -> Iterator[str]:
    for each in manifest.files:
        if each.table and not Path(each.path).name.startswith(f"{each.split}-"):
            yield (
                f"{each.path}: the manifest lists this file under the split {each.split}, unlike "
                "its name"
            )
    for split in sorted({each.split for each in manifest.files if each.split is not None}):
        for rows in by_object(Selection(folder, manifest, split)):
            yield from object_faults(folder, config, split, rows)


def _file_faults(folder: Path, files: Sequence[Listed]) -> Iterator[str]:
    names = {each.path for each in files}
    there = {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and path.name != MANIFEST
    }
    # staged files no longer matter
    there = {name for name in there if not name.startswith("staging/")}
    yield from (
        f"{path}: this file is not listed in the manifest" for path in sorted(there - names)
    )
    for each in files:
        if fault := each.fault(folder):
            yield f"{each.path}: {fault}"


def _manifest_faults(folder: Path, manifest: Manifest, config: DatasetConfig) -> Iterator[str]:
    if config.sha256 != manifest.config_sha256:
        yield f"{CONFIG}: the file is not the configuration that the manifest names"
    if manifest.groups != config.groups:
        yield f"{MANIFEST}: `groups` is {manifest.groups}, unlike {CONFIG}"
    lines = len(read_left_out(folder / QUARANTINE))
    if lines != manifest.quarantined:
        yield (
            f"{QUARANTINE}: the file has {lines} lines, but the manifest says "
            f"{manifest.quarantined}"
        )


def _sample_faults(folder: Path, manifest: Manifest, sample: Sample) -> Iterator[str]:
    redoing = _Redoing(folder, manifest)
    everything = Selection(folder, manifest, None)
    units = [
        (row.object_id, friction)
        for row in everything.rows(ObjectRow)
        for friction in redoing.frictions(row)
    ]
    chosen = {*drawn(sorted(units), sample)}
    splits = sorted({each.split for each in manifest.files if each.split is not None})
    for split in splits:
        for rows in by_object(Selection(folder, manifest, split)):
            for row in rows.objects:
                yield from redoing.faults(row, rows, chosen)


class _Redoing:
    """Computes parts of a dataset again."""

    def __init__(self, folder: Path, manifest: Manifest) -> None:
        self._folder = folder
        self._config = config_from_toml(folder / CONFIG)
        self._tables = manifest.tables
        same = (dict(provenance()), arithmetic())
        self._exact = (manifest.versions, manifest.arithmetic) == same
        self._given = read_given(folder / CONTACTS) if self._config.contacts else ()
        self._left_out: dict[tuple[str, float], set[str]] = {}
        """Given grasps without rows, by source and friction; none where grasps are planned."""
        for each in read_left_out(folder / QUARANTINE):
            if not each.reason.startswith(TWIN):
                gone = self._left_out.setdefault((each.source_sha256, each.friction), set())
                gone.update(each.given)

    def frictions(self, row: ObjectRow) -> list[float]:
        """List the frictions at which an object has rows, perhaps without a grasp."""
        return [f for f in self._config.frictions if not self._all_left_out(row, f)]

    def faults(self, row: ObjectRow, rows: Rows, chosen: Set[tuple[str, float]]) -> Iterator[str]:
        """Yield sentences on what is wrong with an object at the chosen frictions."""
        for friction in self._config.frictions:
            stored = _of_unit(rows, row.object_id, friction)
            where = f"{row.source_name} at friction {friction}"
            if self._all_left_out(row, friction):
                if stored.grasps:
                    yield f"{where}: {QUARANTINE} lists this object as left out, but it has rows"
            elif (row.object_id, friction) in chosen:
                found = islice(self._unit_faults(row, friction, stored), MOST_NAMED)
                yield from (f"{where}: {fault}" for fault in found)

    def _all_left_out(self, row: ObjectRow, friction: float) -> bool:
        gone = self._left_out.get((row.source_sha256, friction))
        return gone is not None and len(gone) == len(self._given)

    def _unit_faults(self, row: ObjectRow, friction: float, stored: Rows) -> Iterator[str]:
        name, source = row.source_name, row.source_sha256
        gone = self._left_out.get((source, friction), set())
        given = tuple(each for each in self._given if each.id not in gone)
        try:
            body = stored_body(self._folder, row.object_id, name, self._config.faces)
            made = made_of(WorkUnit(name, None, source, friction, self._config, given), body)
        except GraspError as error:
            yield f"the grasps cannot be computed again ({error})"
            return
        if not self._exact:
            yield from _loose_differences(stored, made.rows)
            return
        for table, columns in self._tables.items():
            yield from _differences(
                table, stored.cells(table, columns), made.rows.cells(table, columns)
            )
        for path, text in made.files.items():
            if read_text(self._folder / path) != text:
                yield f"{path}: the file differs from what is computed again"


def drawn(units: Sequence[tuple[str, float]], sample: Sample) -> list[tuple[str, float]]:
    """Choose units at random, in an order that only the seed decides."""

    def place(unit: tuple[str, float]) -> bytes:
        return hashlib.sha256(f"{sample.seed} {unit}".encode()).digest()

    return sorted(units, key=place)[: math.ceil(sample.share * len(units))]


def _of_unit(rows: Rows, object_id: str, friction: float) -> Rows:
    beginning = id_beginning(object_id, friction)
    return Rows(
        tuple(row for row in rows.objects if row.object_id == object_id),
        tuple(row for row in rows.grasps if row.grasp_id.startswith(beginning)),
        tuple(row for row in rows.trials if row.grasp_id.startswith(beginning)),
        tuple(row for row in rows.executions if row.grasp_id.startswith(beginning)),
    )


def _differences(name: Name, stored: Sequence[Cells], made: Sequence[Cells]) -> Iterator[str]:
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


def _loose_differences(stored: Rows, made: Rows) -> Iterator[str]:
    """Yield differences beyond rounding, which may choose other, equally good grasps."""
    before, after = (
        {row.grasp_id: row for row in rows.grasps if row.control_of is None}
        for rows in (stored, made)
    )
    counts = [Counter(row.family for row in rows.values()) for rows in (before, after)]
    if counts[0] != counts[1]:
        yield f"grasps: {dict(counts[0])} by family, but {dict(counts[1])} when computed again"
    for name in sorted(before.keys() & after.keys()):
        yield from (
            f"grasps: {name}: {said}" for said in loose_differences(before[name], after[name])
        )


def loose_differences(one: GraspRow, other: GraspRow) -> Iterator[str]:
    """Yield how rows differ where numbers were rounded otherwise.

    A grasp whose contacts slip may be kept or lost by a hair, so its survival does not count.
    """
    if one.contacts != other.contacts or not np.allclose(
        one.points, other.points, rtol=OTHER_ROUNDING, atol=0.0
    ):
        return  # the best contacts are not unique
    if (one.held, one.force_closed) != (other.held, other.force_closed):
        yield f"outcome is {one.outcome}, but {other.outcome} when computed again"
    slips = any(map(may_slip, (one.predicted_first_slip, other.predicted_first_slip)))
    if one.survived != other.survived and not slips:
        yield f"survived is {one.survived}, but {other.survived} when executed again"
    frictions = [row.critical_friction or 0.0 for row in (one, other)]
    if not np.isclose(*frictions, rtol=OTHER_ROUNDING, atol=0.0):
        yield f"critical friction {frictions[0]}, done again {frictions[1]}"
