"""Turns a hand in a grasp into a record of DexGraspBench, and a record into a hand in a grasp.

With the joint angles q of the grasp, the levers L of `Motors`, contact forces f and the servos'
stiffness k, the servos squeeze when they are told

    q + L f / k                                                                          (1)

as Dexonomy makes its squeezes. A record names the root of the hand's file, and poses here are the
palm's, which is a body in it: `ROOTS` has its pose for the built-in hands, in the files that
DexGraspBench takes from MuJoCo Menagerie. The palm of any other hand is taken as its root.
"""

from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.checked import coefficient, instance, number, positive, text
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import InputError
from grasp_core.hands.distances.collisions import tip_gaps
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_motors import hand_motors
from grasp_core.hands.reach import HandReach
from grasp_core.hands.stance import stance_of
from grasp_core.objects.on_faces import check_body, face_under
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact
from scenes.mjcf_text import quaternion
from sim_validate.peer_files.dexgraspbench_records import FREE, DexRecord

TOUCH_M = 0.002
"""Gap or overlap up to which a fingertip counts as touching [m]: DexGraspBench's own."""
SERVO_N_M_PER_RAD, PUSH_N = 5.0, 5.0
"""Stiffness of DexGraspBench's servos, and largest normal force of the squeeze unless stated."""
STRONG_N_M = 1e6
"""Torque limit of a hand whose levers are asked for: no limit matters to them."""
FEWEST = 3
"""Fewest fingertips that can hold an object without torsion."""


@dataclass(frozen=True, slots=True)
class HandRoot:
    """Pose of the palm in the world of a hand's file."""

    position: tuple[float, float, float]
    turn: tuple[float, float, float, float]
    """Quaternion (w, x, y, z) of any length."""

    @property
    def pose(self) -> Array:
        """Return the pose, (4, 4)."""
        return pose_of(np.array([*self.position, *self.turn]))


ROOTS = {
    "allegro": HandRoot((0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 1.0)),
    "allegro-urdf": HandRoot((0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 1.0)),
    "leap": HandRoot((0.0, 0.0, 0.1), (0.0, 1.0, 0.0, 0.0)),
}
"""By the names of built-in hands. Sources: DexGraspBench's assets/hand/allegro/right_hand.xml, and
for LEAP the offsets in its src/task/convert_format.py, at the commit of `DexRecord`."""


def pose_of(seven: Array) -> Array:
    """Return the pose (4, 4) of a position and a quaternion (w, x, y, z) of any length."""
    w, x, y, z = (seven[3:FREE] / np.linalg.norm(seven[3:FREE])).tolist()
    found = np.eye(4)
    found[:3, 3] = seven[:3]
    found[:3, :3] = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return found


def _seven(pose: Array) -> Array:
    return np.concatenate([pose[:3, 3], quaternion(pose[:3, :3])])


def _root(hand: Hand) -> Array:
    return ROOTS[hand.name].pose if hand.name in ROOTS else np.eye(4)


def dex_record(
    hand: Hand, reach: HandReach, object_path: str, *, push_n: float = PUSH_N,
    servo_n_m_per_rad: float = SERVO_N_M_PER_RAD,
) -> DexRecord:  # fmt: skip
    """Record where a hand stands in a grasp, for DexGraspBench.

    The object is at the origin of the record's world, at scale 1.

    Args:
        hand: The hand.
        reach: The pose in which it stands (see `gc.reach_with`). Without a pregrasp the record
            starts at the grasp.
        object_path: Folder of the object, as DexGraspBench is to find it.
        push_n: Largest normal force of the squeeze [N].
        servo_n_m_per_rad: Stiffness of the servos that are told to squeeze.

    Raises:
        InputError: The pose is another hand's, or none was found.
    """
    stance = stance_of(hand, reach)
    positive(push_n, "push_n")
    positive(servo_n_m_per_rad, "servo_n_m_per_rad")
    text(object_path, "object_path")
    strong = hand.with_torque_limits(STRONG_N_M, "none: only levers are asked for")
    levers = hand_motors(strong, reach).levers
    normals = np.array([contact.normal for contact in stance.contacts])
    largest = float(np.einsum("ki,ki->k", stance.forces, normals).max())
    forces = push_n / largest * stance.forces
    told = levers @ forces.ravel() / servo_n_m_per_rad
    root = _seven(stance.palm_pose @ np.linalg.inv(_root(hand)))
    opened = stance.joints if reach.pregrasp is None else reach.pregrasp
    return DexRecord(
        object_path, 1.0, np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
        *(np.concatenate([root, joints]) for joints in (opened, stance.joints,
                                                        stance.joints + to_digits(told))),
    )  # fmt: skip


def reach_of_record(
    record: DexRecord, hand: Hand, body: Polyhedron, friction: float, *,
    touch_m: float = TOUCH_M, name: str = "record",
) -> HandReach:  # fmt: skip
    """Find the contacts of a recorded grasp, and prove whether they are in force closure.

    A fingertip's contact is the point of the surface that is nearest to it, or to its deepest
    corner, if the fingertip is at most `touch_m` away from the surface or in it. Links other than
    fingertips are not looked at, and neither are overlaps: a record may hold any pose.

    Args:
        record: The recorded grasp.
        hand: The hand, with its joints in the order of the record.
        body: The object, its lengths multiplied by the record's scale.
        friction: Coulomb coefficient at every contact.
        touch_m: Largest gap or overlap of a fingertip that counts as touching [m].
        name: Id of the grasp.

    Returns:
        The pose with its contacts and proof; or `no closure` with a proof, or `not found` where
        fewer than three fingertips touch.

    Raises:
        InputError: The record has not as many joints as the hand.
    """
    instance(record, DexRecord, "record", "load_dex_record reads one")
    instance(hand, Hand, "hand", "load_hand makes one")
    check_body(body)
    coefficient(friction)
    number(touch_m, "touch_m", least=0.0, most=1.0)
    text(name, "name")
    joints = record.grasp[FREE:]
    if len(joints) != len(hand.joints):
        raise InputError(
            f"record must have the {len(hand.joints)} joints of {hand.name}, got {len(joints)}; "
            "give the hand that was recorded"
        )
    held = np.linalg.inv(pose_of(record.object_pose)) @ pose_of(record.grasp)
    palm = held @ _root(hand)
    touching, contacts = _touched(hand, body, joints, palm, touch_m)
    if len(touching) < FEWEST:
        said = f"only {len(touching)} fingertips are within {1e3 * touch_m:g} mm of the surface"
        return HandReach(hand.name, name, "not found", said, 1, 0.0)
    proof = force_closure(contacts, friction=friction)
    if not proof.closed:
        said = f"the contacts of {len(touching)} fingertips are proved not to be in force closure"
        return HandReach(hand.name, name, "no closure", said, 1, 0.0, open_choices=(proof,))
    return HandReach(
        hand.name, name, "", "", 1, 0.0, np.array(touching), joints, palm, contacts, proof,
        pregrasp=record.pregrasp[FREE:], used=np.arange(len(touching)),
    )  # fmt: skip


def _touched(
    hand: Hand, body: Polyhedron, joints: Array, palm: Array, touch_m: float
) -> tuple[list[int], tuple[Contact, ...]]:
    """Find the fingers that touch, and where."""
    found = tip_gaps(hand, body, joints, palm, np.arange(len(hand.fingers)))
    fingers = np.flatnonzero(np.abs(found.gaps) <= touch_m).tolist()
    contacts = tuple(
        Contact(found.on_object[k], _inward(body, found.on_tips[k], found.on_object[k]))
        for k in fingers
    )
    return fingers, contacts


def _inward(body: Polyhedron, tip: Array, point: Array) -> Array:
    """Return the inward normal at a surface point: of the face under it, or away from the tip."""
    way = point - tip
    length = float(np.linalg.norm(way))
    guess = way / length
    face = face_under(body, Contact(point, guess))
    return guess if face is None else np.array(face.normal)
