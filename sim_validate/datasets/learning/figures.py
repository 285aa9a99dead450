"""Computes figures of contacts that tables have on request: closure, margins, poses of a hand.

Each figure is a cell of a grasp's row, or null where it does not exist for the contacts: fewer than
four have no span angle, contacts that are not in force closure no witness forces.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from grasp_core.closure.contact_arrays import stacked
from grasp_core.cones.spanning import span_angle
from grasp_core.errors import GraspError
from grasp_core.execution.best_squeeze import best_squeeze
from grasp_core.execution.loads import any_direction
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.metrics import smallest_singular_value
from grasp_core.values import FINGERS, Contact, Grasp
from sim_validate.datasets.execution_rows import finite, for_fingers
from sim_validate.datasets.learning.hand_poses import hand_cells, hand_named
from sim_validate.datasets.learning.settings import Learning
from sim_validate.execution.asked import AskedExecution
from sim_validate.execution.execute import tip_radius

Cells = Mapping[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class Figures:
    """Which figures are asked for, and how strong fingers are."""

    asked: Learning
    execution: AskedExecution | None
    seed: int = 0
    """Seed of the postures from which a hand looks for its pose."""

    def of_contacts(self, body: Polyhedron, contacts: Sequence[Contact]) -> Cells:
        """Return the figures that any contacts have, closed or not."""
        if "closure" not in self.asked.figures:
            return {}
        points, normals = stacked(contacts)
        cells: dict[str, Any] = {}
        if len(contacts) == FINGERS:
            cells["span_angle_rad"] = span_angle(normals)
        try:
            least = smallest_singular_value(
                points, center=body.center_of_mass, torque_scale=body.radius
            )
        except GraspError:  # too few contacts span too little
            least = math.inf
        cells["smallest_singular_value"] = finite(least)
        return cells

    def of_grasp(self, body: Polyhedron, grasp: Grasp, friction: float) -> Cells:
        """Return the figures that only grasps in force closure have."""
        cells = dict[str, Any]()
        if "closure" in self.asked.figures:
            cells["witness_forces_n"] = grasp.witness.forces.tolist()
        if self.asked.hand:
            cells |= hand_cells(hand_named(self.asked.hand), body, grasp, friction, self.seed)
        return cells

    def of_executed(
        self, body: Polyhedron, contacts: Sequence[Contact], friction: float, mass_kg: float
    ) -> Cells:
        """Return the figures that only executed contacts have."""
        if self.execution is None:
            return {}
        settings = self.execution.settings_for(body)
        cells: dict[str, Any] = {"tip_radius_m": tip_radius(body, contacts, settings)}
        if "least_squeeze" not in self.asked.figures:
            return cells
        try:
            least = best_squeeze(
                body, contacts, friction, any_direction(mass_kg),
                stiffness=settings.stiffness_n_per_m, tip_radius_m=cells["tip_radius_m"],
            )  # fmt: skip
        except GraspError:  # no push carries the weight in every direction, or it is unstable
            return cells
        squeeze = for_fingers(least.grip.squeeze.tolist(), [None] * 3)
        return {**cells, "least_push_n": least.max_push_n, "least_squeeze_n": squeeze}
