"""Reads and writes DexGraspBench's records: a hand's pregrasp, grasp and squeeze at an object.

A record is a dictionary in a `.npy` file. A configuration of a hand (`..._qpos`) is the pose of the
hand's root, position and quaternion (w, x, y, z), then the joints in the order of the hand's file;
`obj_pose` is that of the object, `obj_scale` a factor on its mesh, and `obj_path` a folder that the
tool MeshProcess has filled. The root is the world of the hand's file: the palm has a pose in it.
The palm of any hand that is not built in is taken as its root.

With the joint angles q of the grasp, the levers L of `Motors`, contact forces f and the servos'
stiffness k, the servos squeeze when they are told

    q + L f / k                                                                          (1)

as Dexonomy makes its squeezes.

Sources: github.com/JYChen18/DexGraspBench at 1e7a5a6fce27cc92911080cbdc5ce9da56fddbf0, README.md,
src/task/eval_func/base.py, src/util/hand_util.py, and its assets/hand, with MuJoCo Menagerie's
`leap_hand`, which its file includes, and meshes of Menagerie's `wonik_allegro`, of which MuJoCo
3.3.2 makes Allegro's links, with the density 800 of the file.
"""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np
from annotated_types import Len
from pydantic import AfterValidator, Field

from grasp_core.allowed_values import Quantity, instance, path_of, value_of
from grasp_core.arrays import Array, Shape, to_digits
from grasp_core.by_value import summary
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.files.json_text import text_of
from grasp_core.files.records import record_of
from grasp_core.files.text_files import write_parts, write_text
from grasp_core.hands.hand import PALM_NAME, Hand
from grasp_core.hands.hand_arrays import places
from grasp_core.hands.hand_motors import hand_motors
from grasp_core.hands.reach import HandReach, Stance, stance_of
from grasp_core.messages import UnfitError
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.polyhedron import Polyhedron, is_convex
from scenes.mujoco.mjcf_text import IDENTITY_POSE, quaternion, rotations
from scenes.mujoco.published_tests import HandServos

ROOT_POSE = 7
"""Numbers of a pose: position and quaternion."""
UNIT_QUATERNION = 1e-3
"""How far the length of a quaternion may be from 1: records have numbers of single precision."""
MOST_RECORD_BYTES = 16 * 2**20
"""Largest size of a file: a record has some thousand bytes."""
DENSITY = 1000.0
"""Density with which the file of an object states its mass [kg/m^3]."""
TOUCH_M = 0.002
"""Gap or overlap up to which a fingertip counts as touching [m]: DexGraspBench's own."""
SQUEEZE_PUSH_N = 5.0
"""Largest normal force of the squeeze unless stated [N]."""
STRONG_N_M = 1e6
"""Torque limit of a hand whose levers are asked for: no limit matters to them."""
GAP_M = 0.005
"""How far fingertips have opened in a record's pregrasp unless stated [m]."""
POSTURE_SHARES = 65
"""Number of postures looked at on the way from the grasp to the pregrasp."""
FEWEST_TIPS = 3
"""Fewest fingertips that can hold an object without torsion."""


def _rooted(numbers: Array) -> Array:
    """Refuse numbers that do not begin with the pose of a root."""
    if abs(float(np.linalg.norm(numbers[3:ROOT_POSE])) - 1.0) > UNIT_QUATERNION:
        raise UnfitError("must have a quaternion (w, x, y, z) of length 1 in numbers 3 to 6")
    return numbers


Configuration = Annotated[Array, Shape("n"), Len(ROOT_POSE + 1), AfterValidator(_rooted)]
"""Pose of the hand's root, then angles of at least one joint, (7 + j,) [m, rad]."""


@declared
class DexRecord(Declared):
    """A grasp of a hand as DexGraspBench records it."""

    object_path: Annotated[str, Field(alias="obj_path")]
    """Folder of the object, as the record names it."""
    object_scale: Annotated[Quantity, Field(alias="obj_scale")]
    """Factor on the lengths of the object's mesh."""
    object_pose: Annotated[
        Array, Shape(ROOT_POSE), AfterValidator(_rooted), Field(alias="obj_pose")
    ]
    """Position and quaternion (w, x, y, z) of the object, (7,)."""
    pregrasp: Annotated[Configuration, Field(alias="pregrasp_qpos")]
    """Pose of the hand's root, then joint angles, (7 + j,) [m, rad]."""
    grasp: Annotated[Configuration, Field(alias="grasp_qpos")]
    """Pose of the root and joint angles where the hand touches, (7 + j,) [m, rad]."""
    squeeze: Annotated[Configuration, Field(alias="squeeze_qpos")]
    """Pose of the root and joint angles that servos are told to squeeze with, (7 + j,) [m, rad]."""

    def __repr__(self) -> str:
        return summary("DexRecord", self.object_path, joints=len(self.grasp) - ROOT_POSE)


def write_dex_record(record: DexRecord, path: str | Path) -> Path:
    """Write a record so that DexGraspBench reads it; return its path.

    Numbers have double precision. The format is a pickle in a `.npy` file, which `numpy.load`
    reads only where it is told to trust it.

    Raises:
        InputError: `record` is no record, or `path` no path.
    """
    instance(record, DexRecord, "record")
    written: Mapping[str, Any] = record_of(record)
    fields = {key: value if isinstance(value, str | float) else np.array(value)
              for key, value in written.items()}  # fmt: skip
    held = io.BytesIO()
    np.save(held, np.array(fields, dtype=object), allow_pickle=True)
    return write_parts(path_of(path, "path"), [held.getvalue()])


InertialRow: TypeAlias = tuple[float, ...]


LINKS = ("base", "proximal", "medial", "distal")
ALLEGRO: tuple[InertialRow, ...] = (
    (351.4, -8.986, -3.957, -40.27, 447.7, 261.1, 283.1, 0.023, -1.612, -26.37),
    (7.232, -0.778, -0.01, 8.282, 0.748, 0.355, 0.707, 0.0, 0.032, -0.001),
    (27.28, 0.0, -0.091, 27.0, 11.86, 11.28, 2.266, 0.0, 0.0, 0.0),
    (18.46, -0.193, -0.078, 22.59, 4.285, 3.636, 1.676, 0.0, -0.073, -0.001),
    (14.36, -0.273, -0.002, 15.9, 2.418, 2.015, 1.193, 0.0, -0.061, 0.0),
    (38.26, -17.92, 8.024, 12.31, 9.166, 10.64, 7.217, -0.018, 0.007, 0.619),
    (7.219, -0.782, -0.01, 8.105, 0.746, 0.354, 0.705, 0.0, 0.032, -0.001),
    (22.5, -0.164, 0.017, 21.11, 7.526, 6.583, 2.143, 0.0, 0.097, 0.0),
    (23.18, 0.0, 0.003, 21.32, 7.132, 6.808, 1.806, 0.0, 0.0, 0.005),
)
"""Palm, links of a finger, links of the thumb: mass [g], centre [mm] and inertia about it [kg mm^2]
(xx, yy, zz, xy, xz, yz), in the link's frame."""
LEAP_THUMB = ("mp", "base", "proximal", "distal")
LEAP: tuple[InertialRow, ...] = (
    (237.0, -49.54, -42.91, -10.23, 293.5, 192.2, 407.2, -35.62, -0.439, -6.247),
    (44.0, -22.52, 33.88, 16.36, 13.16, 10.3, 17.4, 4.266, 0.507, -0.162),
    (32.0, 7.5, -0.2, -11.0, 3.093, 4.373, 4.885, 0.0, 0.0, 0.0),
    (37.0, 5.421, -29.15, 15.0, 7.676, 5.999, 8.16, 1.174, 0.0, 0.0),
    (16.0, -0.879, -27.02, 14.59, 3.711, 1.659, 3.024, -0.125, -0.001, -0.015),
    (32.0, 7.5, -0.2, -11.0, 3.093, 4.373, 4.885, 0.0, 0.0, 0.0),
    (3.0, 0.0, 0.0, -7.081, 0.619, 0.215, 0.535, 0.0, 0.0, 0.0),
    (38.0, -2.059, 15.91, -13.73, 9.814, 4.365, 9.381, 0.124, 0.163, 0.03),
    (49.0, 0.962, -24.2, -14.42, 20.48, 4.778, 20.72, -1.009, -0.206, 0.097),
)
"""Palm, links of a finger, links of LEAP's thumb, in the columns of `ALLEGRO`."""


def _inertials(
    rows: tuple[InertialRow, ...], fingers: tuple[str, ...], thumb: tuple[str, ...]
) -> dict[str, dict[str, object]]:
    named = [f"{name}_{link}" for name in fingers for link in LINKS]
    names = [PALM_NAME, *named, *(f"thumb_{link}" for link in thumb)]
    every = [rows[0], *rows[1:5] * len(fingers), *rows[5:]]
    return {
        name: {"pos": 1e-3 * np.array(row[1:4]), "mass": 1e-3 * row[0],
               "fullinertia": 1e-6 * np.array(row[4:])}
        for name, row in zip(names, every, strict=True)
    }  # fmt: skip


HAND_FILES = {
    "allegro": HandServos(
        5.0, 0.1,
        np.array([[0, 0, 1, 0], [0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]], np.float64),
        _inertials(ALLEGRO, ("first", "middle", "ring"), LINKS),
    ),
    "leap": HandServos(
        3.0, 0.04,
        np.array([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0.1], [0, 0, 0, 1]], np.float64),
        _inertials(LEAP, ("index", "middle", "ring"), LEAP_THUMB),
    ),
}  # fmt: skip
HAND_FILES["allegro-urdf"] = HAND_FILES["allegro"]


def hand_file(hand: Hand) -> HandServos:
    """Return what the file of a hand says; for others than the built-in ones, the usual values."""
    return HAND_FILES.get(hand.name, HandServos())


def pose_of(seven: Array) -> Array:
    """Return the pose (4, 4) of a position and a quaternion (w, x, y, z) of any length."""
    found = np.eye(4)
    found[:3, 3] = seven[:3]
    found[:3, :3] = rotations((seven[3:ROOT_POSE] / np.linalg.norm(seven[3:ROOT_POSE]))[None])[0]
    return found


def dex_record(
    hand: Hand, reach: HandReach, object_path: str, *, push_n: float = SQUEEZE_PUSH_N,
    servo_n_m_per_rad: float | None = None, gap_m: float | None = GAP_M,
) -> DexRecord:  # fmt: skip
    """Record where a hand stands in a grasp, for DexGraspBench.

    The object is at the origin of the record's world, at scale 1.

    Args:
        hand: The hand.
        reach: The pose in which it stands (see `gc.reach_with`). Without a pregrasp the record
            starts at the grasp.
        object_path: Folder of the object, as DexGraspBench is to find it.
        push_n: Largest normal force of the squeeze [N].
        servo_n_m_per_rad: Stiffness of the servos that are told to squeeze; None for that of
            DexGraspBench's file of the hand.
        gap_m: How far each fingertip has opened in the record's pregrasp [m], so that all meet the
            object at one moment; less where one opens by less in that of the pose. None for that
            one.

    Raises:
        InputError: The pose is another hand's, or none was found.
    """
    stance = stance_of(hand, reach)
    value_of(Quantity, push_n, "push_n")
    own = hand_file(hand).stiffness_n_m_per_rad
    servo = own if servo_n_m_per_rad is None else servo_n_m_per_rad
    value_of(Quantity, servo, "servo_n_m_per_rad")
    value_of(str, object_path, "object_path")
    strong = hand.with_torque_limits(STRONG_N_M, "none: only levers are asked for")
    levers = hand_motors(strong, reach).levers
    normals = np.array([contact.normal for contact in stance.contacts])
    largest = float(np.einsum("ki,ki->k", stance.forces, normals).max())
    forces = push_n / largest * stance.forces
    told = hand.drives.turning @ (levers @ forces.ravel()) / servo
    pose = stance.palm_pose @ np.linalg.inv(hand_file(hand).root)
    root = np.concatenate([pose[:3, 3], quaternion(pose[:3, :3])])
    opened = stance.joints if reach.pregrasp is None else reach.pregrasp
    if gap_m is not None:
        opened = _opened_by(stance, opened, value_of(Quantity, gap_m, "gap_m"))
    return DexRecord(
        object_path, 1.0, IDENTITY_POSE,
        *(np.concatenate([root, joints]) for joints in (opened, stance.joints,
                                                        stance.joints + to_digits(told))),
    )  # fmt: skip


def _opened_by(stance: Stance, opened: Array, gap_m: float) -> Array:
    """Open each finger on its way to a posture until its tip is a gap away along the normal."""
    shares = np.linspace(0.0, 1.0, POSTURE_SHARES)
    ways = stance.joints + shares[:, None] * (opened - stance.joints)
    tips = places(stance.hand, ways, stance.palm_pose).tips
    gaps = [
        np.maximum.accumulate((tips[0, finger] - tips[:, finger]) @ contact.normal)
        for finger, contact in zip(stance.fingers, stance.contacts, strict=True)
    ]
    gap = min(gap_m, *(float(each[-1]) for each in gaps))
    found, joints = opened.copy(), stance.hand.chains
    for finger, each in zip(stance.fingers, gaps, strict=True):
        share, own = float(np.interp(gap, each, shares)), list(joints[finger])
        found[own] = stance.joints[own] + share * (opened - stance.joints)[own]
    return found


def write_dex_object(body: Polyhedron, folder: str | Path) -> Path:
    """Write a convex object for DexGraspBench, at scale 1 in metres; return the folder.

    DexGraspBench takes all files of `urdf/meshes` as convex pieces, and the mass that an object has
    at scale 1 and density 1 from `info/simplified.json`. A convex object is its own only piece;
    others must be taken apart by the tool MeshProcess, as pieces that only cover the surface have
    no mass.

    Raises:
        InputError: The object is not convex.
    """
    check_body(body)
    place = path_of(folder, "folder")
    if not is_convex(body):
        raise InputError(
            f"body must be convex, but {body.name} is not: DexGraspBench simulates convex pieces, "
            "which its companion MeshProcess makes; give its folder as the object's path instead"
        )
    # every digit, corners counted from 1
    corners = ("v " + " ".join(map(repr, point)) for point in body.vertices.tolist())
    faces = ("f " + " ".join(map(str, each)) for each in (body.triangles + 1).tolist())
    mesh = "\n".join([*corners, *faces, ""])
    write_text(place / "urdf" / "meshes" / "convex_piece_000.obj", mesh)
    write_text(place / "mesh" / "simplified.obj", mesh)
    facts = {"mass": body.mass_at(DENSITY), "density": DENSITY, "scale": 1.0}
    write_text(place / "info" / "simplified.json", text_of(facts))
    return place
