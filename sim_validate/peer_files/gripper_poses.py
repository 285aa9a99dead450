"""Reads grasps of parallel grippers: arrays of GraspNet, and HDF5 or JSON files of ACRONYM.

Such a grasp is the pose of a gripper, not contacts. What is kept is the pose in the object's frame,
the opening, and the score or label. Contacts are found as the gripper would close: a line across
the fingers, `pad_m` before their ends, meets the surface from either side, and where it first does
so is a contact with the surface's normal. Two hard points are never in force closure; with torsion
(`torsion_m`) two may be.

GraspNet: rows of 17 numbers, the score, the width, height and depth, a rotation by rows (x points
out of the palm, y across the fingers), a translation, and the object's number. Fingers end at the
depth in front of the translation. Source: graspnet/graspnetAPI at
bd6783c3effdebd895abfba8b96dc22a42ec3b5a, graspnetAPI/grasp.py and utils/utils.py.

ACRONYM: `grasps/transforms` with poses of a Panda gripper (z points out of the palm, x across the
fingers), `grasps/qualities/flex/object_in_gripper`, `object/scale`. Fingers are 41 mm to either
side, and end 112.17 mm from the origin. Source: NVlabs/acronym at
d02f58fb3a556c3b719976e206cce0dce0103199, acronym_tools/acronym.py.
"""

import importlib
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grasp_core.arrays import Array, cross, frozen, real_array
from grasp_core.by_value import ByValue
from grasp_core.checked import LARGEST, number, path_of, positive, whole
from grasp_core.errors import InputError
from grasp_core.files.strict_json import object_of
from grasp_core.files.text_files import read_bytes, read_text
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.short_text import summary
from grasp_core.values import Contact
from sim_validate.peer_files.npy_files import read_npy

PAD_M = 0.01
"""Distance of the closing line from the ends of the fingers, unless stated [m]."""
POSE, ROW, TABLE = 4, 17, 2
PANDA_HALF_M, PANDA_END_M = 0.041, 0.11217
"""Half opening of the Panda gripper, and distance of its fingers' ends from its origin [m]."""
RIGID = 1e-3
"""How far a rotation may be from one: files have numbers of single precision."""
MOST_BYTES = 512 * 2**20
PARALLEL = 1e-12
"""Sine of the angle below which a line runs along a triangle."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class GripperGrasp(ByValue):
    """The pose of a parallel gripper at an object, as another tool's file holds it."""

    pose: Array
    """Pose of a frame midway on the closing line, in the object's frame, (4, 4) [m]: x points from
    one finger to the other, z out of the palm."""
    opening_m: float
    """Distance of the fingers from each other [m]."""
    score: float
    """Score of GraspNet, or 1 and 0 for the success of ACRONYM's simulation."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", _rigid(self.pose, "pose"))
        positive(self.opening_m, "opening_m")
        number(self.score, "score", least=-LARGEST, most=LARGEST)

    def __repr__(self) -> str:
        return summary("GripperGrasp", opening_m=self.opening_m, score=self.score)

    def contacts(self, body: Polyhedron) -> tuple[Contact, ...]:
        """Find where the fingers meet the object when they close: two contacts, or none.

        Args:
            body: The object, in the frame and at the scale of the pose.
        """
        check_body(body)
        across, middle = self.pose[:3, 0], self.pose[:3, 3]
        half = 0.5 * self.opening_m
        found = [
            _first_hit(body, middle - side * half * across, side * across, self.opening_m)
            for side in (1.0, -1.0)
        ]
        return tuple(each for each in found if each is not None) if all(found) else ()


def _rigid(given: ArrayLike, name: str) -> Array:
    pose = frozen(given, (POSE, POSE), name)
    turned = pose[:3, :3]
    off = float(np.abs(turned.T @ turned - np.eye(3)).max())
    if off > RIGID or np.linalg.det(turned) < 0.0 or np.abs(pose[3] - np.eye(POSE)[3]).max() > 0.0:
        raise InputError(
            f"{name} must be a rotation and a translation, (4, 4), got one that is off by {off:.3g}"
        )
    return pose


def _first_hit(body: Polyhedron, start: Array, way: Array, most: float) -> Contact | None:
    """Return where a line first enters the object, with the inward normal; None if nowhere."""
    corners = body.vertices[body.triangles]
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    outward = cross(one, other)
    lean = -outward @ way
    entering = lean > PARALLEL * np.linalg.norm(outward, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = cross(np.broadcast_to(way, one.shape), other)
        determinant = (along * one).sum(axis=1)
        arm = start - corners[:, 0]
        u = (arm * along).sum(axis=1) / determinant
        beside = cross(arm, one)
        v = beside @ way / determinant
        distance = (other * beside).sum(axis=1) / determinant
        inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
    hit = np.flatnonzero(entering & inside & (distance >= 0.0) & (distance <= most))
    if not len(hit):
        return None
    first = hit[int(np.argmin(distance[hit]))]
    normal = -outward[first] / np.linalg.norm(outward[first])
    return Contact(start + distance[first] * way, normal)


def load_graspnet(
    path: str | Path, *, object_number: int | None = None, object_pose: ArrayLike | None = None,
    pad_m: float = PAD_M,
) -> tuple[GripperGrasp, ...]:  # fmt: skip
    """Read the grasps of a GraspNet array.

    Args:
        path: A `.npy` file with rows of 17 numbers.
        object_number: Number of the object whose grasps are kept; None for all.
        object_pose: Pose of the object in the file's frame, (4, 4); None where that is the object's
            own.
        pad_m: Distance of the closing line from the ends of the fingers [m].

    Raises:
        InputError: The file cannot be read, or is no such array.
    """
    place = path_of(path, "path")
    number(pad_m, "pad_m", least=0.0, most=1.0)
    back = np.eye(POSE)
    if object_pose is not None:
        back = np.asarray(np.linalg.inv(_rigid(object_pose, "object_pose")), np.float64)
    if object_number is not None:
        whole(object_number, "object_number")
    rows = real_array(read_npy(place), "rows")
    if rows.ndim != TABLE or rows.shape[1] != ROW:
        raise InputError(f"{place}: expected an array of rows of {ROW} numbers, as GraspNet's")
    kept = rows if object_number is None else rows[rows[:, -1] == object_number]
    return tuple(_of_row(row, back, pad_m) for row in kept)


def _of_row(row: Array, back: Array, pad_m: float) -> GripperGrasp:
    score, width, _, depth = row[:4].tolist()
    turned = row[4:13].reshape(3, 3)
    pose = np.eye(POSE)
    # x points across the fingers here, and z out of the palm
    pose[:3, :3] = np.column_stack([turned[:, 1], turned[:, 2], turned[:, 0]])
    pose[:3, 3] = row[13:16] + (depth - pad_m) * turned[:, 0]
    return GripperGrasp(back @ pose, width, score)


def load_acronym(path: str | Path, *, pad_m: float = PAD_M) -> tuple[GripperGrasp, ...]:
    """Read the grasps of an ACRONYM file; poses are at the object's scale in that file.

    Args:
        path: A `.h5` file (which needs h5py) or a `.json` file.
        pad_m: Distance of the closing line from the ends of the fingers [m].

    Raises:
        InputError: The file cannot be read, lacks a field, or h5py is not installed.
    """
    place = path_of(path, "path")
    number(pad_m, "pad_m", least=0.0, most=1.0)
    transforms, labels = _acronym_json(place) if place.suffix == ".json" else _acronym_h5(place)
    if transforms.shape != (len(transforms), POSE, POSE):
        raise InputError(f"{place}: grasps/transforms must be poses, (n, 4, 4)")
    if labels.shape != (len(transforms),):
        raise InputError(f"{place}: there must be a label for each of {len(transforms)} grasps")
    forward = np.eye(POSE)
    forward[2, 3] = PANDA_END_M - pad_m
    return tuple(
        GripperGrasp(pose @ forward, 2.0 * PANDA_HALF_M, float(label))
        for pose, label in zip(transforms, labels.tolist(), strict=True)
    )


def _acronym_json(place: Path) -> tuple[Array, Array]:
    found = object_of(read_text(place), place.name)
    try:
        return (real_array(found["transforms"], "transforms"),
                real_array(found["quality_flex_object_in_gripper"], "labels"))  # fmt: skip
    except KeyError as error:
        raise InputError(f"{place}: expected the field {error.args[0]}") from error


def _acronym_h5(place: Path) -> tuple[Array, Array]:
    try:
        h5py: Any = importlib.import_module("h5py")
    except ImportError as error:
        raise InputError(
            "reading ACRONYM's HDF5 needs h5py: run pip install 'graspproof[hdf5]' ('.[hdf5]' in a "
            "checkout)"
        ) from error
    data = read_bytes(place, MOST_BYTES)
    labels = "grasps/qualities/flex/object_in_gripper"
    try:
        with h5py.File(io.BytesIO(data), "r") as file:
            return (
                np.asarray(file["grasps/transforms"], np.float64),
                np.asarray(file[labels], np.float64),
            )
    except Exception as error:  # a damaged file can make h5py raise anything
        raise InputError(
            f"{place}: grasps/transforms and {labels} cannot be read from it ({error}); give a "
            "file of ACRONYM"
        ) from error
