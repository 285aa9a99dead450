"""Holds the keywords of `plan` as one value, and checks them against the object."""

import math
from dataclasses import dataclass
from typing import get_args

from grasp_core.arrays import UNIT_SLACK
from grasp_core.errors import InputError
from grasp_core.kinds import METHODS, SMALLEST, Family, Method, number
from grasp_core.objects.on_faces import check_body
from grasp_core.objects.planar_faces import MAX_FACES
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.reach import Finger
from grasp_core.planning.settings import PlanSettings

FAMILIES: tuple[Family, ...] = get_args(Family)
"""The three families of grasps in the paper, each with its construction."""
ITS_RADIUS = ", the object's radius in m"
FARTHEST_APPROACH = 1e3
"""Longest free line of a finger, in object radii."""
COMPLETE_PARTS = 20_000
"""Parts into which `complete` may cut the faces of one quadruple."""
MOST_FACES = 1000
"""Most faces to plan with: tables of all pairs of faces and of all triples whose normals span then
take some hundred megabytes."""


@dataclass(frozen=True, slots=True, eq=False)
class PlanRequest(PlanSettings):
    """What is to be planned: the settings, and the fingers that must reach their contacts."""

    finger: Finger | None = None

    def _check_together(self) -> None:
        if self.complete and "free" not in self.families:
            raise InputError(
                "complete needs the free method, which decides all faces; add free to families"
            )
        if self.theta_deg is not None:
            widest = math.degrees(math.atan(self.friction))
            where = f", the angle of friction {self.friction}, or None"
            most = widest * (1.0 + UNIT_SLACK)
            number(self.theta_deg, "theta_deg", least=SMALLEST, most=most, where=where)

    @property
    def theta(self) -> float:
        """Half-angle of the friction cones to plan with [rad]."""
        theta = math.atan(self.friction)
        return theta if self.theta_deg is None else min(math.radians(self.theta_deg), theta)

    @property
    def searched(self) -> int | None:
        """Return how many grasps each family keeps while searching; None keeps all."""
        return self.limit if self.rank_by == "radius" and not self.complete else None


def methods_for(body: Polyhedron) -> tuple[Method, ...]:
    """Return the methods that commands try by default: all; without `free` on many faces."""
    return METHODS if len(body.faces) <= MAX_FACES else FAMILIES


def check_request(body: Polyhedron, request: PlanRequest) -> None:
    """Refuse keywords out of range, and objects with too many faces for the request."""
    check_body(body)
    size, finger = body.radius, request.finger
    number(request.edge_clearance_m, "edge_clearance_m", below=size, where=ITS_RADIUS)
    if request.share_faces_m is not None:
        where = ", the object's size, or None"
        number(request.share_faces_m, "share_faces_m", below=2.0 * size, where=where)
    if finger is not None:
        number(finger.radius_m, "finger.radius_m", most=size, where=ITS_RADIUS)
        farthest, where = FARTHEST_APPROACH * size, ", a thousand radii"
        number(finger.approach_m, "finger.approach_m", most=farthest, where=where)
    faces = len(body.faces)
    if faces > MOST_FACES:
        raise InputError(
            f"{body.name} has {faces} planar faces, over the limit of {MOST_FACES}; load it with "
            "patches for faces (--faces patches)"
        )
    needed = {
        "a limit (--limit)": request.limit is None,
        "families without the free method (--families)": "free" in request.families,
        "radius to rank by (--rank-by)": request.rank_by != "radius",
        "no --share-faces-m": request.share_faces_m is not None,
    }
    missing = [what for what, lacks in needed.items() if lacks]
    if faces > MAX_FACES and missing:
        raise InputError(
            f"{body.name} has {faces} planar faces, and objects with more than {MAX_FACES} need "
            f"simpler plans: give {' and '.join(missing)}; or load the object with patches for "
            "faces (--faces patches)"
        )
