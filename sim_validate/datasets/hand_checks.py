"""Checks what a row says of the dataset's hand, by what is proved of its cells again.

A pose is not searched for again: it counts if joints are within their ranges and obey those that
they follow, fingertips touch the object at the stated contacts, the hand overlaps neither the
object nor itself, and the contacts are proved to be in force closure at the row's friction. From
pose and contacts follow the levers of the motors. So the mass that these hold in any orientation is
found again, and with the squeeze the share of their torques and the multiple of the weight that it
carries. What a trial did is only simulated again in a sample.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.closure_certificate import ClosureCertificate
from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import GraspError
from grasp_core.execution.carried_mass import MASS_GAP
from grasp_core.execution.loads import any_direction
from grasp_core.execution.squeeze_certificate import survives
from grasp_core.frames import POSE_SIZE
from grasp_core.hands.collisions import clearances, tip_distances
from grasp_core.hands.hand import Hand
from grasp_core.hands.reach import OBEYED, HandReach
from grasp_core.objects.on_faces import SolidSurface
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import FINGERS
from sim_validate.datasets.columns import ROUNDOFF, VARIED, GraspRow
from sim_validate.datasets.config import DatasetHand
from sim_validate.datasets.hand_columns import HandCells, motor_share
from sim_validate.datasets.layout import CONFIG
from sim_validate.datasets.row_faults import disagreements
from sim_validate.hands.execute import HandHolder
from sim_validate.hands.reached_grasps import carried, execution_with

TOUCHES_M = 2e-5
"""Largest distance of a fingertip from its contact [m]: twice what the search allows."""
APART_M = 4e-4
"""Least distance of the hand's links from each other [m]; the search keeps 0.5 mm."""
POSE_ROUNDING = 1e-9
"""How far rounding may move an angle beyond its range [rad], a link into the object [m], a pose
from a rigid motion, or a direction from unit length."""


@dataclass(frozen=True)
class HandChecks:
    """Checks of what one row says of the hand, whose object is there."""

    hand: Hand
    asked: DatasetHand
    row: GraspRow
    body: Polyhedron

    @property
    def cells(self) -> HandCells:
        """What the row says of the hand; nothing where there is no row for it."""
        return self.row.hand or HandCells()

    def faults(self) -> Iterator[str]:
        """Yield sentences on what is wrong with the cells about the hand."""
        row, cells = self.row, self.cells
        if bool(row.force_closed) != (cells.reached is not None):
            yield f"hand_reached is {cells.reached}, but force_closed is {row.force_closed}"
        if not cells.reached:
            return
        yield from self._missing()
        fingers = [finger for finger in cells.fingers or () if finger is not None]
        there = len(self.hand.fingers)
        standing = {*fingers} & {*range(there)}
        if not len(fingers) == len(standing) == min(there, FINGERS):
            yield f"hand_fingers are {fingers}, not {min(there, FINGERS)} of the hand's {there}"
            return
        faults = list(self._pose_faults(fingers))
        yield from faults
        if not faults:
            yield from self._strength_faults()

    def _missing(self) -> Iterator[str]:
        """Yield what was asked for in simulation, and is missing without a reason."""
        cells, own = self.cells, self.row.label != VARIED
        executes = self.asked.mass_kg is not None or self.asked.density_kg_m3 is not None
        for name, asked in (("held", self.asked.simulate), ("executed", executes)):
            there = getattr(cells, name) is not None
            if there and not (own and asked):
                yield f"hand_{name} is there, but {CONFIG} does not ask for it"
            elif own and asked and not there and not cells.note:
                yield f"hand_{name} is missing, and hand_note has no reason"
        if (cells.controls_let_go or 0) > (cells.controls or 0):
            yield f"hand_controls_let_go is {cells.controls_let_go} of {cells.controls}"

    def _pose_faults(self, fingers: list[int]) -> Iterator[str]:
        cells, hand = self.cells, self.hand
        joints, pose = cells.joints, cells.palm_pose
        if joints is None or pose is None:
            return
        points = np.array([contact.position for contact in cells.placed])
        normals = np.array([contact.normal for contact in cells.placed])
        surface = SolidSurface(self.body.vertices, self.body.triangles)
        roundings = np.array([hand.fingers[finger].tip.core[1] for finger in fingers])
        behind = points - roundings[:, None] * normals  # within tips, as deep as they are rounded
        gaps = tip_distances(hand, joints, pose, fingers, behind) + roundings
        found, turn = clearances(hand, self.body, joints, pose, np.array(fingers)), pose[:3, :3]
        opened = joints if cells.open_joints is None else cells.open_joints
        rules = {
            "hand_joints_rad are not within the ranges of the joints": self._in_ranges(joints),
            "hand_open_joints_rad are not within the ranges of the joints": self._in_ranges(opened),
            "hand_joints_rad do not follow the joints that they are coupled with": (
                self._obey(joints)
            ),
            "hand_open_joints_rad do not follow the joints that they are coupled with": (
                self._obey(opened)
            ),
            "T_object_palm_m is not a rigid motion": (
                np.abs(turn @ turn.T - np.eye(3)).max() <= POSE_ROUNDING
                and np.linalg.det(turn) > 0.0
                and pose[3].tolist() == np.eye(POSE_SIZE)[3].tolist()
            ),
            "hand_points_m are not on the object, or hand_normals not its normals there": all(
                surface.holds(point, normal, TOUCHES_M)
                for point, normal in zip(points, normals, strict=True)
            ),
            "the fingertips of hand_joints_rad do not touch the object at hand_points_m": (
                gaps.max() <= TOUCHES_M
            ),
            # a link whose tip touches the object may come as near to it as it likes
            "the hand of hand_joints_rad overlaps the object or itself": (
                found.itself >= APART_M
                and found.object >= -POSE_ROUNDING
                and found.tips >= -TOUCHES_M
            ),
            "hand_points_m are not proved to be in force closure": self._certificate is not None,
        }
        yield from (fault for fault, fits in rules.items() if not fits)

    def _in_ranges(self, angles: Array) -> bool:
        low, high = self.hand.ranges.T
        return bool(((angles >= low - POSE_ROUNDING) & (angles <= high + POSE_ROUNDING)).all())

    def _obey(self, angles: Array) -> bool:
        obeyed = self.hand.drives.obeyed(angles[None])[0]
        return not self.hand.couplings or bool(np.abs(obeyed - angles).max() <= OBEYED)

    @cached_property
    def _certificate(self) -> ClosureCertificate | None:
        """Proof that the contacts are in force closure; None where there is none."""
        try:
            found = force_closure(self.cells.placed, friction=self.row.friction)
            return found if found.closed and found.verify() else None
        except GraspError:
            return None

    def _strength_faults(self) -> Iterator[str]:
        """Yield what motors do not carry of what the row says, in a pose that is checked."""
        cells, used = self.cells, self.cells.used
        fingers = np.array([finger for finger in cells.fingers or () if finger is not None])
        reach = HandReach(
            self.hand.name, self.row.name, "", "", 1, 0.0, fingers, cells.joints, cells.palm_pose,
            self._certificate, used=np.array(used),
        )  # fmt: skip
        yield from self._payload_faults(reach)
        if cells.squeeze_n is None:
            return
        try:
            share = motor_share(self.hand, reach, cells.squeeze_n[used])
        except GraspError as error:
            yield f"the motors of the hand cannot be loaded as the row says ({error})"
            return
        yield from disagreements(cells, {"motor_share": share}, "hand_squeeze_n")
        yield from self._load_faults(reach, cells.squeeze_n[used])

    def _payload_faults(self, reach: HandReach) -> Iterator[str]:
        stated = self.cells.payload_kg
        found = carried(self.hand, self.body, reach, self.row.friction)
        if stated is None or found is None:
            if stated is not None or found is not None:
                known = None if found is None else found.lower_kg
                yield f"hand_payload_kg is {stated}, but {known} by the motors"
            return
        least = found.lower_kg * (1.0 - MASS_GAP - ROUNDOFF)
        if not least <= stated <= found.upper_kg * (1.0 + ROUNDOFF):
            yield (
                f"hand_payload_kg is {stated:.9g}, but from {found.lower_kg:.9g} to "
                f"{found.upper_kg:.9g} by the motors"
            )

    def _load_faults(self, reach: HandReach, squeeze: Array) -> Iterator[str]:
        cells, settings = self.cells, execution_with(self.asked, self.body)
        if settings is None or cells.load_multiple is None:
            yield f"hand_load_multiple is missing, or {CONFIG} does not ask for it"
            return
        yield from disagreements(cells, {"mass_kg": settings.object_kg}, CONFIG)
        try:
            holder = HandHolder(self.body, self.hand, reach, self.row.friction)
            loose, motors = holder.loose(settings)
            held = loose.squeezed(squeeze)
            carries = survives(
                held, any_direction(settings.object_kg),
                cells.load_multiple * (1.0 - ROUNDOFF), settings.push_n, motors,
            )  # fmt: skip
        except GraspError as error:
            yield f"the hand cannot squeeze the object as the row says ({error})"
            return
        if not carries:
            yield (
                f"hand_load_multiple is {cells.load_multiple:.9g}, but the squeeze is not proved "
                "to carry as much"
            )
