"""Fingertips that touch a mesh must touch it as its faces lie, or no verdict on it counts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.errors import UnfaithfulError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact
from sim_validate.simulation.setup import Setup
from sim_validate.simulation.simulate import first_touch

DEPTH = 1e-4
"""How deep rigid fingertips are put into the faces, in object radii: a thousand times what single
precision, which vertices of meshes have, leaves of a coordinate."""
NORMAL_ERROR = 1e-4
"""Largest angle between a contact's normal and its face's [rad]: it acts like as much friction."""
DEPTH_ERROR = 0.1
"""Largest error of a depth, relative to it: vertices may be three hundredths off their faces."""


@dataclass(frozen=True, slots=True)
class Touch:
    """The worst contact of fingertips with a mesh; NaN where one has no contact, or several."""

    finger: int
    normal_error_rad: float
    depth_error: float
    """Relative to the depth."""

    @property
    def right(self) -> bool:
        """Whether contacts are as the faces lie."""
        return self.normal_error_rad <= NORMAL_ERROR and self.depth_error <= DEPTH_ERROR


def worst_touch(body: Polyhedron, contacts: Sequence[Contact], setup: Setup) -> Touch:
    """The contact farthest from what the faces say, of fingertips put a little into a mesh.

    Args:
        body: A convex object.
        contacts: On its faces.
        setup: How trials are simulated.
    """
    rigid = replace(setup, fingers=replace(setup.fingers, drive="rigid", indentation=0.0))
    size = rigid.scene(body, contacts, 1.0).layout.grasp_size_m
    depth = DEPTH * body.radius
    fingers = replace(rigid.fingers, indentation=depth / size)
    normals, depths = first_touch(replace(rigid, fingers=fingers).scene(body, contacts, 1.0))
    faces = np.array([contact.normal for contact in contacts])
    turned = np.arctan2(
        np.linalg.norm(np.cross(normals, faces), axis=1), np.einsum("ki,ki->k", normals, faces)
    )
    off = np.abs(depths / depth - 1.0)
    errors = np.nan_to_num(np.maximum(turned / NORMAL_ERROR, off / DEPTH_ERROR), nan=np.inf)
    finger = int(np.argmax(errors))
    return Touch(finger, float(turned[finger]), float(off[finger]))


def require_touch(body: Polyhedron, contacts: Sequence[Contact], setup: Setup) -> None:
    """Check the contacts of a grasp, where fingertips touch the mesh.

    Raises:
        UnfaithfulError: A contact is not as its face lies; what is simulated would not count.
    """
    if setup.surface != "mesh":
        return
    worst = worst_touch(body, contacts, setup)
    if not worst.right:
        raise UnfaithfulError(
            f"fingertip {worst.finger} does not touch the mesh as its face lies: the normal is off "
            f"by {worst.normal_error_rad:.3g} rad (at most {NORMAL_ERROR:g}), the depth by "
            f"{worst.depth_error:.3g} of it (at most {DEPTH_ERROR:g}; nan is no contact); let "
            "fingertips touch pads, or raise ccd_iterations"
        )
