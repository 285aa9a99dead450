"""Checks whether a dataset is as its manifest says, and computes a sample of it again.

With the same packages and code, on processors that round alike, every cell of the sample must be
the same. Otherwise each family must have as many grasps as before, and grasps that come out with
the same contacts must have the same verdict and critical friction.
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

from grasp_core.arrays import Array
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import GraspError, InputError, UndecidedError
from grasp_core.files.strict_json import shown
from grasp_core.files.text_files import read_text
from grasp_core.geometry.on_mesh import Surface
from grasp_core.provenance import arithmetic
from grasp_core.values import FINGERS
from sim_validate.datasets.build import CONFIG, CONTACTS, QUARANTINE, TWIN
from sim_validate.datasets.config import config_from_toml
from sim_validate.datasets.given_contacts import read_given
from sim_validate.datasets.make_unit import made_of
from sim_validate.datasets.manifest import (
    MANIFEST,
    Listed,
    Manifest,
    listed,
    read_left_out,
    read_manifest,
)
from sim_validate.datasets.meshes import stored_body, stored_surface
from sim_validate.datasets.open_dataset import ObjectRows, Row, Selection, by_object
from sim_validate.datasets.parquet import as_read, pyarrow
from sim_validate.datasets.rows import GIVEN, NOT_TRIED
from sim_validate.datasets.tables import KEYS, Name, Tables, id_beginning
from sim_validate.datasets.units import WorkUnit, provenance
from sim_validate.datasets.varied import VARIED
from sim_validate.datasets.verify_rows import (
    execution_faults,
    figure_faults,
    kind_faults,
    loose_difference,
)
from sim_validate.files.paths import path_inside

OTHER_ROUNDING = 1e-6
"""Relative difference that numbers may have when other packages or processors round them."""
MOST_NAMED = 20
"""Largest number of faults that are listed for one object at one friction."""
SAME_MARGIN = 1e-6
"""Largest difference between a closure margin in a row and that of the contacts, relative to the
friction."""
ON_SURFACE, NEAR_SURFACE = 1e-5, 0.05
"""Largest distance of contacts from the mesh, for grasps and negative controls, relative to the
object's radius. Planar faces are as flat as six digits show. Negative controls are moved in
the planes of patches, from which a curved surface departs."""
UNIT = 1e-9
"""Largest difference between a normal's length and one."""


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


def verify(folder: Path, sample: Sample | None = None) -> list[str]:
    """List what is wrong with a dataset, one line each; an empty list means that all is well.

    Checked are hashes, sizes and page checksums of all files; counts, keys and references of rows;
    for each contact set its normals, its closure (proved again), and that its trials agree with its
    row; for each execution what its squeeze carries (proved again), and that its trials agree with
    the row; and for a sample, whether planning and simulating again gives the same rows.
    """
    pyarrow()  # before any work, so that a missing library is named at once
    manifest = read_manifest(folder)
    if faults := list(_file_faults(folder, manifest.files)):
        return faults
    faults: list[str] = []
    try:
        faults += _manifest_faults(folder, manifest)
        faults += _content_faults(folder, manifest)
        if sample is not None and not faults:
            faults += sample_faults(folder, manifest, sample)
    except InputError as error:
        faults.append(str(error))
    except (TypeError, KeyError, ValueError) as error:  # a cell is null that must not be
        faults.append(f"data: a row is not as this version writes rows ({shown(str(error))})")
    return faults


def _content_faults(folder: Path, manifest: Manifest) -> Iterator[str]:
    """Yield sentences on what is wrong with rows and meshes, one object at a time."""
    config = config_from_toml(folder / CONFIG)
    for each in manifest.files:
        if each.table and not Path(each.path).name.startswith(f"{each.split}-"):
            yield (
                f"{each.path}: the manifest lists this file under the split {each.split}, unlike "
                "its name"
            )
    for split in sorted({each.split for each in manifest.files if each.split is not None}):
        for rows in by_object(Selection(folder, manifest, split)):
            yield from _split_faults(split, rows)
            yield from _row_faults(rows, config.frictions)
            yield from _mesh_faults(folder, rows)
            yield from execution_faults(folder, config, rows)
            yield from kind_faults(config, rows)
            yield from figure_faults(folder, config, rows)


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
        if each.path not in there:
            yield f"{each.path}: this file is listed in the manifest, but missing"
            continue
        try:
            found = listed(folder, path_inside(folder, each.path))
        except InputError as error:
            yield str(error)
            continue
        if found.bytes != each.bytes:
            yield (
                f"{each.path}: the file has {found.bytes} bytes, but the manifest lists "
                f"{each.bytes}"
            )
        elif found.sha256 != each.sha256:
            yield f"{each.path}: the file differs from what was written (its sha256 differs)"


def _split_faults(split: str, rows: ObjectRows) -> Iterator[str]:
    """Check that rows are in the files of their split."""
    for name in ("objects", "grasps"):
        if any(row["split"] != split for row in rows[name]):
            yield f"{name}: files of the split {split} have rows of another split"


def _manifest_faults(folder: Path, manifest: Manifest) -> Iterator[str]:
    """Check that the manifest agrees with the files that it lists."""
    config = config_from_toml(folder / CONFIG)
    if config.sha256 != manifest.config_sha256:
        yield f"{CONFIG}: the file is not the configuration that the manifest names"
    if manifest.groups != config.groups:
        yield f"{MANIFEST}: `groups` is {manifest.groups}, unlike {CONFIG}"
    if manifest.executed != (config.execution is not None):
        yield f"{MANIFEST}: `executed` is {manifest.executed}, unlike {CONFIG}"
    lines = len(read_left_out(folder / QUARANTINE))
    if lines != manifest.quarantined:
        yield (
            f"{QUARANTINE}: the file has {lines} lines, but the manifest says "
            f"{manifest.quarantined}"
        )


def _row_faults(rows: ObjectRows, frictions: Sequence[float]) -> Iterator[str]:
    for name in rows:
        keys = [tuple(row[key] for key in KEYS[name]) for row in rows[name]]
        if len(set(keys)) < len(keys):
            yield f"{name}: two rows have the same {' and '.join(KEYS[name])}"
    splits = {row["object_id"]: row["split"] for row in rows["objects"]}
    names = {row["grasp_id"] for row in rows["grasps"]}
    ended: dict[str, list[str]] = {}
    for trial in rows["trials"]:
        ended.setdefault(trial["grasp_id"], []).append(trial["outcome"])
    yield from (
        f"trials: {name} has no row in the table of grasps" for name in sorted(ended.keys() - names)
    )
    for row in rows["grasps"]:
        name = row["grasp_id"]
        faults = [
            *_reference_faults(row, splits, names),
            *_outcome_faults(row, ended.get(name, [])),
        ]
        own = row["control_of"] is None and row["label"] != VARIED
        if own and row["friction"] not in frictions:
            faults.append(f"friction {row['friction']} is not among those of {CONFIG}")
        if row["outcome"] != NOT_TRIED:
            faults += _contact_faults(row)
        yield from (f"grasps: {name}: {fault}" for fault in faults)


def _outcome_faults(row: Mapping[str, Any], trials: Sequence[str]) -> Iterator[str]:
    """Check that a row agrees with its trials, and claims nothing if it was not tried."""
    if row["outcome"] == NOT_TRIED:
        claims = [row[name] for name in ("held", "force_closed", "closure_margin")]
        if row["label"] != GIVEN or any(claim is not None for claim in claims) or trials:
            yield "the row claims results, although the grasp was not tried"
        return
    held = all(one == "held" for one in trials)
    if not trials or len(trials) != row["trials"] or row["held"] != held:
        yield "the row contradicts the table of trials"
    elif (row["outcome"] == "held") != held:
        yield f"`outcome` is {row['outcome']!r}, but `held` is {held}"


def _mesh_faults(folder: Path, rows: ObjectRows) -> Iterator[str]:
    """Check that meshes belong to their objects, and that contacts lie on the meshes."""
    claimed: dict[str, list[tuple[Array, Array | None, float]]] = {
        row["object_id"]: [] for row in rows["objects"]
    }
    for row in rows["grasps"]:
        of_object = claimed.get(row["object_id"])
        if row["outcome"] == NOT_TRIED or of_object is None:
            continue
        points, normals = row["contact_points_m"], row["contact_normals"]
        for point, normal in list(zip(points, normals, strict=True))[: row["contacts"]]:
            if row["control_of"] is None:
                of_object.append((np.array(point), np.array(normal), ON_SURFACE))
            else:  # some controls have a flipped normal
                of_object.append((np.array(point), None, NEAR_SURFACE))
    for row in rows["objects"]:
        try:
            mesh = stored_surface(folder, row["object_id"])
        except InputError as error:
            yield str(error)
            continue
        surface = Surface(mesh.vertices, mesh.triangles)
        on_it = [
            surface.holds(point, normal, slack * row["radius_m"])
            for point, normal, slack in claimed[row["object_id"]]
        ]
        if off := on_it.count(False):
            yield (
                f"grasps: {off} contacts of {row['source_name']} are not on the object, or not "
                "with its normals"
            )


def _reference_faults(
    row: Mapping[str, Any], splits: Mapping[str, str], names: Set[str]
) -> Iterator[str]:
    """Yield sentences on references of a row to rows that are missing."""
    if splits.get(row["object_id"]) != row["split"]:
        yield "the row's object is missing, or in another split"
    if row["control_of"] is not None and row["control_of"] not in names:
        yield f"{row['control_of']}, named in control_of, has no row"


def _contact_faults(row: Mapping[str, Any]) -> Iterator[str]:
    """Check the normals of a contact set, and compute its closure from the contacts alone."""
    count = row["contacts"]
    closed = row["force_closed"]
    if not 1 <= count <= FINGERS or closed is None or (closed and row["closure_margin"] is None):
        yield "the row lacks its contacts, or results about them"
        return
    points = np.array(row["contact_points_m"][:count], dtype=np.float64)
    normals = np.array(row["contact_normals"][:count], dtype=np.float64)
    if not (np.abs(np.linalg.norm(normals, axis=1) - 1.0) <= UNIT).all():
        yield "a contact normal is not a unit vector"
        return
    try:
        certificate = force_closure(points, normals, row["friction"])
    except UndecidedError as error:
        if row["force_closed"]:
            yield f"force closure of the contacts cannot be decided ({error})"
        return
    except GraspError as error:
        yield f"force closure of the contacts cannot be computed ({error})"
        return
    if certificate.closed != row["force_closed"]:
        yield (
            f"force_closed is {row['force_closed']}, but from the contacts it is "
            f"{certificate.closed}"
        )
    elif certificate.closed and not np.isclose(
        certificate.margin, row["closure_margin"], rtol=0.0, atol=SAME_MARGIN * row["friction"]
    ):
        stated = row["closure_margin"]
        yield (
            f"closure margin is {stated:.9g}, but from the contacts it is {certificate.margin:.9g}"
        )
