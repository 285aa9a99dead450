"""Judges a grasp's contacts anew, and compares what they reach with what they reached before.

Contacts are judged as those of another tool are: force closure by a certificate, critical friction,
and the Ferrari-Canny quality about the centre of mass, at the radius of the part that they are on.
A grasp that is judged anew claims no regions, and its witness is of the general type, a regulus.

Bands: at friction mu, a critical friction counts as changed if it differs by more than
`FRICTION_BAND` mu, and a quality if its proved lower bound differs by more than `QUALITY_BAND` of
the old one. The band of critical frictions does not shrink with them: of a grasp whose forces meet
in a point, the critical friction is nearly zero, and any motion of a face multiplies it.
"""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, get_args

import numpy as np

from grasp_core.closure.critical_friction import critical_friction
from grasp_core.closure.force_closure import ClosureCertificate
from grasp_core.families.free import of_general_type
from grasp_core.families.placements import Placement
from grasp_core.objects.face_pieces import piece_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import Seated, grasp_of
from grasp_core.planning.reach import Finger, reach
from grasp_core.values import FINGERS, Grasp, Witness

Change: TypeAlias = Literal["same", "better", "worse", "gone"]
"""How a grasp of the changed part compares with that of the old part."""
CHANGES: tuple[Change, ...] = get_args(Change)
FRICTION_BAND = 0.05
"""Difference of critical frictions that does not count, as a share of the friction."""
QUALITY_BAND = 0.05
"""Difference of qualities that does not count, as a share of the old quality."""
DRAWS = 8
"""How often internal forces are drawn that may make the lines of a witness skew."""


@dataclass(frozen=True, slots=True)
class GraspFigures:
    """What contacts reach at a friction."""

    closure_margin: float
    """Proved margin of force closure; zero or negative where the contacts are not closed."""
    critical_friction: float
    """Smallest Coulomb coefficient above which the contacts are in force closure; at most the
    friction where they are closed, and infinite where none suffices."""
    ferrari_canny: tuple[float, float]
    """Proved lower and upper bound of the quality [N]; zeros where the contacts are not closed."""


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """Contacts on a part, judged."""

    figures: GraspFigures
    grasp: Grasp | None
    """The grasp that they make; None where they are not in force closure."""


def judged(body: Polyhedron, seated: Seated, friction: float, name: str) -> Judged:
    """Judge contacts on the faces of a part."""
    found = grasp_of(seated, friction, name)
    if isinstance(found, ClosureCertificate):
        critical = critical_friction(found.positions, found.normals)
        return Judged(GraspFigures(found.margin, critical, (0.0, 0.0)), None)
    figures = GraspFigures(found.closure_margin, found.critical_friction, found.ferrari_canny)
    return Judged(figures, with_general_witness(body, found, friction))


def with_general_witness(body: Polyhedron, grasp: Grasp, friction: float) -> Grasp | None:
    """Give a grasp of the family `regulus` balanced forces whose lines are skew.

    The forces of a certificate may all meet, as at the face centres of a regular solid.

    Gives the grasp; None if the friction cones leave too little room for skew lines.
    """
    center, size = body.center_of_mass, body.radius
    pieces = [
        piece_of(index, face.normal, (face.pieces[0] - center) / size)
        for index, face in ((index, body.faces[index]) for index in grasp.faces)
    ]
    positions = (grasp.positions - center) / size
    plain = Placement(
        positions, grasp.witness.forces, np.empty((0, 3)), np.zeros(FINGERS), 0.0
    )  # fmt: skip
    for draw in range(DRAWS):
        found = of_general_type(pieces, plain, friction, np.random.default_rng(draw))
        if found is not None:
            return replace(grasp, witness=Witness(grasp.positions, found.forces))
    return None


def reached(body: Polyhedron, grasp: Grasp, finger: Finger) -> Grasp | str:
    """Give a grasp free lines on which its fingers approach, or say why there are none."""
    ways = reach(body, grasp.faces, grasp.positions, grasp.normals, finger)
    if ways.directions is None:
        return ways.reason
    return replace(grasp, approach_directions=-ways.directions)


def compared(old: GraspFigures, new: GraspFigures, friction: float) -> tuple[Change, str]:
    """Say how the figures of a grasp that is still closed have changed, and which ones."""
    if old.closure_margin <= 0.0:
        return "better", f"not in force closure before, at friction {friction:g}"
    rise = new.critical_friction - old.critical_friction
    gain = new.ferrari_canny[0] - old.ferrari_canny[0]
    of_friction = f"critical friction {old.critical_friction:.4f} -> {new.critical_friction:.4f}"
    of_quality = f"quality {old.ferrari_canny[0]:.4f} -> {new.ferrari_canny[0]:.4f} N"
    allowed, band = FRICTION_BAND * friction, QUALITY_BAND * old.ferrari_canny[0]
    worse = [text for text, by in ((of_friction, rise - allowed), (of_quality, -gain - band))
             if by > 0.0]  # fmt: skip
    if worse:
        return "worse", "; ".join(worse)
    better = [text for text, by in ((of_friction, -rise - allowed), (of_quality, gain - band))
              if by > 0.0]  # fmt: skip
    return ("better", "; ".join(better)) if better else ("same", "")
