"""Declares the columns about the hand of a dataset: where it stands in a grasp, and what it does.

Cells about contacts have a place for each of the grasp's four, as the grasp's own have. A hand with
three fingers stands at three of them; the place of the fourth is null.
"""

from typing import Annotated, Any, TypeAlias

import numpy as np
from pydantic import Field

from grasp_core.allowed_values import Number
from grasp_core.arrays import Array, Shape, UnitVector
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.frames import POSE_SIZE
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import HandReach
from grasp_core.values import FINGERS, Contact
from scenes.mujoco.hand_scenes import strong_motors
from sim_validate.datasets.config import HAND
from sim_validate.datasets.parquet import Known, RowCells, Within
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.hands.execute import can_execute
from sim_validate.hands.reaches import ReachedGrasp
from sim_validate.hands.verdict import HandVerdict

HAND_ROUNDING = 1e-6
"""Share of a number about a hand that processors may round differently."""
Joints: TypeAlias = Annotated[Array, Shape(HAND)]
AtContacts: TypeAlias = Annotated[Array, Shape(FINGERS, 3, nan=True)]
FingerOf: TypeAlias = tuple[int | None, int | None, int | None, int | None]


@declared
class HandCells(Declared):
    """A pose of the hand in a grasp, or why there is none, and what the hand did in it."""

    reached: Annotated[bool | None, Field(alias="hand_reached")] = None
    """Whether a pose of the hand was found; null if not closed."""
    reason: Annotated[str | None, Field(alias="hand_reason")] = None
    """Why no pose was found, in a word; empty where one was."""
    explanation: Annotated[str | None, Field(alias="hand_explanation")] = None
    """Why no pose was found, as a sentence; empty where one was."""
    fingers: Annotated[FingerOf | None, Field(alias="hand_fingers")] = None
    """Number of the hand's finger at each contact; null at one that is not used."""
    joints: Annotated[Joints | None, Field(alias="hand_joints_rad")] = None
    """Joint angles, finger by finger from the palm."""
    palm_pose: Annotated[
        Annotated[Array, Shape(POSE_SIZE, POSE_SIZE)] | None, Field(alias="T_object_palm_m")
    ] = None
    """Pose of the palm in the object's frame."""
    points: Annotated[AtContacts | None, Field(alias="hand_points_m")] = None
    """Contacts of the fingertips."""
    normals: Annotated[AtContacts | None, Field(alias="hand_normals")] = None
    """Inward unit normals at these."""
    open_joints: Annotated[Joints | None, Field(alias="hand_open_joints_rad")] = None
    """Joint angles with open fingers; null if none found."""
    approach: Annotated[UnitVector | None, Field(alias="hand_approach")] = None
    """Direction of the palm's straight way in; null if none."""
    payload_kg: Annotated[Known, Field(alias="hand_payload_kg")] = None
    """Largest mass that the motors are proved to hold in any orientation, links included, with
    forces chosen anew for each; null where motors or links are unknown, or too weak."""

    held: Annotated[bool | None, Field(alias="hand_held")] = None
    """Whether the hand held all test wrenches in simulation; null where it was not tried."""
    weakest_n: Annotated[Known, Field(alias="hand_weakest_n")] = None
    """Size of the weakest of these wrenches, at its predicted limit, torques over radius."""
    controls: Annotated[Number | None, Field(alias="hand_controls")] = None
    """Number of the hand's negative controls."""
    controls_let_go: Annotated[Number | None, Field(alias="hand_controls_let_go")] = None
    """Number of those that let the object go, as they must."""
    mismatches: Annotated[Number | None, Field(alias="hand_mismatches")] = None
    """Number of contradictions between simulation and analysis of the hand."""

    executed: Annotated[bool | None, Field(alias="hand_executed")] = None
    """Whether the hand executed the grasp in simulation; null where it was not asked to."""
    survived: Annotated[bool | None, Field(alias="hand_survived")] = None
    """Whether the object survived every trial with the hand; false also where no squeeze within its
    torques carries the weight; null where it is not known."""
    mass_kg: Annotated[Known, Field(alias="hand_mass_kg"), Within(HAND_ROUNDING)] = None
    """Mass of the object in the execution with the hand."""
    squeeze_n: Annotated[AtContacts | None, Field(alias="hand_squeeze_n")] = None
    """Contact forces of the fingertips on the object at rest."""
    motor_share: Annotated[
        Known, Field(alias="hand_motor_share"), Within(HAND_ROUNDING, HAND_ROUNDING)
    ] = None
    """Largest torque of a joint at rest, over what its motor has left when it carries its links in
    any orientation."""
    load_multiple: Annotated[Known, Field(alias="hand_load_multiple")] = None
    """Multiple of the weight, in any direction, that this squeeze is proved to carry within the
    torques of the motors."""
    predicted_loss: Annotated[Known, Field(alias="hand_predicted_loss")] = None
    """Least multiple of a trial's load at which the hand loses the object, predicted."""
    displacement_m: Annotated[Known, Field(alias="hand_displacement_m")] = None
    """Largest displacement of the centre of mass against the palm in any trial."""
    execution_mismatches: Annotated[Number | None, Field(alias="hand_execution_mismatches")] = None
    """Number of the execution's negative controls that did not slip, but must."""
    note: Annotated[str | None, Field(alias="hand_note")] = None
    """Why the hand did not do in simulation what it was asked to, or which trials were not
    possible; empty where nothing is missing."""

    def _check_together(self) -> None:
        if self.reached is not None and self.reached == bool(self.reason):
            raise InputError(f"hand_reason is {self.reason!r}, but hand_reached is {self.reached}")
        pose = (self.joints, self.palm_pose, self.fingers, self.points, self.normals)
        if {each is not None for each in pose} != {bool(self.reached)}:
            raise InputError("the pose of a hand must be there exactly where hand_reached is true")
        for name, array in (("points_m", self.points), ("normals", self.normals)):
            if array is not None and (np.isfinite(array).all(axis=1) != self._used_places).any():
                raise InputError(
                    f"hand_{name} must be there exactly for the contacts with a finger, "
                    f"{self.used} of hand_fingers"
                )
        if bool(self.executed) != (self.squeeze_n is not None):
            raise InputError("hand_squeeze_n must be there exactly where hand_executed is true")

    @classmethod
    def of(cls, hand: Hand, found: ReachedGrasp, note: str = "") -> "HandCells":
        """Return the cells of what was found of a hand in a grasp."""
        reach, held, executed = found.reach, found.simulated, found.executed
        cells: dict[str, Any] = {
            "reached": reach.reached, "reason": reach.reason, "explanation": reach.explanation,
            "joints": reach.joints, "palm_pose": reach.palm_pose, "open_joints": reach.pregrasp,
            "approach": reach.approach, "payload_kg": found.payload_kg, "note": note,
        }  # fmt: skip
        cells |= _standing(reach)
        cells |= {} if held is None else _trial_cells(held)
        cells |= {} if executed is None else _execution_cells(hand, reach, executed)
        return cls(**cells)

    @property
    def _used_places(self) -> Array:
        return np.array([finger is not None for finger in self.fingers or (None,) * FINGERS])

    @property
    def used(self) -> list[int]:
        """Numbers of the grasp's contacts at which fingers stand."""
        return [place for place, finger in enumerate(self.fingers or ()) if finger is not None]

    @property
    def placed(self) -> tuple[Contact, ...]:
        """The contacts at which fingers stand."""
        if self.points is None or self.normals is None:
            return ()
        return tuple(map(Contact, self.points[self.used], self.normals[self.used]))


def _standing(reach: HandReach) -> RowCells:
    """Return the cells about the contacts of a pose; none where there is no pose."""
    if reach.contacts is None or reach.fingers is None or reach.used is None:
        return {}
    fingers: list[int | None] = [None] * FINGERS
    for place, finger in zip(reach.used.tolist(), reach.fingers.tolist(), strict=True):
        fingers[place] = finger
    return {
        "fingers": tuple(fingers),
        "points": _at_contacts(reach, [contact.position for contact in reach.contacts]),
        "normals": _at_contacts(reach, [contact.normal for contact in reach.contacts]),
    }


def _at_contacts(reach: HandReach, vectors: Array | list[Array]) -> Array:
    """Put vectors of the contacts that are used in their places, (4, 3), NaN elsewhere."""
    found = np.full((FINGERS, 3), np.nan)
    found[reach.used] = vectors
    return found


def _trial_cells(held: HandVerdict) -> RowCells:
    return {
        "held": held.held,
        "weakest_n": held.weakest_n,
        "controls": len(held.controls),
        "controls_let_go": sum(control.let_go for control in held.controls),
        "mismatches": len(held.mismatches),
    }


def _execution_cells(hand: Hand, reach: HandReach, executed: ExecutedGrasp) -> RowCells:
    found = executed.execution
    if found is None:
        lost = {"survived": False} if can_execute(hand, reach) else {}
        return {"executed": False, **lost, "note": executed.reason}
    return {
        "executed": True,
        "survived": executed.survived if found.trials else None,
        "mass_kg": found.mass_kg,
        "squeeze_n": _at_contacts(reach, found.squeeze),
        "motor_share": motor_share(hand, reach, found.squeeze),
        "load_multiple": found.load_multiple,
        "predicted_loss": found.least_predicted_loss if found.trials else None,
        "displacement_m": found.displacement_m,
        "execution_mismatches": len(found.controls_held),
        "note": "; ".join(f"{each.kind}: {each.reason}" for each in found.skipped),
    }


def motor_share(hand: Hand, reach: HandReach, squeeze: Array) -> float:
    """Return the largest torque of a joint under contact forces (k, 3), over its motor's limit.

    Limits are those that are left when motors carry their links in any orientation.
    """
    motors = strong_motors(hand, reach)
    return float((np.abs(motors.torques(squeeze)) / motors.limits).max())
