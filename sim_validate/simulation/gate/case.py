"""The settings with which the simulator is checked on known cases, and results of the checks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import contact_frictions
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.wrench_limits import WrenchBody, axis_wrenches, limit_of
from grasp_core.values import Contact
from scenes.example_objects import example_object
from sim_validate.simulation.rig import Rig, squeezed
from sim_validate.simulation.schedules import Load
from sim_validate.simulation.setup import Setup
from sim_validate.simulation.simulate import Bench

LEAST_OFFSET, LARGEST_OFFSET = 0.01, 1.0
"""Least and largest critical friction that two offset fingers on the box can be made to need."""
PUSH = 0.6
"""Normal force of the fingers on the box, relative to the largest normal force allowed."""


@dataclass(frozen=True, slots=True)
class Check:
    """One figure measured in simulation, and the interval in which it must lie."""

    name: str
    value: float
    """The measured figure, or NaN if it could not be measured."""
    least: float
    largest: float

    @property
    def passed(self) -> bool:
        """Whether the measured figure lies in its interval."""
        return self.least <= self.value <= self.largest

    def __str__(self) -> str:
        state = "ok" if self.passed else "OUT OF TOLERANCE"
        return (
            f"{self.name}: {self.value:.6g} (from {self.least:.6g} to {self.largest:.6g}) {state}"
        )


@dataclass(frozen=True, slots=True)
class Case:
    """The settings, friction and object size with which the simulator is checked on known cases."""

    setup: Setup
    friction: float
    radius_m: float

    @property
    def offset_friction(self) -> float:
        """The friction under test, or the nearest one that offset fingers on a box can need."""
        return min(max(self.friction, LEAST_OFFSET), LARGEST_OFFSET)

    def body(self, name: str) -> Polyhedron:
        """Scale an example object to the size under test, with its centre of mass at the origin."""
        example = example_object(name)
        vertices = (example.vertices - example.center_of_mass) * self.radius_m / example.radius
        return Polyhedron.from_mesh(vertices, example.triangles, name=name)

    def squeezed(
        self, body: Polyhedron, contacts: Sequence[Contact], forces: Array, friction: float
    ) -> Rig:
        """Close fingers on a body with planned forces, for trials of full length."""
        bench = Bench(self.setup.scene(body, contacts, friction))
        return replace(squeezed(bench, self.setup, forces, friction), whole=True)


def tetrahedron(case: Case) -> tuple[Rig, list[Load]]:
    """Squeeze a tetrahedron at its face centres, and find its limit wrenches on twelve axes."""
    body, largest = case.body("tetrahedron"), case.setup.fingers.max_normal_force_n
    contacts = [Contact(face.centroid, face.normal) for face in body.faces]
    rig = case.squeezed(body, contacts, PUSH * largest * body.normals, case.friction)
    arms = np.array([contact.position for contact in contacts]) - body.center_of_mass
    frictions = contact_frictions(case.friction, len(contacts))
    resisted = WrenchBody(arms, body.normals, frictions, largest)
    found = [limit_of(resisted, wrench) for wrench in axis_wrenches(body.radius)]
    return rig, [Load(limit.limit * limit.wrench, limit.forces) for limit in found]
