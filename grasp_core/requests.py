"""What is asked of the planner, checked."""

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from grasp_core.arrays import UNIT_SLACK
from grasp_core.errors import InputError
from grasp_core.planar_faces import MAX_FACES
from grasp_core.reach import Finger
from grasp_core.values import LARGEST_FRICTION, Family, Method, Polyhedron

FAMILIES: tuple[Family, ...] = get_args(Family)
"""The families of the paper, each with its construction."""
METHODS: tuple[Method, ...] = get_args(Method)
"""Everything that `families` may name: the three constructions and `free`."""
ConeKind: TypeAlias = Literal["tilted", "normal"]
RankBy: TypeAlias = Literal["radius", "friction-margin", "ferrari-canny", "diverse"]
"""What makes one grasp better than another."""
COMPLETE_CELLS = 20_000
"""Parts into which `complete` may cut the faces of one quadruple."""
MOST_FACES = 1000
"""Tables of all pairs and, of those whose normals span, triples of faces take some hundred
megabytes."""


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """The keywords of `plan`."""

    friction: float
    families: tuple[Method, ...]
    theta_deg: float | None = None
    cones: ConeKind = "tilted"
    limit: int | None = None
    rank_by: RankBy = "radius"
    seed: int = 0
    cells: int = 1
    complete: bool = False
    finger: Finger | None = None
    clearance: float = 0.0
    share_faces: float | None = None

    @property
    def theta(self) -> float:
        """Half-angle of the friction cones to plan with [rad]."""
        theta = math.atan(self.friction)
        return theta if self.theta_deg is None else min(math.radians(self.theta_deg), theta)

    @property
    def searched(self) -> int | None:
        """How many grasps of each family need to be kept while searching."""
        return self.limit if self.rank_by == "radius" and not self.complete else None


def methods_for(body: Polyhedron) -> tuple[Method, ...]:
    """What a command tries unless told otherwise: on many faces not the free method."""
    return METHODS if len(body.faces) <= MAX_FACES else FAMILIES


def check_request(body: Polyhedron, request: PlanRequest) -> None:
    """Refuse what cannot be planned.

    Raises:
        InputError: A keyword is out of range, or the object has too many faces.
    """
    if not 0.0 < request.friction <= LARGEST_FRICTION:
        raise InputError(
            f"friction must be a positive number up to {LARGEST_FRICTION:g}, got {request.friction}"
        )
    _check_angle(request)
    _check_kinds(request)
    for name, value in (("limit", request.limit), ("cells", request.cells)):
        if value is not None and value < 1:
            raise InputError(f"{name} must be at least 1, got {value}")
    if not 0.0 <= request.clearance < body.radius:
        raise InputError(
            f"clearance must be from 0 to the object's radius of {body.radius:.4g} m, got "
            f"{request.clearance}"
        )
    if request.share_faces is not None and not 0.0 <= request.share_faces < 2.0 * body.radius:
        raise InputError(
            f"share_faces must be from 0 to the object's size of {2.0 * body.radius:.4g} m, got "
            f"{request.share_faces}"
        )
    _check_size(body, request)


def _check_size(body: Polyhedron, request: PlanRequest) -> None:
    faces = len(body.faces)
    if faces > MOST_FACES:
        raise InputError(
            f"{body.name} has {faces} planar faces, over the limit of {MOST_FACES}; load it with "
            "patches for faces (--faces patches)"
        )
    needed = {
        "a limit (--limit)": request.limit is None,
        "families without the free method (--family)": "free" in request.families,
        "radius to rank by (--rank-by)": request.rank_by != "radius",
        "no share_faces (--share-faces-m)": request.share_faces is not None,
    }
    missing = [what for what, lacks in needed.items() if lacks]
    if faces > MAX_FACES and missing:
        raise InputError(
            f"{body.name} has {faces} planar faces: above {MAX_FACES} only the largest grasps of "
            f"{', '.join(FAMILIES)} are planned. Give {' and '.join(missing)}, or load it with "
            "patches for faces (--faces patches)"
        )


def _check_kinds(request: PlanRequest) -> None:
    unknown = [family for family in request.families if family not in METHODS]
    if unknown or not request.families:
        raise InputError(
            f"families must be among {', '.join(METHODS)}; got {list(request.families)}"
        )
    if request.complete and "free" not in request.families:
        raise InputError("complete decides all faces, which takes the free method; add it")
    for name, value, kinds in (
        ("cones", request.cones, get_args(ConeKind)),
        ("rank_by", request.rank_by, get_args(RankBy)),
    ):
        if value not in kinds:
            raise InputError(f"{name} must be one of {', '.join(kinds)}, got {value!r}")


def _check_angle(request: PlanRequest) -> None:
    if request.theta_deg is None:
        return
    widest = math.degrees(math.atan(request.friction))
    if not 0.0 < request.theta_deg <= widest * (1.0 + UNIT_SLACK):
        raise InputError(
            f"theta_deg must be in (0, {widest:.6g}], up to the friction angle of "
            f"friction {request.friction}; got {request.theta_deg}. Raise the friction or lower "
            "theta"
        )
