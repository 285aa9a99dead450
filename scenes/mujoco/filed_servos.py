"""Finds what turns the joints of a hand as its file has it: servos of joints, and of tendons.

A joint that no rule holds has one servo: that of the file, where it has one that goes to a
position, otherwise a servo of a stated stiffness. Joints that follow each other have one servo
together, at the first that has a motor in the file, or else at the one that the others follow.
Where a motor pulls a tendon that is a sum of joint angles, and none of these has a motor of its
own, the tendon has the servo in their place. Tendons beside motors of joints are left out.
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core.

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from scenes.hand_files.fingers import joint_name
from scenes.hand_files.model import HandModel, Tendon
from scenes.silent_mujoco import mujoco

SETTLES_S = 0.02
"""Damping over stiffness of a servo where neither it nor its joint states one [s]: that of the
hands of DexGraspBench."""
SLIDE_LEVER_M = 0.05
"""Lever with which a stiffness, a damping or an inertia that is stated for hinges is one of slides
[m]: what fingertips so far from their hinges have."""


@dataclass(frozen=True, slots=True, eq=False)
class FiledServos:
    """The u motors of a hand with j joints: servos that go to an angle, with their limits.

    A motor turns a joint, or pulls a tendon whose length is a sum of angles. Slides have metres and
    newtons in place of radians and newton metres.
    """

    names: tuple[str, ...]
    """Names of the joints or tendons."""
    pulls: Array
    """How far each motor goes per turn of each joint, (u, j)."""
    stiffness: Array
    """Stiffness of each servo, (u,) [N m/rad]."""
    damping: Array
    """Damping of each servo, without that of its joint, (u,) [N m s/rad]."""
    limits: Array
    """Largest torques, infinite for none, (u,) [N m]."""
    spans: Array
    """Least and largest angles that are told, infinite for none, (u, 2) [rad]."""
    of_hinges: Array
    """What is stated for hinges times this is that of a motor: 1 for hinges, (u,)."""

    def damped(self, inertia_kg_m2: float) -> "FiledServos":
        """Return servos that do not overshoot with an inertia at each hinge."""
        least = 2.0 * np.sqrt(self.stiffness * self.of_hinges * inertia_kg_m2)
        return replace(self, damping=np.maximum(self.damping, least))

    def alike(self, stiffness: float, damping: float) -> "FiledServos":
        """Return servos of one stiffness of hinges, with no limits but those of the motors."""
        return replace(
            self, stiffness=stiffness * self.of_hinges, damping=damping * self.of_hinges,
            spans=np.full_like(self.spans, np.inf) * (-1.0, 1.0),
        )  # fmt: skip

    def squeezing(self, joints: Array, torques: Array) -> Array:
        """Return angles (j,) that motors are told, to exert torques (u,) at angles (j,) [rad]."""
        told = self.pulls @ joints
        turns = np.clip(told + torques / self.stiffness, *self.spans.T) - told
        return joints + np.linalg.pinv(self.pulls) @ turns


def filed_servos(
    model: HandModel, joints: Sequence[int], stiffness_n_m_per_rad: float, *, own_servos: bool
) -> FiledServos:
    """Find the servos of joints by their numbers, of their own or of a stated stiffness."""
    raw, count = model.raw, len(joints)
    of_joints = raw.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
    driven = {*raw.actuator_trnid[of_joints, 0].tolist()}
    pulled = {tendon.motors[0]: tendon for tendon in pulled_tendons(model, joints, driven)}
    held = {joint for tendon in pulled.values() for joint in tendon.joints}
    places = [joints.index(joint) for joint in _driven(model, joints, driven) if joint not in held]
    pulls = [np.eye(count)[place] for place in places]
    for tendon in pulled.values():
        pulls.append(np.zeros(count))
        pulls[-1][[joints.index(joint) for joint in tendon.joints]] = tendon.factors
    slides = np.array([model.joint_kinds[joint] == "slide" for joint in joints])
    sliding = [bool(slides[np.flatnonzero(row)].all()) for row in pulls]
    of_hinges = np.where(sliding, SLIDE_LEVER_M**-2, 1.0)
    own = raw.dof_damping[raw.jnt_dofadr[list(joints)]].reshape(count, -1)[:, 0]
    damped = [float(own[np.flatnonzero(row)].min()) for row in pulls]
    limits = [float(model.torques[joints[place]]) for place in places]
    limits += [_force_limit(model, motor) for motor in pulled]
    found = FiledServos(
        tuple(joint_name(model, joints[place]) for place in places)
        + tuple(tendon.name for tendon in pulled.values()),
        np.array(pulls), stiffness_n_m_per_rad * of_hinges, np.zeros(len(pulls)),
        np.where(np.isnan(limits), np.inf, limits), np.tile([-np.inf, np.inf], (len(pulls), 1)),
        of_hinges,
    )  # fmt: skip
    for i in range(raw.nu if own_servos else 0):
        gain, bias = raw.actuator_gainprm[i], raw.actuator_biasprm[i]
        affine = raw.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_AFFINE
        goes_to_angle = affine and gain[0] > 0.0 and bias[0] == 0.0 and bias[1] == -gain[0]
        gear, joint = raw.actuator_gear[i, 0], int(raw.actuator_trnid[i, 0])
        if i in pulled:
            place = len(places) + list(pulled).index(i)
        elif of_joints[i] and joint in joints and joints.index(joint) in places:
            place = places.index(joints.index(joint))
        else:
            continue
        if goes_to_angle and gear != 0.0:  # force and length are both times the gear
            found.stiffness[place] = gear**2 * gain[0]
            found.damping[place] = -(gear**2) * bias[2]
            if raw.actuator_ctrllimited[i]:
                found.spans[place] = np.sort(raw.actuator_ctrlrange[i] / gear)
    none = found.damping + damped <= 0.0
    return replace(found, damping=np.where(none, SETTLES_S * found.stiffness, found.damping))


def pulled_tendons(model: HandModel, joints: Sequence[int], driven: set[int]) -> Iterator[Tendon]:
    """Yield the tendons that motors pull in place of joints' own motors, one for each joint."""
    taken, ruled = set(driven), {rule.joint for rule in model.joint_rules}
    for tendon in model.tendons:
        own = {*tendon.joints}
        if len(tendon.motors) == 1 and own and own <= {*joints} and not own & (taken | ruled):
            taken |= own
            yield tendon


def _driven(model: HandModel, joints: Sequence[int], driven: set[int]) -> list[int]:
    """Return of joints that follow each other the one with the servo, in order with all others."""
    leaders = {rule.joint: rule.leader for rule in model.joint_rules
               if rule.joint in joints and rule.leader in (*joints, -1)}  # fmt: skip
    groups = dict[int, list[int]]()
    for joint in joints:
        root, passed = joint, {joint}
        while root in leaders and leaders[root] not in passed:
            root = leaders[root]
            passed.add(root)
        groups.setdefault(root, []).append(joint)
    found = list[int]()
    for root, own in groups.items():
        if root >= 0:  # what is held at an angle needs no motor
            found.append(next((joint for joint in own if joint in driven), root))
    return sorted(found)


def _force_limit(model: HandModel, motor: int) -> float:
    """Return the largest force of a motor on what it pulls; NaN where none is stated."""
    raw = model.raw
    if not raw.actuator_forcelimited[motor]:
        return np.nan
    gear = abs(float(raw.actuator_gear[motor, 0]))
    return gear * float(np.abs(raw.actuator_forcerange[motor]).max())
