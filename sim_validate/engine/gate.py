"""Checks the simulator on cases with known answers before any grasp is simulated.

It is checked with the settings, friction and object size in force: on cases from statics
(`known_cases`), and, where fingertips touch the mesh itself, for the normals and depths with which
they touch its faces. If a check fails, no grasp is simulated, and no verdict on the mesh counts.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array
from grasp_core.declared import Declared
from grasp_core.errors import UnfaithfulError
from grasp_core.files.records import recorded
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from grasp_core.values import Contact
from sim_validate.engine.bench import first_touch
from sim_validate.engine.known_cases import Case, Check, known_answers
from sim_validate.engine.setup import Setup

DEPTH = 1e-4
"""Depth to which rigid fingertips are put into the faces, in object radii. It is a thousand times
the rounding of a vertex coordinate, which meshes hold in single precision."""
NORMAL_ERROR = 1e-4
"""Largest angle between the normal of a contact and the normal of its face [rad]; the angle acts
like that much additional friction."""
DEPTH_ERROR = 0.1
"""Largest relative error of a contact's depth: vertices may be three hundredths of it off their
faces."""
MANY_FACED, FINGERS = "random-100-1", 20
"""An example mesh with many faces, and how many fingertips touch it at a time."""


def worst_touch(
    body: Polyhedron, contacts: Sequence[Contact], setup: Setup
) -> tuple[int, float, float]:
    """Put fingertips a little into a mesh and find the contact that differs most from its face.

    Gives the finger, the error of its normal [rad], and the relative one of its depth; NaN where a
    fingertip has no contact, or several.
    """
    rigid = replace(setup, fingers=replace(setup.fingers, drive="rigid", indentation=0.0))
    size = rigid.scene(body, contacts, 1.0).layout.grasp_size_m
    depth = DEPTH * body.radius
    fingers = replace(rigid.fingers, indentation=depth / size)
    normals, depths = first_touch(replace(rigid, fingers=fingers).scene(body, contacts, 1.0))
    turned = angles(normals, np.array([contact.normal for contact in contacts]))
    off = np.abs(depths / depth - 1.0)
    errors = np.nan_to_num(np.maximum(turned / NORMAL_ERROR, off / DEPTH_ERROR), nan=np.inf)
    finger = int(np.argmax(errors))
    return finger, float(turned[finger]), float(off[finger])


def angles(normals: Array, faces: Array) -> Array:
    """Return the angles between normals and those of their faces, (k,) [rad]."""
    across = np.linalg.norm(np.cross(normals, faces), axis=1)
    return np.arctan2(across, np.einsum("ki,ki->k", normals, faces))


def require_touch(body: Polyhedron, contacts: Sequence[Contact], setup: Setup) -> None:
    """Check that fingertips touch a mesh as its faces lie, where no pads are put between."""
    if setup.surface != "mesh":
        return
    finger, turned, off = worst_touch(body, contacts, setup)
    if not (turned <= NORMAL_ERROR and off <= DEPTH_ERROR):
        raise UnfaithfulError(
            f"in simulation, fingertip {finger} does not touch the mesh as planned: the contact "
            f"normal is off by {turned:.3g} rad (at most {NORMAL_ERROR:g} is allowed), the depth "
            f"by a share of {off:.3g} (at most {DEPTH_ERROR:g}; nan means no contact); use "
            "--surface pads, or raise ccd_iterations in the settings of the physics"
        )


def mesh_touches(case: Case) -> tuple[Check, Check]:
    """Check how fingertips touch the faces of a mesh with many faces."""
    body = case.body(MANY_FACED)
    contacts = [Contact(face.centroid, face.normal) for face in body.faces]
    groups = [contacts[start : start + FINGERS] for start in range(0, len(contacts), FINGERS)]
    _, turned, off = np.transpose([worst_touch(body, group, case.setup) for group in groups])
    return touch_checks(turned, off)


def touch_checks(turned: Array, off: Array, where: str = "") -> tuple[Check, Check]:
    """Check the largest errors of contacts' normals [rad] and depths; NaN if one is."""
    normal = f"angle between a contact's normal and its face's{where}"
    depth = f"error of a contact's depth, relative to it{where}"
    return (
        Check(normal, float(np.max(turned)), 0.0, NORMAL_ERROR),
        Check(depth, float(np.max(off)), 0.0, DEPTH_ERROR),
    )


USUAL_FRICTION, USUAL_RADIUS_M = 0.5, 0.07
MOST_KNOWN = 256
"""Number of settings whose results are kept."""


@dataclass(frozen=True, slots=True)
class Gate(Declared):
    """The results of checking a version of MuJoCo on cases with known answers."""

    checks: tuple[Check, ...]
    mujoco: str

    @recorded
    def passed(self) -> bool:
        """Whether all checks passed."""
        return all(check.passed for check in self.checks)

    def require(self, so: str) -> None:
        """Refuse settings under which a check failed, and say what is `so` not done with them."""
        if not self.passed:
            failed = "; ".join(str(check) for check in self.checks if not check.passed)
            raise UnfaithfulError(
                f"the simulator is not faithful with these settings, so {so}; these checks failed: "
                f"{failed}"
            )


_KNOWN: dict[Case, Gate] = {}


def require_faithful(
    setup: Setup, friction: float = USUAL_FRICTION, radius_m: float = USUAL_RADIUS_M
) -> Gate:
    """Check the simulator on known cases, and refuse settings under which a check fails."""
    gate = measured_gate(setup, friction, radius_m)
    gate.require("no grasp is certified")
    return gate


def measured_gate(
    setup: Setup, friction: float = USUAL_FRICTION, radius_m: float = USUAL_RADIUS_M
) -> Gate:
    """Check the simulator on known cases, once per process for the same settings."""
    case = _case(setup, friction, radius_m)
    if case in _KNOWN:
        return _KNOWN[case]
    pads = replace(case, setup=replace(case.setup, surface="pads"))  # controls are always on pads
    checks = known_answers(pads)
    if setup.surface == "mesh":
        meshes = (*mesh_touches(case), *known_answers(case))
        checks += tuple(replace(check, name=f"on a mesh: {check.name}") for check in meshes)
    return _kept(case, Gate(checks, versions()["mujoco"]))


def remember_gate(gate: Gate, setup: Setup, friction: float, radius_m: float) -> None:
    """Take over what `measured_gate` returned in the process that started this one."""
    _kept(_case(setup, friction, radius_m), gate)


def _case(setup: Setup, friction: float, radius_m: float) -> Case:
    # Two digits of the radius let objects of nearly the same size share one measurement.
    fingers = replace(setup.fingers, fingertip_radius_m=None, approach=None)
    setup = replace(setup, fingers=fingers, threads=1, timeout_s=math.inf)
    return Case(setup, friction, float(f"{radius_m:.1e}"))


def _kept(case: Case, gate: Gate) -> Gate:
    _KNOWN[case] = gate
    if len(_KNOWN) > MOST_KNOWN:
        del _KNOWN[next(iter(_KNOWN))]
    return gate
