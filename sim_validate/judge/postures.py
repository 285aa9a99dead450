"""Completes the postures of a record: how a hand opens before its grasp, and how it squeezes.

Records of many tools have one posture alone. With the contacts' normals n_k into the object, the
levers L_k of the joints at them, and wanted openings g_k, the joints turn by the least angles with

    n_k' L_k' dq = -g_k                                                                  (1)

as far as their ranges let them; contacts that no joint moves stay. Forces f on the object are
pressed by servos of the stiffness k that are told

    q + L f / k                                                                          (2)

where each joint has a servo; where one turns several joints, its torque is that of all of them.

The forces are those of the proof of force closure, or one push along each normal where there is
none, and their largest push is given.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.errors import InputError
from grasp_core.values import Contact
from scenes.hand_files.model_text import listed
from scenes.mujoco.filed_hand import FiledHand
from scenes.mujoco.hand_contacts import LinkContact
from scenes.mujoco.mjcf_text import quaternion
from sim_validate.judge.records import HandRecord

UNLIMITED_N_M = 1e6
"""Torque limit of a motor whose levers alone count [N m]."""
OPENED_M = 0.005
"""Opening of fingers where a record has no posture before the grasp [m]."""
LEAST_SHARE = 0.05
"""Least singular value of (1), over the largest, for which joints turn: what they hardly move would
take them far."""


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A hand at an object as a record has it, with joints in the order of the hand's file."""

    roots: Array
    """Poses of the root in the object's frame, open, touching and squeezing, (3, 4, 4)."""
    joints: Array
    """Joint angles, open, touching and squeezing, (3, j) [rad]; NaN for what is not stated."""
    axes: Array
    """Columns are the axes of the record's world in the object's frame, (3, 3)."""

    def commands(self, center: Array) -> Array:
        """Return what is told, open, touching and squeezing, (3, 7 + j).

        Poses of the root come first, in a world whose origin is the object's centre of mass (3,).
        """
        turns = np.array([quaternion(pose[:3, :3]) for pose in self.roots])
        turns *= np.where(turns @ turns[1] < 0.0, -1.0, 1.0)[:, None]  # no long way round
        return to_digits(np.hstack([self.roots[:, :3, 3] - center, turns, self.joints]))

    @property
    def grasp(self) -> tuple[Array, Array]:
        """Return the pose of the root and the joint angles of the grasp."""
        return self.roots[1], self.joints[1]


def placed(record: HandRecord, hand: FiledHand) -> Placed:
    """Put the joints of a record into the order of a hand's file.

    Raises:
        InputError: The record has other joints than the hand.
    """
    known, given, grasp = hand.joint_names, record.joint_names, record.grasp
    missing = [name for name in known if name not in given]
    unknown = [name for name in given if name not in known]
    if given and (missing or unknown):
        apart = [f"it lacks {listed(missing)}"] if missing else []
        apart += [f"the hand has no {listed(unknown)}"] if unknown else []
        raise InputError(
            f"the record must have the {len(known)} joints of the hand, but "
            f"{' and '.join(apart)}; complete it, or give the hand that was recorded"
        )
    if len(grasp.joints) != len(known):
        raise InputError(
            f"the record must have the {len(known)} joints of the hand, got "
            f"{len(grasp.joints)}; complete it, or give the hand that was recorded"
        )
    order = [given.index(name) for name in known] if given else list(range(len(known)))
    stages = record.pregrasp, grasp, record.squeeze
    unstated = np.full(len(known), np.nan)
    return Placed(
        np.array([(each or grasp).root for each in stages]),
        np.array([unstated if each is None else each.joints[order] for each in stages]),
        record.axes,
    )


def completed(
    at: Placed, hand: FiledHand, contacts: Sequence[LinkContact], levers: Array,
    proof: ClosureCertificate | None, push_n: float,
) -> Placed:  # fmt: skip
    """Open and squeeze as in (1) and (2) where a record does not say how.

    Args:
        at: The record, as `placed` has it.
        hand: The hand, with the servos that squeeze.
        contacts: Contacts in the grasp.
        levers: Levers of the contacts side by side, (j, 3k) [m].
        proof: Proof about the contacts, with forces where they are in force closure.
        push_n: Largest normal force [N].
    """
    joints, grasp = at.joints.copy(), at.joints[1]
    if np.isnan(joints[0]).any():
        joints[0] = opened(contacts, levers, grasp, hand.ranges)
    if np.isnan(joints[2]).any():
        forces = pushes([each.contact for each in contacts], proof, push_n)
        motors = hand.motors(levers, grasp, UNLIMITED_N_M)
        torques = motors.torques(forces)[: len(hand.servos.names)]
        joints[2] = hand.servos.squeezing(grasp, torques)
    return replace(at, joints=joints)


def opened(contacts: Sequence[LinkContact], levers: Array, grasp: Array, ranges: Array) -> Array:
    """Return joint angles at which contacts have opened by `OPENED_M`: (1)."""
    normals = np.array([each.contact.normal for each in contacts]).reshape(-1, 3)
    gaps = np.array([OPENED_M + max(0.0, -each.distance_m) for each in contacts])
    rows = np.einsum("jki,ki->kj", levers.reshape(len(grasp), -1, 3), normals)
    turns = np.asarray(np.linalg.lstsq(rows, -gaps, rcond=LEAST_SHARE)[0], dtype=np.float64)
    return np.clip(grasp + turns, np.minimum(ranges[:, 0], grasp), np.maximum(ranges[:, 1], grasp))


def pushes(contacts: Sequence[Contact], proof: ClosureCertificate | None, push_n: float) -> Array:
    """Return contact forces on the object whose largest normal part is a push, (k, 3) [N]."""
    normals = np.array([each.normal for each in contacts]).reshape(-1, 3)
    forces = normals if proof is None or proof.forces is None else proof.forces
    largest = float(np.einsum("ki,ki->k", forces, normals).max(initial=0.0))
    return forces * (push_n / largest) if largest > 0.0 else np.zeros_like(normals)
