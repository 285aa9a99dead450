"""Fingertips in scenes: balls on slides, each of which a servo pushes, as MJCF bodies and geoms.

A servo is a spring with a damper: told `ctrl = f / kp`, it pushes with force f at its zero
position. Rigid fingertips have no slides. The fingertips of hands are in `chains`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.by_value import ByValue
from scenes.mujoco.mjcf_text import (
    FREE_JOINT,
    ORIGIN,
    TIP_LOOK,
    Element,
    Parts,
    add_element,
    add_servo,
    placed,
)


@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class Slides(ByValue):
    """Fingertips on slides, each of which has a servo: a spring with a damper."""

    tip_centers: Array
    """Centres of the fingertips at their contacts, (k, 3) [m]."""
    axes: Array
    """Columns: directions of each fingertip's slides, (k, 3, 3)."""
    tip_radii: Array
    tip_mass_kg: float
    stiffness: Array
    """Stiffness of each fingertip's servos, (k, 3) [N/m]; (k, 0) for rigid ones, which have no
    slides."""
    damping: Array
    """Coefficients of the dampers, of the same shape [N s/m]."""
    names: tuple[str, ...] = ("normal", "tangent1", "tangent2")
    """Endings of the names of a fingertip's slides."""
    most_push_n: float | None = None
    """Largest push along the first slide [N]."""

    @property
    def tip_names(self) -> tuple[str, ...]:
        """Return the names of the fingertips' shapes in the scene."""
        return tuple(f"finger{finger}" for finger in range(len(self.tip_radii)))

    @property
    def servo(self) -> Array:
        """Return the stiffness of all servos, (3k,) [N/m]."""
        return self.stiffness.ravel()

    @property
    def above_table(self) -> tuple[Array, Array]:
        """Return balls that a table must not meet: middles (n, 3) and radii (n,) [m]."""
        return self.tip_centers, self.tip_radii

    def tips(self, joints: Array) -> Array:
        """Compute where the centres of the fingertips are, (n, k, 3) [m], at slides (n, 3k) [m]."""
        slides = joints.reshape(len(joints), *self.stiffness.shape)
        return self.tip_centers + np.einsum("kij,nkj->nki", self._used_axes, slides)

    def efforts(self, forces: Array) -> Array:
        """Compute how servos push, (n, 3k) [N], for contact forces on the object, (n, k, 3) [N]."""
        pushes = np.einsum("kij,nki->nkj", self._used_axes, forces)
        return pushes.reshape(len(forces), self.stiffness.size)

    def joints(self, reached: Array) -> Array:
        """Find the positions of the slides, (3k,), that move tips along their axes, (k, 3) [m]."""
        return reached.ravel()

    def commanded(self, joints: Array) -> Array:
        """Return what servos are told where these positions are their zeros, (3k,) [m]."""
        return joints

    def seen(self, joints: Array, loads: Array, turned: Array) -> tuple[Array, Array, Array | None]:
        """See what fingers did in n samples, as the palm sees it.

        Gives displacements of fingertips, (n, k, 3) [m], and contact forces on the object,
        (n, k, 3) [N], along the axes, and orientations of fingertips, (n, k, 3, 3), or None
        where they do not turn.
        """
        shape = (len(turned), *self.stiffness.shape)
        return joints.reshape(shape), -loads.reshape(shape), None

    def add_to(
        self, parts: Parts, parent: Element, touching: Sequence[dict[str, Any]],
        _contact: dict[str, Any],
    ) -> None:  # fmt: skip
        """Add fingertips and servos to a body.

        Takes attributes of each fingertip that touches, and those of all other contacts.
        """
        inertia = 0.4 * self.tip_mass_kg * self.tip_radii**2
        for finger, name in enumerate(self.tip_names):
            place = placed(self.tip_centers[finger], self.axes[finger])
            body = add_element(parent, "body", {"name": name, "gravcomp": 1.0} | place)
            springs = zip(
                self.names, np.eye(3), self.stiffness[finger], self.damping[finger], strict=False
            )
            for number, (ending, axis, stiffness, damping) in enumerate(springs):
                joint = {"name": f"{name}_{ending}", "type": "slide", "axis": axis}
                add_element(body, "joint", FREE_JOINT | joint)
                most = None if number else self.most_push_n
                limits = None if most is None else (0.0, most)
                add_servo(parts["actuator"], f"{name}_{ending}", stiffness, damping, limits)
            own = {"pos": ORIGIN, "mass": self.tip_mass_kg, "diaginertia": (inertia[finger],) * 3}
            add_element(body, "inertial", own)
            ball = {"name": name, "type": "sphere", "size": self.tip_radii[finger]}
            add_element(body, "geom", ball | TIP_LOOK | touching[finger])

    @property
    def _used_axes(self) -> Array:
        return self.axes[:, :, : self.stiffness.shape[1]]
