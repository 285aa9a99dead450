"""Checks that fingertips touch a mesh with the normals and depths of its faces.

If they do not, no verdict on the mesh counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.errors import UnfaithfulError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact
from sim_validate.simulation.setup import Setup
from sim_validate.simulation.simulate import first_touch

DEPTH = 1e-4
"""Depth to which rigid fingertips are put into the faces, in object radii. It is a thousand times
the rounding of a vertex coordinate, which meshes hold in single precision."""
NORMAL_ERROR = 1e-4
"""Largest angle between the normal of a contact and the normal of its face [rad]; the angle acts
like that much additional friction."""
DEPTH_ERROR = 0.1
"""Largest relative error of a contact's depth: vertices may be three hundredths of it off their
faces."""


@dataclass(frozen=True, slots=True)
class Touch:
    """The contact between fingertips and a mesh that differs most from the mesh's faces.

    The errors are NaN where a fingertip has no contact, or several.
    """

    finger: int
    normal_error_rad: float
    depth_error: float
    """Error of the contact's depth, relative to the right depth."""

    @property
    def right(self) -> bool:
        """Whether the errors of normal and depth are within their limits."""
        return self.normal_error_rad <= NORMAL_ERROR and self.depth_error <= DEPTH_ERROR


def worst_touch(body: Polyhedron, contacts: Sequence[Contact], setup: Setup) -> Touch:
    """Put fingertips a little into a mesh and find the contact that differs most from its face."""
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
    """Check that fingertips touch a mesh as its faces lie, where no pads are put between."""
    if setup.surface != "mesh":
        return
    worst = worst_touch(body, contacts, setup)
    if not worst.right:
        raise UnfaithfulError(
            f"in simulation, fingertip {worst.finger} does not touch the mesh as planned: the "
            f"contact normal is off by {worst.normal_error_rad:.3g} rad (at most "
            f"{NORMAL_ERROR:g} is allowed), the depth by a share of {worst.depth_error:.3g} (at "
            f"most {DEPTH_ERROR:g}; nan means no contact); use --surface pads, or raise "
            "ccd_iterations in the settings of the physics"
        )
