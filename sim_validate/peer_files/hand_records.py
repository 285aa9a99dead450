"""Turns a hand in a grasp into a record of DexGraspBench, and a record into a hand in a grasp.

With the joint angles q of the grasp, the levers L of `Motors`, contact forces f and the servos'
stiffness k, the servos squeeze when they are told

    q + L f / k                                                                          (1)

as Dexonomy makes its squeezes. A record names the root of the hand's file, and poses here are the
palm's, which is a body in it (see `HandFile`). The palm of any hand that is not built in is taken
as its root.
"""

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.checked import coefficient, instance, number, positive, text
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import InputError
from grasp_core.hands.collisions import tip_gaps
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_motors import chains, hand_motors
from grasp_core.hands.kinematics import places, tip_jacobians
from grasp_core.hands.reach import HandReach, Stance, stance_of, uncoupled
from grasp_core.objects.on_faces import check_body, face_under
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact
from scenes.mjcf_text import quaternion
from scenes.tested.hand_scene import Postures
from sim_validate.peer_files.dexgraspbench_records import FREE, DexRecord
from sim_validate.peer_files.hand_files import hand_file

TOUCH_M = 0.002
"""Gap or overlap up to which a fingertip counts as touching [m]: DexGraspBench's own."""
PUSH_N = 5.0
"""Largest normal force of the squeeze unless stated [N]."""
STRONG_N_M = 1e6
"""Torque limit of a hand whose levers are asked for: no limit matters to them."""
GAP_M = 0.005
"""How far fingertips have opened in a record's pregrasp unless stated [m]."""
SHARES = 65
"""Number of postures looked at on the way from the grasp to the pregrasp."""
FEWEST = 3
"""Fewest fingertips that can hold an object without torsion."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RecordedReach(HandReach):
    """What is found of a recorded grasp; tests of other tools judge the record itself."""

    record: DexRecord = field(kw_only=True)


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


def dex_record(
    hand: Hand, reach: HandReach, object_path: str, *, push_n: float = PUSH_N,
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
    stance = stance_of(uncoupled(hand, "a record of DexGraspBench"), reach)
    positive(push_n, "push_n")
    servo = hand_file(hand).servo_n_m_per_rad if servo_n_m_per_rad is None else servo_n_m_per_rad
    positive(servo, "servo_n_m_per_rad")
    text(object_path, "object_path")
    strong = hand.with_torque_limits(STRONG_N_M, "none: only levers are asked for")
    levers = hand_motors(strong, reach).levers
    normals = np.array([contact.normal for contact in stance.contacts])
    largest = float(np.einsum("ki,ki->k", stance.forces, normals).max())
    forces = push_n / largest * stance.forces
    told = levers @ forces.ravel() / servo
    root = _seven(stance.palm_pose @ np.linalg.inv(hand_file(hand).root))
    opened = stance.joints if reach.pregrasp is None else reach.pregrasp
    if gap_m is not None:
        opened = _opened_by(stance, opened, positive(gap_m, "gap_m"))
    return DexRecord(
        object_path, 1.0, np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
        *(np.concatenate([root, joints]) for joints in (opened, stance.joints,
                                                        stance.joints + to_digits(told))),
    )  # fmt: skip


def _opened_by(stance: Stance, opened: Array, gap_m: float) -> Array:
    """Open each finger on its way to a posture until its tip is a gap away along the normal."""
    shares = np.linspace(0.0, 1.0, SHARES)
    ways = stance.joints + shares[:, None] * (opened - stance.joints)
    tips = places(stance.hand, ways, stance.palm_pose).tips
    gaps = [
        np.maximum.accumulate((tips[0, finger] - tips[:, finger]) @ contact.normal)
        for finger, contact in zip(stance.fingers, stance.contacts, strict=True)
    ]
    gap = min(gap_m, *(float(each[-1]) for each in gaps))
    found, joints = opened.copy(), chains(stance.hand)
    for finger, each in zip(stance.fingers, gaps, strict=True):
        share, own = float(np.interp(gap, each, shares)), list(joints[finger])
        found[own] = stance.joints[own] + share * (opened - stance.joints)[own]
    return found


def reach_of_record(
    record: DexRecord, hand: Hand, body: Polyhedron, friction: float, *,
    touch_m: float = TOUCH_M, name: str = "record",
) -> RecordedReach:  # fmt: skip
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
        fewer than three fingertips touch. `judge_hand_by` judges the record in each case.

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
    palm = _palms(record, hand)[1]
    found = partial(RecordedReach, hand.name, name, record=record)
    touching, contacts = _touched(hand, body, joints, palm, touch_m)
    if len(touching) < FEWEST:
        said = f"only {len(touching)} fingertips are within {1e3 * touch_m:g} mm of the surface"
        return found("not found", said, 1, 0.0)
    proof = force_closure(contacts, friction=friction)
    if not proof.closed:
        said = f"the contacts of {len(touching)} fingertips are proved not to be in force closure"
        return found("no closure", said, 1, 0.0, open_choices=(proof,))
    return found(
        "", "", 1, 0.0, np.array(touching), joints, palm, contacts, proof,
        pregrasp=record.pregrasp[FREE:], used=np.arange(len(touching)),
    )  # fmt: skip


def recorded_postures(reach: RecordedReach, hand: Hand, servo_n_m_per_rad: float) -> Postures:
    """Return where a record has a hand: open, touching, and as servos are told to squeeze.

    The pushes are those with which fingertips, all of them taken to touch, best explain the
    squeeze's torques.
    """
    if reach.hand != hand.name:
        raise InputError(f"hand must be the recorded one, {reach.hand}, got {hand.name}")
    record = reach.record
    joints = np.array([each[FREE:] for each in (record.pregrasp, record.grasp, record.squeeze)])
    palms = _palms(record, hand)
    torques = servo_n_m_per_rad * (joints[2] - joints[1])
    J = tip_jacobians(hand, joints[1], palms[1])[0].reshape(-1, len(torques))
    forces = np.asarray(np.linalg.lstsq(J.T, torques, rcond=None)[0], dtype=np.float64)
    axes = pose_of(record.object_pose)[:3, :3].T
    return Postures(palms, joints, np.linalg.norm(forces.reshape(-1, 3), axis=1), axes=axes)


def _palms(record: DexRecord, hand: Hand) -> Array:
    """Return the poses of the palm in the object's frame, open, touching and squeezing."""
    roots = [pose_of(each) for each in (record.pregrasp, record.grasp, record.squeeze)]
    return np.linalg.inv(pose_of(record.object_pose)) @ np.array(roots) @ hand_file(hand).root


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
