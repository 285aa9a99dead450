"""Finds where a contact or a face of an old part is on the surface of a changed one.

Solved: given a point p of the old surface with the inward normal n, the point q of the new surface
that takes its place. Both parts are in the same frame and unit.

Rules, in this order:

1. A face is *like* n if its own inward normal makes an angle of at most `angle` with n.
2. On each like face, the candidate is the point nearest to p, its holes and notches left out: the
   foot of the perpendicular, or a point of the border if the foot is outside.
3. The nearest candidate is q if |q - p| <= `distance`. Of candidates that are equally near, to
   within `SAME` of the old part's size, the one on the face with the lowest number is q.
4. Otherwise p has no place on the new surface.

Therefore a point on a face that has moved along its normal by h goes straight along that normal, by
h; one on a face that has not changed stays where it is; and one where a hole was drilled goes to
the rim of the hole. Nothing is found through the part: the face on the other side of a plate has
the opposite normal, which is never like.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from grasp_core.arrays import Array
from grasp_core.checked import BOUNDS, instance, number
from grasp_core.errors import InputError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import FlatPart, Nearest, flat_parts, nearest_like

SHARE_OF_SIZE = 0.05
"""Default for how far a contact may move, relative to the old part's radius."""
ANGLE_DEG = 5.0
"""Default for the largest angle between the normals of like faces [deg]."""
WIDEST_DEG = BOUNDS["changed_by_deg"]["most"]
"""Largest such angle that is accepted [deg]: beyond it, a face of a box and its chamfer would be
like each other."""
SAME = 1e-9
"""Difference of distances, relative to the old part's radius, and of angles [rad] that is rounding:
a face that has moved by exactly the allowed distance is still near enough."""


@dataclass(frozen=True, slots=True)
class Likeness:
    """How near, and how little turned, a face must be to take the place of another one."""

    distance: float
    """Largest distance by which a contact may move [m]."""
    angle: float
    """Largest angle between the two normals [rad]."""
    same: float
    """Difference of distances that is rounding [m]."""


def likeness(old: Polyhedron, distance: float | None, angle_deg: float) -> Likeness:
    """Build the rule for an old part."""
    where = f", the part's radius in m, or None for {SHARE_OF_SIZE:g} of it"
    usual = SHARE_OF_SIZE * old.radius
    most = usual if distance is None else distance
    return Likeness(
        number(most, "distance", least=0.0, most=old.radius, where=where),
        math.radians(number(angle_deg, "angle_deg", **BOUNDS["changed_by_deg"])),
        SAME * old.radius,
    )


def check_planar(body: Polyhedron, name: str) -> None:
    """Refuse a value that is no part, or a part whose faces are patches of a curved surface."""
    instance(body, Polyhedron, name, "gc.load_polyhedron reads one from a mesh file")
    if body.patches is not None:
        raise InputError(
            f"{name} must have exact planar faces, but {body.name} was read as patches of a curved "
            "surface; read it with faces='planar', or plan on the changed part anew"
        )


def place_of(new: Polyhedron, point: Array, normal: Array, rule: Likeness) -> Nearest | None:
    """Find the point of a changed part that takes an old one's place; None if there is none."""
    return _nearest(_parts(new), point, normal, rule, rule.distance + rule.same)


def nearest_at_any_distance(
    new: Polyhedron, point: Array, normal: Array, rule: Likeness
) -> Nearest | None:
    """Find the nearest point on a like face, however far; None if no face is like."""
    return _nearest(_parts(new), point, normal, rule, math.inf)


def _nearest(
    parts: Sequence[FlatPart], point: Array, normal: Array, rule: Likeness, reach: float
) -> Nearest | None:
    return nearest_like(parts, point, normal, lean=rule.angle + SAME, reach=reach, margin=rule.same)


@lru_cache(maxsize=8)
def _parts(body: Polyhedron) -> tuple[FlatPart, ...]:
    """List the parts of a surface once: they are searched for every contact."""
    return flat_parts(body)
