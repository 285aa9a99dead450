"""Computes figures of contacts that tables have on request: closure, payload, approach, margins.

Each figure is a cell of a grasp's row, or null where it does not exist for the contacts: fewer than
four have no span angle, contacts that are not in force closure no payload.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from grasp_core.closure.contacts import stacked
from grasp_core.cones.spanning import span_angle
from grasp_core.errors import GraspError
from grasp_core.execution.best_squeeze import best_squeeze
from grasp_core.execution.loads import any_direction
from grasp_core.execution.payload import payload
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.objects.symmetries import copies_of, orbit_sizes
from grasp_core.planning.reach import Finger, reach
from grasp_core.quality.metrics import hull_volume, min_weight, smallest_singular_value
from grasp_core.values import FINGERS, Contact, Grasp
from scenes.fingertips import fitting_radius
from sim_validate.datasets.execution_rows import for_fingers
from sim_validate.datasets.learning.hand_poses import hand_cells, hand_named
from sim_validate.datasets.learning.settings import Learning
from sim_validate.execution.execute import tip_radius
from sim_validate.execution.settings import AskedExecution

USUAL_PUSH_N = 10.0
"""Largest push of a finger where the dataset has no executions, which state their own [N]."""
Cells = Mapping[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class Figures:
    """Which figures are asked for, and how strong fingers are."""

    asked: Learning
    execution: AskedExecution | None
    seed: int = 0
    """Seed of the postures from which a hand looks for its pose."""

    def of_contacts(self, body: Polyhedron, contacts: Sequence[Contact], friction: float) -> Cells:
        """Return the figures that any contacts have, closed or not."""
        if "closure" not in self.asked.figures:
            return {}
        points, normals = stacked(contacts)
        center, scale = body.center_of_mass, body.radius
        cells: dict[str, Any] = {}
        if len(contacts) == FINGERS:
            cells["span_angle_rad"] = span_angle(normals)
        ways = {
            "min_weight": lambda: min_weight(points, normals, friction),
            "hull_volume_n6": lambda: hull_volume(
                points, normals, friction, center=center, torque_scale=scale
            ),
            "smallest_singular_value": lambda: smallest_singular_value(
                points, center=center, torque_scale=scale
            ),
        }
        for name, way in ways.items():
            try:
                value = way()
            except GraspError:  # too few contacts span too little
                value = None
            cells[name] = value if value is not None and math.isfinite(value) else None
        return cells

    def of_grasp(self, body: Polyhedron, grasp: Grasp, friction: float) -> Cells:
        """Return the figures that only grasps in force closure have."""
        asked, cells = self.asked.figures, dict[str, Any]()
        push_n = USUAL_PUSH_N if self.execution is None else self.execution.settings.push_n
        if "closure" in asked:
            cells["witness_forces_n"] = grasp.witness.forces.tolist()
        if "payload" in asked:
            cells |= _payload(body, grasp, friction, push_n)
        if "approach" in asked:
            cells |= approach_cells(body, grasp)
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


def _payload(body: Polyhedron, grasp: Grasp, friction: float, push_n: float) -> Cells:
    try:
        radius = fitting_radius(body, grasp.positions, grasp.normals)
        found = payload(body, grasp, friction, max_push_n=push_n, tip_radius_m=radius)
    except GraspError:
        return {}
    return {"payload_fixed_kg": found.mass_kg, "payload_free_kg": found.bound_kg}


def approach_cells(body: Polyhedron, grasp: Grasp) -> Cells:
    """Return free lines of the fingers, as long as the object's radius; null if none is found."""
    radius = fitting_radius(body, grasp.positions, grasp.normals)
    finger = Finger(radius, body.radius)
    found = reach(body, grasp.faces, grasp.positions, grasp.normals, finger).directions
    ways = None if found is None else (-found).tolist()
    return {"approach_radius_m": radius, "approach_directions": ways}


def symmetry_cells(
    body: Polyhedron, grasps: Sequence[Grasp], names: Sequence[str]
) -> Iterator[Cells]:
    """Yield each grasp's class and multiplicity, in the order of the grasps."""
    firsts = np.empty(len(grasps), dtype=object)
    for copies in copies_of(body, grasps):
        firsts[list(copies.places)] = names[copies.first]
    for first, size in zip(firsts, orbit_sizes(body, grasps), strict=True):
        yield {"symmetry_class": first, "multiplicity": size}
