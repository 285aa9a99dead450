"""Is a dataset what its manifest says, and do its rows keep the laws of what they describe?"""

from collections.abc import Iterator, Mapping, Sequence, Set
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.closure import force_closure
from grasp_core.errors import GraspError, InputError
from grasp_core.mesh import nearest_on_surface
from sim_validate.datasets.columns import KEYS, TABLES, Name
from sim_validate.datasets.manifest import MANIFEST, Listed, listed, read_manifest
from sim_validate.datasets.meshes import stored_surface
from sim_validate.datasets.redo import Sample, sample_faults
from sim_validate.datasets.rows import NOT_TRIED
from sim_validate.datasets.tables import read_rows, require_pyarrow

SAME_MARGIN = 1e-6
"""How far a closure margin may be from that of the contacts, relative to the friction."""
ON_SURFACE, NEAR_SURFACE = 1e-5, 1e-3
"""How far contacts may be from the object's mesh, relative to its size: planar faces are as flat as
six digits tell. Controls may be beside the border of a face."""
UNIT = 1e-9
"""How far normals may be from unit length."""


def verify(folder: Path, sample: Sample | None = None) -> list[str]:
    """What is wrong with a dataset, a line each; nothing where all is well.

    Hashes, sizes and page checksums of all files; counts, keys and references of rows; of each
    contact set its normals, its closure proved again, and that its trials say what it says; and
    of a sample, whether planning and simulating again gives the same rows.

    Args:
        folder: Of the dataset.
        sample: What to plan and simulate again; nothing if not given.

    Raises:
        InputError: The folder holds no finished dataset, or pyarrow is not installed.
    """
    require_pyarrow()
    manifest = read_manifest(folder)
    if faults := list(_file_faults(folder, manifest.files)):
        return faults
    rows: dict[Name, list[dict[str, Any]]] = {name: [] for name in TABLES}
    for each in manifest.files:
        if each.table is None:
            continue
        try:
            found = read_rows(folder / each.path)
        except InputError as error:
            return [str(error)]
        if len(found) != each.rows:
            faults.append(f"{each.path}: {len(found)} rows, listed are {each.rows}")
        rows[each.table] += found
    faults += [*_row_faults(rows), *_mesh_faults(folder, rows)]
    if sample is not None and not faults:
        faults += sample_faults(folder, manifest, rows, sample)
    return faults


def _file_faults(folder: Path, files: Sequence[Listed]) -> Iterator[str]:
    names = {each.path for each in files}
    there = {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and path.name not in (MANIFEST, ".lock")
    }
    yield from (f"{path}: not in the manifest" for path in sorted(there - names))
    for each in files:
        if each.path not in there:
            yield f"{each.path}: missing"
            continue
        found = listed(folder, folder / each.path)
        if found.bytes != each.bytes:
            yield f"{each.path}: {found.bytes} bytes, listed are {each.bytes}"
        elif found.sha256 != each.sha256:
            yield f"{each.path}: its contents are not what was written (sha256 differs)"


def _row_faults(rows: Mapping[Name, Sequence[Mapping[str, Any]]]) -> Iterator[str]:
    for name in TABLES:
        keys = [tuple(row[key] for key in KEYS[name]) for row in rows[name]]
        if len(set(keys)) < len(keys):
            yield f"{name}: rows with the same {' and '.join(KEYS[name])}"
    splits = {row["object_id"]: row["split"] for row in rows["objects"]}
    names = {row["grasp_id"] for row in rows["grasps"]}
    ended: dict[str, list[str]] = {}
    for trial in rows["trials"]:
        ended.setdefault(trial["grasp_id"], []).append(trial["outcome"])
    yield from (f"trials: {name} is no grasp" for name in sorted(ended.keys() - names))
    for row in rows["grasps"]:
        name = row["grasp_id"]
        faults = [*_reference_faults(row, splits, names), *_contact_faults(row)]
        trials = ended.get(name, [])
        held = None if row["outcome"] == NOT_TRIED else all(one == "held" for one in trials)
        if len(trials) != row["trials"] or row["held"] != held:
            faults.append("its trials say something else")
        yield from (f"grasps: {name}: {fault}" for fault in faults)


def _mesh_faults(folder: Path, rows: Mapping[Name, Sequence[Mapping[str, Any]]]) -> Iterator[str]:
    """Whether meshes are those of their objects, and contacts are on them."""
    points: dict[str, list[list[float]]] = {row["object_id"]: [] for row in rows["objects"]}
    slack: dict[str, list[float]] = {row["object_id"]: [] for row in rows["objects"]}
    for row in rows["grasps"]:
        if row["outcome"] == NOT_TRIED:
            continue
        near = ON_SURFACE if row["control_of"] is None else NEAR_SURFACE
        points.get(row["object_id"], []).extend(row["contact_points_m"][: row["contacts"]])
        slack.get(row["object_id"], []).extend([near] * row["contacts"])
    for row in rows["objects"]:
        try:
            vertices, triangles = stored_surface(folder, row["object_id"])
        except InputError as error:
            yield str(error)
            continue
        contacts = np.array(points[row["object_id"]]).reshape(-1, 3)
        nearest = nearest_on_surface(vertices, triangles, contacts)
        away = np.linalg.norm(nearest - contacts, axis=1)
        allowed = np.array(slack[row["object_id"]]) * row["radius_m"]
        if (off := int((away > allowed).sum())) > 0:
            yield f"grasps: {off} contacts of {row['source_name']} are not on the object"


def _reference_faults(
    row: Mapping[str, Any], splits: Mapping[str, str], names: Set[str]
) -> Iterator[str]:
    """What a row names that is not there."""
    if splits.get(row["object_id"]) != row["split"]:
        yield "its object is not there, or in another split"
    if row["control_of"] is not None and row["control_of"] not in names:
        yield f"{row['control_of']} is no grasp"


def _contact_faults(row: Mapping[str, Any]) -> Iterator[str]:
    """Normals, and closure from the contacts alone."""
    count = row["contacts"]
    points = np.array(row["contact_points_m"][:count], dtype=np.float64)
    normals = np.array(row["contact_normals"][:count], dtype=np.float64)
    if not (np.abs(np.linalg.norm(normals, axis=1) - 1.0) <= UNIT).all():
        yield "a normal is no unit vector"
        return
    if row["outcome"] == NOT_TRIED:
        return
    try:
        certificate = force_closure(points, normals, row["friction"])
    except GraspError as error:
        if row["label"] == "grasp":
            yield f"closure cannot be decided ({error})"
        return
    if certificate.closed != row["force_closed"]:
        yield f"force-closed is {row['force_closed']}, the contacts say {certificate.closed}"
    elif certificate.closed and not np.isclose(
        certificate.margin, row["closure_margin"], rtol=0.0, atol=SAME_MARGIN * row["friction"]
    ):
        stated = row["closure_margin"]
        yield f"closure margin {stated:.9g}, the contacts say {certificate.margin:.9g}"
