"""Where a hand stands in the grasps of an object, and what it did there: `reaches.json`.

The file holds the hand's parts and every proof, so that whoever has it can draw the hand and check
the poses without anything else. Fingertips must touch at the contacts of the file, or it is about
another hand and is refused.
"""

from collections.abc import Mapping
from typing import Annotated

import numpy as np
from pydantic import computed_field

from grasp_core.allowed_values import FLAT, NotNegative
from grasp_core.arrays import UnitVector
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError
from grasp_core.figures import Shown
from grasp_core.files.file_kinds import REACHES
from grasp_core.hands.collisions import tip_distances
from grasp_core.hands.hand import Hand
from grasp_core.hands.obstacles import REASONS
from grasp_core.hands.reach import HandReach
from grasp_core.hands.settings import ReachSettings
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.files.result_files import AboutGrasps
from sim_validate.hands.verdict import HandVerdict
from sim_validate.settings import ExecutionSettings

TOUCHING_M = 1e-4
"""How far a fingertip of a file may be from its contact [m]: ten times what reaching allows."""


@declared
class CarriedMass(Declared):
    """The largest mass that a hand holds in any orientation, its links included.

    The proofs are left out: `hand_payload` finds them again.
    """

    lower_kg: NotNegative
    """Mass that is held in every orientation, with forces chosen anew for each [kg]."""
    upper_kg: NotNegative
    """Mass above which some orientation is not held [kg]."""
    weakest_gravity: UnitVector
    """Direction of gravity in which the hand lets go first, in the object's frame."""


@declared
class ReachedGrasp(Declared):
    """What was found of a hand in one grasp."""

    reach: Annotated[HandReach, FLAT]
    contacts_sha256: str
    """Hash of the planned contacts."""
    payload: CarriedMass | None = None
    """What the hand carries; None where motors or links are unknown, or too weak."""
    simulated: HandVerdict | None = None
    """What the hand held with its motors; None where no simulation was asked for."""
    executed: ExecutedGrasp | None = None
    """What came of executing the grasp with the hand; None where it was not asked for."""
    too_weak: str = ""
    """Why the motors carry the hand's links or the object not where the hand stands, though strong
    ones would; empty where they do, where limits or masses are unknown, or where there is no pose.
    """

    @property
    def id(self) -> str:
        """Id of the grasp."""
        return self.reach.grasp

    @computed_field
    @property
    def payload_kg(self) -> Annotated[float | None, Shown("payload kg", ".3g")]:
        """Largest mass that the motors hold whichever way the hand is turned, links included."""
        return None if self.payload is None else self.payload.lower_kg

    @property
    def good(self) -> bool:
        """Whether the hand stands in the grasp, and passed all trials that were asked for."""
        executed = self.executed
        return (
            self.reach.reached
            and (self.simulated is None or self.simulated.good)
            and (executed is None or (executed.survived and executed.controls_let_go))
        )


@declared
class Reaches(AboutGrasps[ReachedGrasp]):
    """A hand in the grasps of an object, as `reaches.json` holds it."""

    ITEMS = "reaches"
    FILE = REACHES
    SCHEMA = 3

    hand: Hand
    asked: ReachSettings
    execution: ExecutionSettings | None
    """Settings with which grasps were executed; None where it was not asked for."""
    reaches: tuple[ReachedGrasp, ...]

    def _check_together(self) -> None:
        for place, each in enumerate(self.reaches):
            if fault := self._fault(each.reach):
                raise InputError(
                    f"reaches[{place}]: {fault}, so it is about another hand than {self.hand.name} "
                    "of this file; run `graspproof reach` again, or remove it"
                )

    def _fault(self, reach: HandReach) -> str:
        """Say why a pose cannot be one of the hand; empty if it can."""
        if reach.hand != self.hand.name:
            return f"the pose is one of {reach.hand}"
        known = len(self.hand.joints)
        for pose in (reach, reach.nearest):
            if pose is None or pose.joints is None or pose.fingers is None:
                continue
            if len(pose.joints) != known or pose.fingers.max(initial=0) >= len(self.hand.fingers):
                fingers = pose.fingers.tolist()
                return f"the pose has {len(pose.joints)} joints for {known}, and fingers {fingers}"
        if reach.joints is None or reach.palm_pose is None or reach.fingers is None:
            return ""
        fingers = reach.fingers.tolist()
        touched = np.array([contact.position for contact in reach.contacts or ()])
        off = np.abs(tip_distances(self.hand, reach.joints, reach.palm_pose, fingers, touched))
        if off.max(initial=0.0) > TOUCHING_M:
            return f"a fingertip is {1e3 * float(off.max()):.3g} mm off its contact"
        return ""

    @computed_field
    @property
    def summary(self) -> Mapping[str, int]:
        """Numbers of grasps: reached, reached with too weak motors, and by what stops the hand."""
        reasons = [each.reach.reason for each in self.reaches]
        weak = sum(bool(each.too_weak) for each in self.reaches)
        ended = {"grasps": len(reasons), "reached": reasons.count(""), "torque": weak}
        return ended | {each.replace(" ", "_"): reasons.count(each) for each in REASONS}

    def finger_names(self, reach: HandReach) -> tuple[str, ...]:
        """Name the finger at each contact; none for a grasp that is not reached."""
        used = () if reach.fingers is None else reach.fingers
        return tuple(self.hand.fingers[int(finger)].name for finger in used)
