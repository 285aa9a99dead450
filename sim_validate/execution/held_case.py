"""The masses, springs and size with which executions are checked on a box that four fingers hold.

The box is an example object with half-widths a, b and c. Two pairs of fingers push with N each on
the middles of opposite faces, across x and across y. The axis z stays free.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import contact_frictions
from grasp_core.execution.grips import grip
from grasp_core.execution.loads import GRAVITY_M_PER_S2
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact
from scenes.example_objects import example_object
from scenes.mujoco.held_mjcf import HeldScene, build_held_scene
from scenes.settings import UPRIGHT, HeldSettings, PhysicsSettings
from sim_validate.engine.known_cases import Check, near, sized
from sim_validate.execution.bench import HeldMotion
from sim_validate.execution.paths import samples, smoother

DOWN = np.array(UPRIGHT)
WEIGHT = GRAVITY_M_PER_S2 * DOWN
FINGERS = 4
TOLERANCE = 0.01
"""Largest relative error of what is known in closed form: as much as predictions are trusted to."""
SOFT = 0.1
"""Largest push in the cases, relative to stiffness times b: the geometric stiffness of the squeeze
then takes a tenth of the springs' stiffness against turning at most."""
LIGHT = 0.6
"""Part of the load of slip that is put on the box where it must not slip."""
SLOW = 30.0
"""Duration T of a slow rise, in reciprocal natural frequencies. Its third derivative is at most
60 / T^3, so the box rings by at most 60 / SLOW^3 of its deflection afterwards, 0.2 %."""
SETTLE_S = 0.02
"""Time after the squeeze in which it settles; it grows so slowly that little is left to settle."""
SHORTEST_S = 0.15
"""Least duration of a slow rise, so that samples are close enough to see when a contact slips."""


@dataclass(frozen=True, slots=True)
class HeldCase:
    """The settings with which executions are checked on known cases."""

    object_kg: float
    stiffness_n_per_m: float
    push_n: float
    """Largest push of a finger; the cases take less where the springs are too soft for it."""
    friction: float
    radius_m: float
    tip_radius_m: float
    tip_mass_kg: float
    damping_ratio: float
    physics: PhysicsSettings

    @property
    def halves(self) -> tuple[float, float, float]:
        """The half-widths (a, b, c) of the box [m]."""
        example = example_object("box")
        a, b, c = 0.5 * np.ptp(example.vertices, axis=0) * self.radius_m / example.radius
        return float(a), float(b), float(c)

    @property
    def push(self) -> float:
        """The push N of each finger [N]."""
        return min(self.push_n, SOFT * self.stiffness_n_per_m * self.halves[1])

    @property
    def slip_n(self) -> float:
        """The load along z at which the four fingers slip by statics, 4 mu N [N]."""
        return FINGERS * self.friction * self.push

    @property
    def light_n(self) -> float:
        """A load along each axis at once under which no fingertip slips or lifts off [N].

        Each contact takes a quarter q of it along each axis, and slips if 2^.5 q >= mu (N - q).
        """
        mu = self.friction
        return LIGHT * FINGERS * self.push * mu / (math.sqrt(2.0) + mu)

    @property
    def moving_kg(self) -> float:
        """What moves with the box: its own mass and that of the fingertips [kg]."""
        return self.object_kg + FINGERS * self.tip_mass_kg

    @property
    def frequency(self) -> float:
        """The natural frequency of the box along any axis, sqrt(4 k / (m + 4 m_t)) [rad/s]."""
        return math.sqrt(FINGERS * self.stiffness_n_per_m / self.moving_kg)

    def rise(self, slow: float = SLOW) -> Array:
        """Return shares of a load that grows in a time given in reciprocal frequencies, (n,)."""
        return smoother(samples(max(SHORTEST_S, slow / self.frequency)))

    def held_box(self) -> HeldScene:
        """Build the scene of the box between its fingers."""
        a, b, _ = self.halves
        return self._boxed([(a, 0.0, 1, 0), (-a, 0.0, -1, 0), (0.0, b, 0, 1), (0.0, -b, 0, -1)])

    def clamped_box(self) -> HeldScene:
        """Build the scene of the box with two fingers on each of the faces across x."""
        a, b, _ = self.halves
        return self._boxed([(x * a, 0.5 * y * b, x, 0) for x in (1, -1) for y in (1, -1)])

    def _boxed(self, places: list[tuple[float, float, int, int]]) -> HeldScene:
        contacts = [
            Contact(np.array([x, y, 0.0]), -np.array([out_x, out_y, 0.0]))
            for x, y, out_x, out_y in places
        ]
        squeeze = self.push * np.array([contact.normal for contact in contacts])
        return self.scene(sized("box", self.radius_m), contacts, squeeze, self.tip_radius_m)

    def scene(
        self, body: Polyhedron, contacts: list[Contact], squeeze: Array, tip_radius_m: float
    ) -> HeldScene:
        """Build a scene with the springs, masses and physics under test."""
        held = grip(
            body, contacts, contact_frictions(self.friction, len(contacts)), squeeze,
            stiffness=self.stiffness_n_per_m, tip_radius_m=tip_radius_m,
        )  # fmt: skip
        settings = HeldSettings(
            mass_kg=self.object_kg, tip_mass_kg=self.tip_mass_kg, damping_ratio=self.damping_ratio
        )
        return build_held_scene(body, held, settings, physics=self.physics)


def met(name: str, motion: HeldMotion, ratio: float) -> Check:
    """Check that a figure of a motion, over what is known in closed form, is one."""
    return near(name, None if motion.faults else ratio, TOLERANCE)


def little(name: str, motion: HeldMotion, value: float, most: float = TOLERANCE) -> Check:
    """Check that a figure of a motion is at most as large as it may be."""
    return Check(name, math.nan if motion.faults else value, 0.0, most)
